#ifndef DYNMESH_SERVER_RPC_ADAPT_REACTOR_H_
#define DYNMESH_SERVER_RPC_ADAPT_REACTOR_H_

#include <memory>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "dynmesh/v1/adapt.pb.h"
#include "grpcpp/support/server_callback.h"
#include "server/rpc/call_stop.h"
#include "server/rpc/service_context.h"
#include "server/session/access_queue.h"
#include "server/session/adaptation.h"
#include "server/session/mutex.h"

namespace dynmesh {

/// One AdaptSession call.
///
///     start (its turn to read) ──> step (its turn to write) ──> step ... ──> result (its turn to read)
///
/// All on the heavy threads, none of which is held between two steps, so that others get theirs. Progress is
/// written when no write is in flight, and left out else. The call ends when it is cancelled, or its deadline
/// has passed, after the step under way. Deletes itself.
class AdaptReactor final : public grpc::ServerWriteReactor<v1::AdaptSessionResponse> {
 public:
  AdaptReactor(const ServiceContext& services, grpc::CallbackServerContext* context,
               const v1::AdaptSessionRequest& request)
      : services_(services), stop_(context), request_(request) {}

  AdaptReactor* Start();

  void OnWriteDone(bool ok) override;
  void OnDone() override { delete this; }

 private:
  using Work = absl::Status (AdaptReactor::*)(AccessGrant);

  absl::Status PostStart();
  /// Runs `work` when it is its turn.
  void PostNext(AccessMode mode, Work work);
  void GoOnAfter(const absl::Status& status);
  absl::Status Begin(const SessionPtr& session, AccessGrant grant);
  absl::Status Step(AccessGrant grant);
  absl::Status Conclude(AccessGrant grant);
  void WriteProgress() ABSL_LOCKS_EXCLUDED(mu_);
  /// Ends the call, after the write that is in flight. Called once.
  void EndWith(const absl::Status& status) ABSL_LOCKS_EXCLUDED(mu_);
  void FinishNow(const absl::Status& status);

  const ServiceContext services_;
  const CallStop stop_;
  const v1::AdaptSessionRequest request_;
  std::unique_ptr<Adaptation> adaptation_;
  v1::AdaptSessionResponse progress_;
  v1::AdaptSessionResponse result_;
  bool concluded_ = false;  ///< result_ is there

  Mutex mu_;
  bool writing_ ABSL_GUARDED_BY(mu_) = false;
  bool ending_ ABSL_GUARDED_BY(mu_) = false;
  absl::Status end_ ABSL_GUARDED_BY(mu_);
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_RPC_ADAPT_REACTOR_H_
