#ifndef DYNMESH_SERVER_RPC_RESTORE_REACTOR_H_
#define DYNMESH_SERVER_RPC_RESTORE_REACTOR_H_

#include <atomic>
#include <memory>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/time/time.h"
#include "dynmesh/v1/backups.pb.h"
#include "grpcpp/server_context.h"
#include "grpcpp/support/server_callback.h"
#include "server/rpc/service_context.h"
#include "server/session/backup/backup_reader.h"
#include "server/session/backup/backup_session.h"
#include "server/session/importer/importer.h"
#include "server/session/mutex.h"

namespace dynmesh {

/// One RestoreBackup call.
///
///     read ──> header, bytes (heavy executor) ──> read ... ──> half-closed ──> mesh, session (heavy
///     executor)
///
/// It counts as an import, and what the mesh takes as staged, until it is done or refused. A peer that sends
/// nothing for import_idle_timeout is not waited for. A cut stream is never taken for a whole one: a backup
/// says itself where it ends. Deletes itself.
class RestoreReactor final : public grpc::ServerReadReactor<v1::RestoreBackupRequest> {
 public:
  RestoreReactor(const ServiceContext& services, grpc::CallbackServerContext* context,
                 v1::RestoreBackupResponse* response)
      : services_(services), context_(context), response_(response) {}

  RestoreReactor* Start();

  void OnReadDone(bool ok) override;
  void OnCancel() override { cancelled_ = true; }
  void OnDone() override;

 private:
  /// What the timer, which cannot be stopped, holds of a reactor that may be gone.
  struct Watch {
    Mutex mu;
    RestoreReactor* reactor ABSL_GUARDED_BY(mu);
  };

  void ReadNext() ABSL_LOCKS_EXCLUDED(mu_);
  void WatchUntil(absl::Time when);
  void OnWatch() ABSL_LOCKS_EXCLUDED(mu_);
  void Receive();
  void Build();
  absl::Status ReceivePart();
  absl::Status Begin();
  absl::Status AddBytes();
  absl::Status BuildSession();
  /// OK unless nobody waits for the answer any more.
  absl::Status CheckWanted() const;
  /// Gives back what is held, then ends the call. Called once.
  void EndWith(const absl::Status& status) ABSL_LOCKS_EXCLUDED(mu_);

  const ServiceContext services_;
  grpc::CallbackServerContext* const context_;
  v1::RestoreBackupResponse* const response_;
  const std::shared_ptr<Watch> watch_ = std::make_shared<Watch>();
  std::atomic<bool> cancelled_{false};
  v1::RestoreBackupRequest request_;
  BackupRestoreOptions options_;
  std::unique_ptr<ImportGate::Ticket> ticket_;
  std::unique_ptr<BackupReader> reader_;  ///< null before the header; holds what it takes of max_staged_bytes
  bool is_checked_ = false;               ///< that the session can be made

  Mutex mu_;
  bool ended_ ABSL_GUARDED_BY(mu_) = false;
  /// Since when the peer is waited for; infinite future: it is not.
  absl::Time waiting_since_ ABSL_GUARDED_BY(mu_) = absl::InfiniteFuture();
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_RPC_RESTORE_REACTOR_H_
