#ifndef DYNMESH_SERVER_RPC_CHECK_REACTOR_H_
#define DYNMESH_SERVER_RPC_CHECK_REACTOR_H_

#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "dynmesh/v1/checks.pb.h"
#include "grpcpp/server_context.h"
#include "grpcpp/support/server_callback.h"
#include "server/rpc/call_stop.h"
#include "server/rpc/convert_checks.h"
#include "server/rpc/service_context.h"
#include "server/session/access_queue.h"
#include "server/session/budget.h"
#include "server/session/mutex.h"

namespace dynmesh {

/// One CheckSession call.
///
///     turn at the session ──> copy ──> check (heavy executor), telling progress ──> findings ──> summary
///
/// One write is in flight at a time: progress is told when none is, and left out else. Checking ends early
/// when the call is cancelled or its deadline passes. Findings count against max_answer_bytes until they are
/// sent. Deletes itself.
class CheckReactor final : public grpc::ServerWriteReactor<v1::CheckSessionResponse>, public ReportMonitor {
 public:
  CheckReactor(const ServiceContext& services, grpc::CallbackServerContext* context,
               const v1::CheckSessionRequest& request);

  CheckReactor* Start();

  void OnWriteDone(bool ok) override ABSL_LOCKS_EXCLUDED(mu_);
  void OnDone() override { delete this; }

  /// Called by the thread that checks.
  void OnProgress(absl::string_view phase, uint64_t done, uint64_t total) override ABSL_LOCKS_EXCLUDED(mu_);

 private:
  absl::Status Post();
  absl::Status Check(const Session& session, AccessGrant& grant);
  void CheckAndAnswer(const Session& session, AccessGrant grant) ABSL_LOCKS_EXCLUDED(mu_);
  /// Writes what comes next of the answer, or ends the call. Only when the checks are done and no write is in
  /// flight, so it needs no lock.
  void WriteNext();
  absl::Status FillNext();

  const ServiceContext services_;
  const v1::CheckSessionRequest request_;
  const CallStop stop_;
  Lease lease_;  ///< of the daemon's max_answer_bytes
  absl::Status status_;
  CheckReport report_;
  std::vector<FindingsPiece> pieces_;
  size_t next_ = 0;  ///< piece to be written; then the summary
  int64_t revision_ = 0;
  v1::CheckSessionResponse response_;

  Mutex mu_;
  bool writing_ ABSL_GUARDED_BY(mu_) = false;
  bool checked_ ABSL_GUARDED_BY(mu_) = false;
  bool broken_ ABSL_GUARDED_BY(mu_) = false;  ///< the peer is gone
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_RPC_CHECK_REACTOR_H_
