#ifndef DYNMESH_CORE_MESH_CELL_PARTS_H_
#define DYNMESH_CORE_MESH_CELL_PARTS_H_

#include <array>

#include "core/mesh/mesh.h"

namespace dynmesh {

/// Edges and faces of a cell that is being made, in template order; those not found yet are invalid.
struct Mesh::CellParts {
  std::array<EdgeId, kMaxElementEdges> edges;
  std::array<FaceMatch, kMaxElementFaces> faces;
  bool all_looked_for = false;  ///< edges that are invalid are not there

  /// Names the edges of the i-th face, which was found and has `of_face`.
  void TakeEdges(const ElementTemplate& shape, int i, absl::Span<const EdgeId> of_face) {
    const int n = static_cast<int>(of_face.size());
    for (int k = 0; k < n; ++k) edges[shape.faces[i].edges[k]] = of_face[faces[i].code.StoredEdge(k, n)];
  }
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_MESH_CELL_PARTS_H_
