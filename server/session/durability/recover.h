#ifndef DYNMESH_SERVER_SESSION_DURABILITY_RECOVER_H_
#define DYNMESH_SERVER_SESSION_DURABILITY_RECOVER_H_

#include <vector>

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "core/archive/dirty_pages.h"
#include "core/mesh/mesh.h"
#include "server/session/durability/log_record.h"
#include "server/session/durability/session_log.h"
#include "server/session/limits.h"
#include "server/store/store.h"

namespace dynmesh {

/// What a session was when its last record was stored.
struct RecoveredSession {
  Mesh mesh;  ///< without stored relations
  absl::Time commit_time;
  int64_t checkpoint_revision = 0;
  DirtyPages changed_pages;             ///< since the checkpoint
  std::vector<StoredRecord> records;    ///< that the store holds
  std::vector<LoggedRequest> requests;  ///< that have an id, of the records that are kept; the oldest first
};

/// What a rebuilder may take of memory: what was let in must come back. Live meshes are measured before a
/// batch, and the rebuilder estimates.
uint64_t MaxRebuildBytes(const Limits& limits);

/// Reads a session from its last checkpoint and the records since.
/// Errors: those of the store; FAILED_PRECONDITION STORE_FORMAT_NEWER, ARCHIVE_FORMAT_NEWER; DATA_LOSS
/// STORE_DAMAGED, ARCHIVE_DAMAGED; RESOURCE_EXHAUSTED max_session_bytes. Cost: less than twice that of
/// importing the same mesh, and some microseconds a record.
absl::StatusOr<RecoveredSession> RecoverSession(SessionStore& store, const Limits& limits);

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_DURABILITY_RECOVER_H_
