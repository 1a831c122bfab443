#include "server/rpc/convert_backups.h"

#include "core/mesh/error.h"
#include "server/rpc/convert_sessions.h"
#include "server/session/answer_memory.h"

namespace dynmesh {

absl::StatusOr<BackupRestoreOptions> ToRestoreOptions(const v1::RestoreHeader& header) {
  BackupRestoreOptions options{.name = header.name(), .validate_only = header.validate_only()};
  if (!options.name.empty()) DYNMESH_RETURN_IF_ERROR(CheckSessionName(options.name));
  DYNMESH_ASSIGN_OR_RETURN(options.durability, ToDurability(header.durability()));
  DYNMESH_RETURN_IF_ERROR(CheckRequestId(header.request_id()));
  options.request_id = header.request_id();
  return options;
}

}  // namespace dynmesh
