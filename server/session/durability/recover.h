#ifndef DYNMESH_SERVER_SESSION_DURABILITY_RECOVER_H_
#define DYNMESH_SERVER_SESSION_DURABILITY_RECOVER_H_

#include <deque>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "absl/types/optional.h"
#include "core/archive/dirty_pages.h"
#include "core/mesh/mesh.h"
#include "server/session/durability/log_record.h"
#include "server/session/durability/retained_revisions.h"
#include "server/session/limits.h"
#include "server/store/store.h"

namespace dynmesh {

/// What a session was when its last record was stored.
struct RecoveredSession {
  Mesh mesh;  ///< without stored relations
  absl::Time commit_time;
  StoredRevisions stored;
  absl::optional<Origin> origin;       ///< of a revision that was never made, if that is a later one
  DirtyPages changed_pages;            ///< since the last checkpoint
  std::deque<LoggedRequest> requests;  ///< that have an id, the last ones; the oldest first
  uint64_t answer_bytes = 0;           ///< of these
};

/// What it was at one revision.
struct RecoveredRevision {
  Mesh mesh;  ///< without stored relations
  absl::Time commit_time;
};

/// What a rebuilder may take of memory: what was let in must come back. Live meshes are measured before a
/// batch, and the rebuilder estimates.
uint64_t MaxRebuildBytes(const Limits& limits);

/// Reads a session from its last checkpoint and the records since.
/// Errors: those of the store; FAILED_PRECONDITION STORE_FORMAT_NEWER, ARCHIVE_FORMAT_NEWER; DATA_LOSS
/// STORE_DAMAGED, ARCHIVE_DAMAGED; RESOURCE_EXHAUSTED max_session_bytes. Cost: less than twice that of
/// importing the same mesh, and some microseconds a record.
absl::StatusOr<RecoveredSession> RecoverSession(SessionStore& store, const Limits& limits);

/// Reads an earlier revision, or the last one. Errors and cost: as of RecoverSession.
absl::StatusOr<RecoveredRevision> RecoverRevision(SessionStore& store, const RevisionSource& source,
                                                  const Limits& limits);

/// What the store says of the revision that the session began with.
absl::StatusOr<absl::optional<Origin>> ReadOrigin(SessionStore& store);

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_DURABILITY_RECOVER_H_
