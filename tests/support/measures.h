#ifndef DYNMESH_TESTS_SUPPORT_MEASURES_H_
#define DYNMESH_TESTS_SUPPORT_MEASURES_H_

#include <cstdint>
#include <vector>

#include "core/edit/geometry.h"
#include "core/mesh/mesh.h"

namespace dynmesh::testing {

/// V - E + F - C.
inline int64_t Euler(const Mesh& mesh) {
  return int64_t{mesh.NumLive(EntityKind::kVertex)} - mesh.NumLive(EntityKind::kEdge) +
         mesh.NumLive(EntityKind::kFace) - mesh.NumLive(EntityKind::kCell);
}

/// Lengths, areas or signed volumes of the elements of a kind.
inline double TotalMeasure(const Mesh& mesh, EntityKind kind) {
  double total = 0;
  mesh.slots(kind).live().ForEach([&](Slot slot) {
    const EntityId id(kind, slot);
    if (!mesh.IsElement(id)) return;
    std::vector<Point> points;
    for (VertexId v : mesh.VerticesOf(id)) points.push_back(mesh.Position(v));
    total += Measure(mesh.Type(id), points);
  });
  return total;
}

}  // namespace dynmesh::testing

#endif  // DYNMESH_TESTS_SUPPORT_MEASURES_H_
