#ifndef DYNMESH_SERVER_RPC_BACKUP_REACTOR_H_
#define DYNMESH_SERVER_RPC_BACKUP_REACTOR_H_

#include <memory>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "dynmesh/v1/backups.pb.h"
#include "grpcpp/server_context.h"
#include "grpcpp/support/server_callback.h"
#include "server/rpc/call_stop.h"
#include "server/rpc/service_context.h"
#include "server/session/access_queue.h"
#include "server/session/backup/backup_writer.h"
#include "server/session/budget.h"
#include "server/session/mutex.h"

namespace dynmesh {

/// One BackupSession call.
///
///     turn at the session ──> copy ──> what it is ──> piece (heavy executor) ──> piece ... ──> end
///
/// A piece is made when the one before is on its way, so a slow peer holds the copy, which counts against
/// max_backup_bytes, and no thread. Writing ends early when the call is cancelled or its deadline passes, and
/// when the peer has taken nothing for import_idle_timeout: then the copy is given back at once, and the peer
/// is told behind what is on its way. Deletes itself.
class BackupReactor final : public grpc::ServerWriteReactor<v1::BackupSessionResponse> {
 public:
  BackupReactor(const ServiceContext& services, grpc::CallbackServerContext* context,
                const v1::BackupSessionRequest& request)
      : services_(services),
        session_name_(request.session()),
        stop_(context),
        lease_(services.registry.backup_budget()) {}

  BackupReactor* Start();

  void OnWriteDone(bool ok) override;
  void OnDone() override;

 private:
  /// What the timer, which cannot be stopped, holds of a reactor that may be gone.
  struct Watch {
    Mutex mu;
    BackupReactor* reactor ABSL_GUARDED_BY(mu);
  };

  void WatchUntil(absl::Time when);
  void OnWatch() ABSL_LOCKS_EXCLUDED(mu_);
  absl::Status Post();
  void CopyAndWrite(const Session& session, AccessGrant grant);
  absl::Status Copy(const Session& session, AccessGrant& grant);
  void Write() ABSL_LOCKS_EXCLUDED(mu_);
  void WriteNext();
  /// False when all is told.
  absl::StatusOr<bool> FillNext();
  /// Gives the copy back, then ends the call. Called once.
  void EndWith(const absl::Status& status) ABSL_LOCKS_EXCLUDED(mu_);

  const ServiceContext services_;
  const std::string session_name_;
  const CallStop stop_;
  const std::shared_ptr<Watch> watch_ = std::make_shared<Watch>();
  std::unique_ptr<BackupWriter> writer_;
  Lease lease_;  ///< of the daemon's max_backup_bytes
  std::string piece_;
  size_t next_ = 0;  ///< byte of the piece to be written
  v1::BackupSessionResponse response_;

  Mutex mu_;
  bool ended_ ABSL_GUARDED_BY(mu_) = false;
  /// Since when the peer is waited for; infinite future: it is not.
  absl::Time waiting_since_ ABSL_GUARDED_BY(mu_) = absl::InfiniteFuture();
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_RPC_BACKUP_REACTOR_H_
