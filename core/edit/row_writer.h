#ifndef DYNMESH_CORE_EDIT_ROW_WRITER_H_
#define DYNMESH_CORE_EDIT_ROW_WRITER_H_

#include <cstdint>
#include <vector>

#include "absl/container/inlined_vector.h"
#include "absl/status/status.h"
#include "absl/types/span.h"
#include "core/mesh/error.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

/// Gives entities the rows that the policies of their columns make of others', and counts the bytes.
///
/// Rows that are as wanted already are not written: attributes that nobody set cost nothing.
class RowWriter {
 public:
  /// Writes rows of at most `max_bytes`; borrows the mesh.
  RowWriter(Mesh& mesh, uint64_t max_bytes) : mesh_(mesh), max_bytes_(max_bytes) {}

  /// Errors: those of Mesh::SetAttribute; RESOURCE_EXHAUSTED max_session_bytes beyond max_bytes.
  absl::Status Set(int column, Slot slot, absl::Span<const uint8_t> row) {
    if (mesh_.attributes()[column].Row(slot) == row) return absl::OkStatus();
    bytes_ += kBytesOfRow + 2 * row.size();  // in the journal
    bytes_ += mesh_.attributes()[column].BytesToSet({&slot, 1});
    if (bytes_ > max_bytes_) return LimitExceeded("max_session_bytes", max_bytes_, bytes_);
    return mesh_.SetAttribute(column, slot, row);
  }

  /// That rows took so far.
  uint64_t bytes() const { return bytes_; }

 private:
  static constexpr uint64_t kBytesOfRow = 32;  ///< its journal entry

  Mesh& mesh_;
  const uint64_t max_bytes_;
  uint64_t bytes_ = 0;
};

/// Rows that outlive the entities which had them, one after the other in one array.
class RowPool {
 public:
  /// Where the row begins.
  size_t Add(absl::Span<const uint8_t> row) {
    bytes_.insert(bytes_.end(), row.begin(), row.end());
    return bytes_.size() - row.size();
  }
  absl::Span<const uint8_t> At(size_t begin, size_t size) const {
    return absl::MakeConstSpan(bytes_).subspan(begin, size);
  }

 private:
  std::vector<uint8_t> bytes_;
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
