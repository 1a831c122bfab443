#ifndef DYNMESH_SERVER_SESSION_REVISIONS_H_
#define DYNMESH_SERVER_SESSION_REVISIONS_H_

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "core/mesh/mesh.h"
#include "server/session/durability/log_record.h"
#include "server/session/durability/recover.h"
#include "server/session/session.h"

/// What a session was before: earlier revisions, and snapshots of them. Sessions that are not kept on disk
/// have no past: FAILED_PRECONDITION NO_HISTORY.
///
/// All of these read the disk: they are for a thread that has time. What they take a turn at the session for
/// is said below; all else goes on beside edits. REQUIRES: the session is loaded (AwaitLoaded()).
namespace dynmesh {

/// Returns once the session is loaded, or with what it says against that. Waits for its turn to read it.
absl::Status AwaitLoaded(Session& session);

/// A revision, and who made it how.
struct RevisionInfo {
  int64_t revision = 0;
  LoggedCall call = LoggedCall::kEdit;
  RevisionNote note = {};
  absl::Time commit_time;
  uint64_t bytes = 0;  ///< that the store keeps of it
  std::string request_id = {};
};

struct RevisionList {
  std::vector<RevisionInfo> revisions;  ///< the last one first
  int64_t oldest = 0;                   ///< this and all later ones can be had
  int64_t last = 0;
};

/// Up to `max_count` revisions before `before` (0: from the last one on) that a record or the session's
/// origin tells of. Errors: NO_HISTORY; those of the store.
absl::StatusOr<RevisionList> ListRevisions(Session& session, int64_t before, size_t max_count);

/// The last revision, whichever that is; 0 is the one that a session is created with.
inline constexpr int64_t kLastRevision = -1;

/// What the session was at `revision` (kLastRevision will do).
/// Errors: OUT_OF_RANGE REVISION_GONE, REVISION_IN_FUTURE; NO_HISTORY, but for the last one;
/// RESOURCE_EXHAUSTED; those of the store. Cost: that of loading the session; of the last revision: of a
/// copy, made when it is its turn to read.
absl::StatusOr<RecoveredRevision> MeshAt(Session& session, int64_t revision);

/// Puts the session back to what it was at `revision`: MeshAt(), then Session::RestoreTo() when it is its
/// turn. Errors: those of both.
absl::StatusOr<std::shared_ptr<const HistoryResult>> GoBackTo(Session& session, int64_t revision,
                                                              const HistoryOptions& options,
                                                              const StopSignal& stop);

/// The revision that a snapshot keeps. Errors: NOT_FOUND SNAPSHOT_NOT_FOUND; NO_HISTORY.
absl::StatusOr<int64_t> FindSnapshotRevision(Session& session, absl::string_view name);

/// Keeps `revision` (0: the last one) under a name, until the snapshot is deleted; on disk when it returns.
/// Cost: what it keeps from being deleted. Errors: INVALID_ARGUMENT BAD_SNAPSHOT_NAME, BAD_ARGUMENT;
/// ALREADY_EXISTS SNAPSHOT_EXISTS; OUT_OF_RANGE; RESOURCE_EXHAUSTED; NO_HISTORY; those of the store.
absl::StatusOr<Snapshot> CreateSnapshot(Session& session, absl::string_view name, int64_t revision,
                                        const RevisionNote& note);

/// By name. Errors: NO_HISTORY.
absl::StatusOr<std::vector<Snapshot>> ListSnapshots(Session& session);

/// Errors: NOT_FOUND SNAPSHOT_NOT_FOUND; NO_HISTORY; those of the store.
absl::Status DeleteSnapshot(Session& session, absl::string_view name);

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_REVISIONS_H_
