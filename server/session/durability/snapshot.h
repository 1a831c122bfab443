#ifndef DYNMESH_SERVER_SESSION_DURABILITY_SNAPSHOT_H_
#define DYNMESH_SERVER_SESSION_DURABILITY_SNAPSHOT_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "server/session/durability/revision_note.h"

namespace dynmesh {

/// A revision of a session that is kept under a name, whatever else is let go: with the checkpoint and the
/// records that give it.
struct Snapshot {
  std::string name;
  int64_t revision = 0;
  uint64_t checkpoint = 0;
  int64_t checkpoint_revision = 0;  ///< records after it are kept
  absl::Time create_time;
  RevisionNote note = {};

  friend bool operator==(const Snapshot&, const Snapshot&) = default;
};

inline constexpr size_t kMaxSnapshots = 500;  ///< of a session

/// The value of a session's store that lists its snapshots.
inline constexpr char kSnapshotsName[] = "snapshots";

/// Format (varint, 1), count (varint), then of each: name, revision (int64), checkpoint (u64), its revision
/// (int64), creation (int64, us since 1970), author, message. Texts begin with their length (varint).
std::string EncodeSnapshots(const std::vector<Snapshot>& snapshots);
/// Errors: FAILED_PRECONDITION STORE_FORMAT_NEWER; DATA_LOSS STORE_DAMAGED.
absl::StatusOr<std::vector<Snapshot>> DecodeSnapshots(absl::string_view bytes);

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_DURABILITY_SNAPSHOT_H_
