#ifndef DYNMESH_CORE_MESH_BOX_H_
#define DYNMESH_CORE_MESH_BOX_H_

#include <algorithm>

#include "absl/types/optional.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

/// Smallest and largest coordinates; closed, so that the points of its sides belong to it.
struct Box {
  Point low;
  Point high;
};

inline bool Contains(const Box& box, const Point& point) {
  for (int axis = 0; axis < 3; ++axis) {
    if (point[axis] < box.low[axis] || point[axis] > box.high[axis]) return false;
  }
  return true;
}

/// Whether they have a point in common.
inline bool Meet(const Box& a, const Box& b) {
  for (int axis = 0; axis < 3; ++axis) {
    if (a.low[axis] > b.high[axis] || b.low[axis] > a.high[axis]) return false;
  }
  return true;
}

/// Grows `box` to contain `point`.
inline void Include(const Point& point, Box& box) {
  for (int axis = 0; axis < 3; ++axis) {
    box.low[axis] = std::min(box.low[axis], point[axis]);
    box.high[axis] = std::max(box.high[axis], point[axis]);
  }
}

/// The box round the vertices of an entity. REQUIRES: it is live.
Box BoundsOf(const Mesh& mesh, EntityId id);

/// The box round the live vertices; nullopt without any. Cost: vertices.
absl::optional<Box> BoundsOf(const Mesh& mesh);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_MESH_BOX_H_
