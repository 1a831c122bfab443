#ifndef DYNMESH_CORE_MESH_CELL_PARTS_H_
#define DYNMESH_CORE_MESH_CELL_PARTS_H_

#include <array>

#include "core/mesh/mesh.h"

namespace dynmesh {

/// Edges and faces of a cell that is being made, in template order; those not found yet are invalid.
struct Mesh::CellParts {
  std::array<EdgeId, kMaxElementEdges> edges;
  std::array<FaceMatch, kMaxElementFaces> faces;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_MESH_CELL_PARTS_H_
