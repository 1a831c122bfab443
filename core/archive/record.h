#ifndef DYNMESH_CORE_ARCHIVE_RECORD_H_
#define DYNMESH_CORE_ARCHIVE_RECORD_H_

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/archive/head.h"
#include "core/codec/bytes.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

/// Writes what a batch did as after-images: what stands at every slot that its journal names.
///
///     mesh.BeginBatch();
///     ... edits ...
///     log.Append(encoder.Encode(mesh, note));
///     mesh.Commit();
///
/// Law: on a mesh that holds what stood before the batch, or parts of what came after it, a record and those
/// after it lead to the mesh that the last batch left: so pages of different revisions can be brought to one.
/// Made for many batches: it keeps its lists.
///
/// Cost: linear in the journal, and sorting what it names; some microseconds for a split edge.
/// Thread safety: that of std::vector.
class RecordEncoder {
 public:
  /// The record of the open batch. `note` is kept as it is: what the caller wants to find again with it.
  /// REQUIRES: a batch is open; nothing is edited between this and Commit().
  std::string Encode(const Mesh& mesh, absl::string_view note);

 private:
  void Collect(const Mesh& mesh);
  void WriteSlots(const Mesh& mesh, EntityKind kind, ByteWriter& out) const;
  void WriteRows(const Mesh& mesh, ByteWriter& out) const;

  std::array<std::vector<Slot>, kNumEntityKinds> slots_;  ///< that the journal names, ascending
  std::vector<std::vector<Slot>> rows_;                   ///< the same by column
  size_t num_new_columns_ = 0;
};

/// What a record says but for slots and rows; borrows its bytes.
struct RecordView {
  int64_t revision = 0;  ///< that the batch made
  BatchImage::Fit fit;   ///< checksum and counts after it
  RowWidths widths;
  std::vector<ColumnHead> new_columns;
  absl::string_view note;
  absl::string_view body;  ///< slots and rows, not looked into
};

/// Errors: FAILED_PRECONDITION ARCHIVE_FORMAT_NEWER; DATA_LOSS ARCHIVE_DAMAGED.
absl::StatusOr<RecordView> ReadRecord(absl::string_view bytes);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_ARCHIVE_RECORD_H_
