#ifndef DYNMESH_SERVER_RPC_CALL_STOP_H_
#define DYNMESH_SERVER_RPC_CALL_STOP_H_

#include <chrono>

#include "grpcpp/server_context.h"
#include "server/session/session_errors.h"
#include "server/session/stop_signal.h"

namespace dynmesh {

/// Stops when the call was cancelled: by its peer, or because the time to drain is over. And when its
/// deadline has passed.
class CallStop final : public StopSignal {
 public:
  /// REQUIRES: `context` outlives this.
  explicit CallStop(const grpc::CallbackServerContext* context) : context_(context) {}

  absl::Status Check() const override {
    if (std::chrono::system_clock::now() > context_->deadline()) return DeadlinePassed();
    return context_->IsCancelled() ? CallCancelled() : absl::OkStatus();
  }

 private:
  const grpc::CallbackServerContext* const context_;
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_RPC_CALL_STOP_H_
