#ifndef DYNMESH_CORE_MESH_ESTIMATE_H_
#define DYNMESH_CORE_MESH_ESTIMATE_H_

#include <array>
#include <cstdint>

#include "core/mesh/element_type.h"
#include "core/mesh/ids.h"

namespace dynmesh {

/// Elements of each type, indexed by ElementType.
using ElementTypeCounts = std::array<uint64_t, kNumElementTypes + 1>;

/// Numbers of V, E, F, C (by EntityKind) to expect of a mesh of `num_vertices` vertices and these elements,
/// without looking at it (paper, Table 1). Surfaces: E = F + V - 2. Tetrahedra: E = 2V + C, F = V + 2C.
/// Other cells: F from two cells a face and a hull of 6 V^(2/3) faces, E from Euler's V - E + F - C = 1.
/// Wire edges count as themselves. Good to some percent for meshes in one piece.
std::array<uint64_t, kNumEntityKinds> EstimateCounts(uint64_t num_vertices, const ElementTypeCounts& elements);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_MESH_ESTIMATE_H_
