#ifndef DYNMESH_SERVER_SESSION_SESSION_ERRORS_H_
#define DYNMESH_SERVER_SESSION_SESSION_ERRORS_H_

#include <cstdint>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"

/// The errors of sessions, each made in one place (reasons: core/mesh/error.h).
namespace dynmesh {

/// RESOURCE_EXHAUSTED LIMIT_EXCEEDED, limit "memory": the process could not get any more.
absl::Status OutOfMemory();

/// UNAVAILABLE SHUTTING_DOWN.
absl::Status ShuttingDown();

/// CANCELLED: the peer went away, or the server has no more time for the call.
absl::Status CallCancelled();

/// DEADLINE_EXCEEDED: the call's deadline passed.
absl::Status DeadlinePassed();

/// OUT_OF_RANGE REVISION_IN_FUTURE, metadata requested and actual.
absl::Status RevisionInFuture(int64_t requested, int64_t actual);

/// OUT_OF_RANGE REVISION_GONE, metadata requested and oldest: this and all later ones can be had.
absl::Status RevisionGone(int64_t requested, int64_t oldest);

/// FAILED_PRECONDITION NO_HISTORY, metadata session: it is not kept on disk, so only what it is now can be
/// had.
absl::Status NoHistory(absl::string_view session);

/// NOT_FOUND SNAPSHOT_NOT_FOUND, metadata snapshot.
absl::Status SnapshotNotFound(absl::string_view name);

/// INVALID_ARGUMENT BAD_SNAPSHOT_NAME: it is not made as those of sessions.
absl::Status BadSnapshotName();

/// ALREADY_EXISTS SNAPSHOT_EXISTS, metadata snapshot.
absl::Status SnapshotExists(absl::string_view name);

/// ABORTED REVISION_MISMATCH, metadata expected and actual.
absl::Status RevisionMismatch(int64_t expected, int64_t actual);

/// FAILED_PRECONDITION NOTHING_TO_UNDO or NOTHING_TO_REDO, metadata requested and available: batches.
absl::Status NothingToUndo(uint64_t requested, uint64_t available);
absl::Status NothingToRedo(uint64_t requested, uint64_t available);

/// NOT_FOUND SESSION_NOT_FOUND.
absl::Status SessionNotFound(absl::string_view name);

/// NOT_FOUND SESSION_DELETED.
absl::Status SessionDeleted(absl::string_view name);

/// ABORTED SESSION_RECREATED, metadata expected and actual: the session of that name is not the one that is
/// meant.
absl::Status SessionRecreated(absl::string_view name, absl::string_view expected, absl::string_view actual);

/// DEADLINE_EXCEEDED IMPORT_IDLE, metadata limit: of an import or a restore.
absl::Status ImportIdle(absl::Duration timeout);
/// The same of a backup whose peer does not read it.
absl::Status BackupIdle(absl::Duration timeout);

/// DATA_LOSS INTERNAL: an edit ended half way, so what the session holds is not to be trusted.
absl::Status SessionDamaged(absl::string_view name);

/// UNAVAILABLE SESSION_LOADING: what it holds is being read from its store, or written to it for the first
/// time.
absl::Status SessionLoading(absl::string_view name);

/// FAILED_PRECONDITION NO_STORE: the daemon keeps nothing, so no session can be durable.
absl::Status NoStore();

/// FAILED_PRECONDITION SESSION_NOT_EMPTY.
absl::Status SessionNotEmpty(absl::string_view name, int64_t revision);

/// ABORTED ETAG_MISMATCH, metadata etag: the present one.
absl::Status EtagMismatch(absl::string_view name, absl::string_view etag);

/// INVALID_ARGUMENT BAD_PAGE_TOKEN.
absl::Status BadPageToken();

/// INVALID_ARGUMENT BAD_ARGUMENT, metadata field.
absl::Status BadField(absl::string_view field, absl::string_view message);

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_SESSION_ERRORS_H_
