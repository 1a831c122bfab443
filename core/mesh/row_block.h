#ifndef DYNMESH_CORE_MESH_ROW_BLOCK_H_
#define DYNMESH_CORE_MESH_ROW_BLOCK_H_

#include <array>
#include <cstddef>
#include <memory>

#include "absl/types/span.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

/// Rows of a relation for a block of entities, worked out together: one loop for each relation, memory
/// fetched ahead, and results that stay in the cache until they are read.
///
/// On meshes without duplicate and degenerate elements each neighbour is met in a way that tells whether it
/// was met before (say: a tetrahedron at a vertex counts where the vertex that the face leaves out is the
/// highest), so rows need no search for repeats; on others repeats are sorted out. Thread safety: that of
/// std::vector; many blocks may read one mesh.
class RowBlock {
 public:
  static constexpr size_t kMaxRows = 256;

  /// REQUIRES: at most kMaxRows slots, all live. Invalidates rows gathered before.
  void Gather(const Mesh& mesh, Relation relation, absl::Span<const Slot> slots);

  /// Valid until the next Gather().
  absl::Span<const Slot> Row(size_t i) const {
    return absl::MakeConstSpan(ids_.get() + offsets_[i], offsets_[i + 1] - offsets_[i]);
  }

 private:
  friend class RowKernels;

  static constexpr size_t kPadding = 8;  ///< behind every row, for SortDistinct

  /// Room for `count` more ids; what follows the ids in use.
  Slot* Room(size_t count) {
    if (size_ + count + kPadding > capacity_) Grow(size_ + count + kPadding);
    return ids_.get() + size_;
  }
  void Grow(size_t needed);

  std::unique_ptr<Slot[]> ids_;
  size_t size_ = 0;
  size_t capacity_ = 0;
  std::array<size_t, kMaxRows + 1> offsets_;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_MESH_ROW_BLOCK_H_
