#ifndef DYNMESH_SERVER_STORE_STORE_ERRORS_H_
#define DYNMESH_SERVER_STORE_STORE_ERRORS_H_

#include <cstdint>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

/// The errors of stores, each made in one place.
namespace dynmesh {

namespace reason {
inline constexpr char kStoreDamaged[] = "STORE_DAMAGED";
inline constexpr char kStoreFull[] = "STORE_FULL";
inline constexpr char kStoreFailed[] = "STORE_FAILED";
inline constexpr char kCheckpointNotFound[] = "CHECKPOINT_NOT_FOUND";
inline constexpr char kStoreFormatOlder[] = "STORE_FORMAT_OLDER";
inline constexpr char kStoreFormatNewer[] = "STORE_FORMAT_NEWER";
inline constexpr char kStoreInUse[] = "STORE_IN_USE";
inline constexpr char kStoreTrimmed[] = "STORE_TRIMMED";
inline constexpr char kFenced[] = "FENCED";
inline constexpr char kCheckpointOpen[] = "CHECKPOINT_OPEN";
}  // namespace reason

/// DATA_LOSS STORE_DAMAGED: something that was stored is missing or is not what was stored. `what` is a
/// sentence.
absl::Status StoreDamaged(absl::string_view what);

/// The same status, of a session: STORE_DAMAGED and STORE_FAILED get metadata session, others stay.
absl::Status InSession(const absl::Status& status, absl::string_view session);

/// RESOURCE_EXHAUSTED STORE_FULL: the disk, or a quota on it.
absl::Status StoreFull(absl::string_view cause);

/// UNAVAILABLE STORE_FAILED: the system refused to read or write.
absl::Status StoreFailed(absl::string_view cause);

/// What writes get after one has failed with `first`: its code and reason if that was STORE_FULL, otherwise
/// FAILED_PRECONDITION STORE_FAILED, metadata cause.
absl::Status StoreReadOnly(const absl::Status& first);

/// FAILED_PRECONDITION STORE_FORMAT_NEWER, metadata found and supported.
absl::Status StoreFormatNewer(uint64_t found, uint64_t supported);

/// FAILED_PRECONDITION STORE_FORMAT_OLDER, metadata found and supported.
absl::Status StoreFormatOlder(uint64_t found, uint64_t supported);

/// FAILED_PRECONDITION STORE_IN_USE, metadata pid: "" when the other process has not said it.
absl::Status StoreInUse(absl::string_view directory, absl::string_view pid);

/// OUT_OF_RANGE STORE_TRIMMED, metadata requested and oldest: records after that one are there.
absl::Status StoreTrimmed(int64_t requested, int64_t oldest);

/// ABORTED FENCED, metadata session.
absl::Status Fenced(absl::string_view session);

/// FAILED_PRECONDITION CHECKPOINT_OPEN, metadata session.
absl::Status CheckpointOpen(absl::string_view session);

/// NOT_FOUND CHECKPOINT_NOT_FOUND, metadata checkpoint.
absl::Status CheckpointNotFound(uint64_t number);

/// INVALID_ARGUMENT BAD_ARGUMENT, metadata revision: `what` it has to be, after "must be ".
absl::Status BadRevision(int64_t revision, absl::string_view what);

/// As those of sessions (reasons: core/mesh/error.h).
absl::Status StoredSessionNotFound(absl::string_view name);
absl::Status StoredSessionExists(absl::string_view name);
absl::Status StoredSessionDeleted(absl::string_view name);

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_STORE_STORE_ERRORS_H_
