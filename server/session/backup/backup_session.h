#ifndef DYNMESH_SERVER_SESSION_BACKUP_BACKUP_SESSION_H_
#define DYNMESH_SERVER_SESSION_BACKUP_BACKUP_SESSION_H_

#include <memory>
#include <string>

#include "absl/functional/function_ref.h"
#include "absl/status/statusor.h"
#include "server/session/backup/backup_reader.h"
#include "server/session/backup/backup_writer.h"
#include "server/session/budget.h"
#include "server/session/registry.h"
#include "server/session/session.h"

/// Backups of sessions that are edited meanwhile, and sessions of backups.
namespace dynmesh {

/// A backup that is to be written.
struct SessionBackup {
  SessionInfo info;  ///< of the session at the revision of the backup
  std::unique_ptr<BackupWriter> writer;
};

/// Copies a session; `lease` grows by the copy before it is made. Whoever edits waits for as long as that
/// takes, until `copied` is called.
/// Errors: those of Session::Read and of the lease. Cost: copying the mesh, and scanning it for the info.
absl::StatusOr<SessionBackup> BeginBackup(const Session& session, Lease& lease,
                                          absl::FunctionRef<void()> copied);

/// How a session is to be made of a backup; the fields are those of RestoreHeader.
struct BackupRestoreOptions {
  std::string name = {};                                       ///< empty: that of the backup
  SessionDurability durability = SessionDurability::kDefault;  ///< kDefault: that of the backup
  std::string request_id = {};
  bool validate_only = false;
};

/// OK unless it is clear already that CreateFrom will refuse it: the name is taken, or there is no store.
/// What a retry may be is let through.
absl::Status CheckRestore(const SessionRegistry& registry, const BackupIdentity& identity,
                          const BackupRestoreOptions& options);

/// What SessionRegistry::CreateFrom makes a session of. A retry is one that has the same options and the same
/// bytes.
SessionSeed SeedOf(Backup backup, const BackupRestoreOptions& options);

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_BACKUP_BACKUP_SESSION_H_
