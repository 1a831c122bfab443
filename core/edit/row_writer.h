#ifndef DYNMESH_CORE_EDIT_ROW_WRITER_H_
#define DYNMESH_CORE_EDIT_ROW_WRITER_H_

#include <cstdint>

#include "absl/container/inlined_vector.h"
#include "absl/status/status.h"
#include "absl/types/span.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

/// Gives entities the rows that the policies of their columns make of others', and counts the bytes.
///
/// Rows that are as wanted already are not written: attributes that nobody set cost nothing.
class RowWriter {
 public:
  /// Adds to `bytes`; borrows both.
  RowWriter(Mesh& mesh, uint64_t& bytes) : mesh_(mesh), bytes_(bytes) {}

  /// Errors: those of Mesh::SetAttribute.
  absl::Status Set(int column, Slot slot, absl::Span<const uint8_t> row) {
    if (mesh_.attributes()[column].Row(slot) == row) return absl::OkStatus();
    bytes_ += kBytesOfRow + 2 * row.size();  // in the column and in the journal
    return mesh_.SetAttribute(column, slot, row);
  }

 private:
  static constexpr uint64_t kBytesOfRow = 32;  ///< its stamp and journal entry

  Mesh& mesh_;
  uint64_t& bytes_;
};

/// Indices of a mesh's columns of one kind of entity.
inline absl::InlinedVector<int, 4> ColumnsOf(const Mesh& mesh, EntityKind kind) {
  absl::InlinedVector<int, 4> columns;
  for (size_t i = 0; i < mesh.attributes().size(); ++i) {
    if (mesh.attributes()[i].spec().kind == kind) columns.push_back(static_cast<int>(i));
  }
  return columns;
}

}  // namespace dynmesh

#endif  // DYNMESH_CORE_EDIT_ROW_WRITER_H_
