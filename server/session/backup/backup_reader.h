#ifndef DYNMESH_SERVER_SESSION_BACKUP_BACKUP_READER_H_
#define DYNMESH_SERVER_SESSION_BACKUP_BACKUP_READER_H_

#include <cstdint>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/types/optional.h"
#include "core/archive/rebuilder.h"
#include "core/mesh/mesh.h"
#include "server/session/backup/backup_format.h"
#include "server/session/budget.h"
#include "server/session/limits.h"

namespace dynmesh {

/// What a backup holds.
struct Backup {
  BackupIdentity identity;
  Mesh mesh;              ///< without stored relations
  uint64_t checksum = 0;  ///< of its bytes
};

/// Reads a backup from its bytes, as they come.
///
///     BackupReader reader(limits);
///     while (file.Read(&bytes)) reader.Add(bytes);   // in whatever pieces
///     Backup backup = *std::move(reader).Finish();
///
/// The bytes may be anything. A part is looked into once its seal has been found to match all bytes before,
/// so damage is seen where it is; what was forged is seen by Finish() at the latest, as by Rebuilder. After
/// an error nothing but destroying this is of use. Errors of all: DATA_LOSS BACKUP_DAMAGED;
/// FAILED_PRECONDITION BACKUP_FORMAT_NEWER, ARCHIVE_FORMAT_NEWER; RESOURCE_EXHAUSTED LIMIT_EXCEEDED
/// (max_vertices to max_cells, max_session_bytes) before what is too much is taken.
/// Memory: the mesh, and a part. A lease grows by what the mesh takes, and by a part while it is unpacked,
/// before that is taken, and is held until this is destroyed. Errors: those of the lease, too.
/// Thread safety: that of std::vector.
class BackupReader {
 public:
  explicit BackupReader(const Limits& limits, Lease lease = Lease())
      : limits_(limits), lease_(std::move(lease)) {}
  BackupReader(const BackupReader&) = delete;
  BackupReader& operator=(const BackupReader&) = delete;

  absl::Status Add(absl::string_view bytes);
  /// Null before it has come.
  const BackupIdentity* identity() const { return identity_.has_value() ? &*identity_ : nullptr; }
  /// About what the mesh takes so far.
  uint64_t memory_bytes() const { return rebuilder_.has_value() ? rebuilder_->memory_bytes() : 0; }
  bool done() const { return done_; }
  /// Makes the mesh. Errors: also when the end has not come.
  absl::StatusOr<Backup> Finish() &&;

 private:
  struct Part {
    BackupPart letter;
    BackupPacking packing;
    absl::string_view bytes;
    size_t size = 0;  ///< with begin and seal
  };

  absl::Status Read(absl::string_view& bytes);
  absl::Status ReadBegin(absl::string_view bytes);
  /// The part at the begin of `bytes`; none before all of it is there.
  absl::StatusOr<absl::optional<Part>> FindPart(absl::string_view bytes);
  bool IsExpected(BackupPart letter) const;
  absl::Status CheckSeal(absl::string_view part);
  absl::Status ReadPart(const Part& part);
  absl::Status ReadPacked(const Part& part);
  absl::Status ReadContent(BackupPart letter, absl::string_view content);
  absl::Status ReadHead(absl::string_view content);
  absl::Status ReadPages(absl::string_view content);
  absl::Status ReadEnd(absl::string_view content);
  absl::Status Damaged(absl::string_view what) const { return BackupDamaged(place_, what); }
  /// What is wrong with the mesh, as an error of this.
  absl::Status FromArchive(const absl::Status& status) const;

  const Limits limits_;
  Lease lease_;
  std::string waiting_;  ///< bytes of a part that is not whole yet
  BackupPlace place_;    ///< of the next part
  RunningHash hash_;
  bool begun_ = false;
  bool done_ = false;
  absl::optional<BackupIdentity> identity_;
  absl::optional<Rebuilder> rebuilder_;
  uint64_t num_pages_ = 0;
  uint64_t pages_done_ = 0;
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_BACKUP_BACKUP_READER_H_
