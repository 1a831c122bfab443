#ifndef DYNMESH_CORE_REPAIR_FANS_H_
#define DYNMESH_CORE_REPAIR_FANS_H_

#include <cstdint>
#include <vector>

#include "core/mesh/mesh.h"

namespace dynmesh {

/// The elements at one vertex, sorted into fans: what hangs together there.
///
/// Cells hang together through a face at the vertex that just two of them have, faces that are elements
/// through an edge at the vertex that just two of them have, and a face with the cell whose face it is. A fan
/// of faces alone goes with the cells at one of its edges, if there are any, and a wire with the cells or
/// faces at it. A wire that touches nothing but the vertex, or equals another, is of no fan.
///
/// At a manifold vertex there is one fan; where surfaces or solids touch in a point, or in an edge that more
/// than two faces share, there are more.
struct Fans {
  /// Of the lowest cell (else face, else wire) first; each ascending, cells before faces before wires.
  std::vector<std::vector<EntityId>> fans;
  uint64_t work = 0;  ///< entities looked at to find them
};

/// Cost: linear in the star of the vertex, and sorting it.
Fans FansAt(const Mesh& mesh, VertexId v);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_REPAIR_FANS_H_
