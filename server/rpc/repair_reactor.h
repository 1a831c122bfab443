#ifndef DYNMESH_SERVER_RPC_REPAIR_REACTOR_H_
#define DYNMESH_SERVER_RPC_REPAIR_REACTOR_H_

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/types/optional.h"
#include "dynmesh/v1/repairs.pb.h"
#include "grpcpp/server_context.h"
#include "grpcpp/support/server_callback.h"
#include "server/rpc/call_stop.h"
#include "server/rpc/service_context.h"
#include "server/rpc/session_work.h"
#include "server/session/budget.h"
#include "server/session/mutex.h"
#include "server/session/repair_session.h"

namespace dynmesh {

/// One RepairSession call.
///
///     wait for the session ──> repair (heavy executor), progress meanwhile ──> result
///
/// Progress is written when no write is in flight, and left out else. Deletes itself.
class RepairReactor final : public grpc::ServerWriteReactor<v1::RepairSessionResponse> {
 public:
  RepairReactor(const ServiceContext& services, const grpc::CallbackServerContext* context,
                const v1::RepairSessionRequest& request)
      : services_(services), stop_(context), request_(request), lease_(services.registry.answer_budget()) {}

  RepairReactor* Start();

  void OnWriteDone(bool ok) override;
  void OnDone() override { delete this; }

 private:
  absl::Status Post();
  absl::Status Repair(Session& session);
  void WriteProgress(size_t steps_done, int64_t revision) ABSL_LOCKS_EXCLUDED(mu_);
  /// Ends the call, after the write that is in flight. Called once.
  void EndWith(const absl::Status& status) ABSL_LOCKS_EXCLUDED(mu_);
  void WriteEnd(const absl::Status& status);

  const ServiceContext services_;
  const CallStop stop_;
  const v1::RepairSessionRequest request_;
  Lease lease_;  ///< of the daemon's max_answer_bytes: the result that waits to be read
  RepairRequest repair_;
  v1::RepairSessionResponse progress_;
  v1::RepairSessionResponse result_;

  Mutex mu_;
  bool writing_ ABSL_GUARDED_BY(mu_) = false;
  absl::optional<absl::Status> end_ ABSL_GUARDED_BY(mu_);  ///< once it is known
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_RPC_REPAIR_REACTOR_H_
