#ifndef DYNMESH_CORE_MESH_TETRAHEDRON_EDGES_H_
#define DYNMESH_CORE_MESH_TETRAHEDRON_EDGES_H_

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/mesh/mesh.h"

namespace dynmesh {
namespace internal {

/// kStoredEdge[code][k]: FaceCode{code}.StoredEdge(k, 3), as a table.
using StoredEdges = std::array<std::array<uint8_t, 3>, 8>;
constexpr StoredEdges MakeStoredEdges() {
  StoredEdges stored{};
  for (int code = 0; code < 8; ++code) {
    for (int k = 0; k < 3; ++k) stored[code][k] = FaceCode{static_cast<uint8_t>(code)}.StoredEdge(k, 3);
  }
  return stored;
}
inline constexpr StoredEdges kStoredEdge = MakeStoredEdges();

}  // namespace internal

/// Edges 0-1, 1-2, 2-0, 0-3, 1-3, 2-3 of a tetrahedron from its faces 0 1 3, 1 2 3 and 2 0 3. `face_edges`:
/// the edges of face f from kStride * f on.
template <size_t kStride>
std::array<Slot, 6> TetrahedronEdges(const OrientedFace* faces, const EdgeId* face_edges) {
  const auto edge = [&](int face, int k) {
    const EdgeId* const edges = face_edges + kStride * faces[face].face().slot();
    return edges[internal::kStoredEdge[faces[face].code().value][k]].slot();
  };
  return {edge(0, 0), edge(1, 0), edge(2, 0), edge(0, 2), edge(0, 1), edge(1, 1)};
}

}  // namespace dynmesh

#endif  // DYNMESH_CORE_MESH_TETRAHEDRON_EDGES_H_
