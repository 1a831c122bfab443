#ifndef DYNMESH_CORE_MESH_INVERSE_ROWS_H_
#define DYNMESH_CORE_MESH_INVERSE_ROWS_H_

#include <cstdint>
#include <memory>
#include <vector>

#include "absl/types/span.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

/// All rows of an upward relation at once, as the inverse of the downward one: the upper entities are walked in
/// ascending order and entered with what lies below them, so that rows come out sorted. Several times as fast as
/// gathering row by row.
///
/// Thread safety: that of std::vector.
class InverseRows {
 public:
  /// Whether this is the way to walk every row: vertex->cells, edge->cells and vertex->faces, where the mesh has
  /// fewer than 2^32 incidences and more than a few entities.
  static bool Pays(const Mesh& mesh, Relation relation);

  /// REQUIRES: Pays(mesh, relation). Cost: the incidences, and 4 bytes of memory for each.
  InverseRows(const Mesh& mesh, Relation relation);

  absl::Span<const Slot> Row(Slot slot) const {
    return absl::MakeConstSpan(ids_.get() + begin_[slot], end_[slot] - begin_[slot]);
  }

 private:
  std::vector<uint32_t> begin_, end_;
  std::unique_ptr<Slot[]> ids_;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_MESH_INVERSE_ROWS_H_
