#ifndef DYNMESH_SERVER_RPC_CONVERT_BACKUPS_H_
#define DYNMESH_SERVER_RPC_CONVERT_BACKUPS_H_

#include "absl/status/statusor.h"
#include "dynmesh/v1/backups.pb.h"
#include "server/session/backup/backup_session.h"

namespace dynmesh {

/// Errors: INVALID_ARGUMENT BAD_SESSION_NAME, BAD_ARGUMENT.
absl::StatusOr<BackupRestoreOptions> ToRestoreOptions(const v1::RestoreHeader& header);

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_RPC_CONVERT_BACKUPS_H_
