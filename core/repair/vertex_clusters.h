#ifndef DYNMESH_CORE_REPAIR_VERTEX_CLUSTERS_H_
#define DYNMESH_CORE_REPAIR_VERTEX_CLUSTERS_H_

#include <vector>

#include "absl/status/statusor.h"
#include "core/mesh/mesh.h"
#include "core/repair/repair_work.h"

namespace dynmesh {

/// For each vertex slot the vertex that it is to become when those that are near each other are one.
///
/// Vertices are taken in ascending order: each becomes the nearest of those that stayed before it within
/// `tolerance` (the lower of two as near), or else stays. So no vertex moves by more than `tolerance`, and
/// what stays is farther apart: no chain of neighbours draws a line together to a point. Slots that are not
/// live have invalid ids.
/// Errors: the meter's. REQUIRES: tolerance is finite and not negative. Cost: linear, by a grid.
absl::StatusOr<std::vector<VertexId>> ClusterVertices(RepairWork& work, double tolerance);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_REPAIR_VERTEX_CLUSTERS_H_
