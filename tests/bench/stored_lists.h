#ifndef DYNMESH_TESTS_BENCH_STORED_LISTS_H_
#define DYNMESH_TESTS_BENCH_STORED_LISTS_H_

#include "core/mesh/mesh.h"

namespace dynmesh::bench {

/// Whether a Mesh always has the relation: the downward ones but cell->edges, and upward by one dimension.
constexpr bool IsAlwaysStored(Relation relation) {
  const int from = Dimension(relation.from), to = Dimension(relation.to);
  return to < from ? !(from == 3 && to == 1) : to == from + 1;
}

/// Calls fn(slot, row) with the mesh's own lists, unsorted, for every live entity. REQUIRES:
/// IsAlwaysStored(relation).
template <typename Fn>
void ForEachStoredList(const Mesh& mesh, Relation relation, Fn& fn) {
  const auto walk = [&](auto row_of) {
    mesh.slots(relation.from).live().ForEach([&](Slot slot) { fn(slot, row_of(slot)); });
  };
  switch (Dimension(relation.from) * 4 + Dimension(relation.to)) {
    case 0 * 4 + 1:
      return walk([&](Slot slot) { return mesh.IncidentEdges(VertexId(slot)); });
    case 1 * 4 + 0:
      return walk([&](Slot slot) { return mesh.Vertices(EdgeId(slot)); });
    case 1 * 4 + 2:
      return walk([&](Slot slot) { return mesh.IncidentFaces(EdgeId(slot)); });
    case 2 * 4 + 0:
      return walk([&](Slot slot) { return mesh.Vertices(FaceId(slot)); });
    case 2 * 4 + 1:
      return walk([&](Slot slot) { return mesh.Edges(FaceId(slot)); });
    case 2 * 4 + 3:
      return walk([&](Slot slot) { return mesh.IncidentCells(FaceId(slot)); });
    case 3 * 4 + 0:
      return walk([&](Slot slot) { return mesh.Vertices(CellId(slot)); });
    default:
      return walk([&](Slot slot) { return mesh.Faces(CellId(slot)); });
  }
}

}  // namespace dynmesh::bench

#endif  // DYNMESH_TESTS_BENCH_STORED_LISTS_H_
