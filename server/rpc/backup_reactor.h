#ifndef DYNMESH_SERVER_RPC_BACKUP_REACTOR_H_
#define DYNMESH_SERVER_RPC_BACKUP_REACTOR_H_

#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "dynmesh/v1/backups.pb.h"
#include "grpcpp/server_context.h"
#include "grpcpp/support/server_callback.h"
#include "server/rpc/call_stop.h"
#include "server/rpc/service_context.h"
#include "server/session/access_queue.h"
#include "server/session/backup/backup_writer.h"
#include "server/session/budget.h"

namespace dynmesh {

/// One BackupSession call.
///
///     turn at the session ──> copy ──> what it is ──> piece (heavy executor) ──> piece ... ──> end
///
/// A piece is made when the one before is on its way, so a slow peer holds the copy, which counts against
/// max_backup_bytes, and no thread. Writing ends early when the call is cancelled or its deadline passes.
/// Deletes itself.
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
  void OnDone() override { delete this; }

 private:
  absl::Status Post();
  void CopyAndWrite(const Session& session, AccessGrant grant);
  absl::Status Copy(const Session& session, AccessGrant& grant);
  void WriteNext();
  /// False when all is told.
  absl::StatusOr<bool> FillNext();
  /// Gives the copy back, then ends the call.
  void EndWith(const absl::Status& status);

  const ServiceContext services_;
  const std::string session_name_;
  const CallStop stop_;
  std::unique_ptr<BackupWriter> writer_;
  Lease lease_;  ///< of the daemon's max_backup_bytes
  std::string piece_;
  size_t next_ = 0;  ///< byte of the piece to be written
  v1::BackupSessionResponse response_;
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_RPC_BACKUP_REACTOR_H_
