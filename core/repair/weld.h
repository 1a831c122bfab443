#ifndef DYNMESH_CORE_REPAIR_WELD_H_
#define DYNMESH_CORE_REPAIR_WELD_H_

#include "absl/status/statusor.h"
#include "core/repair/repair_report.h"
#include "core/repair/repair_work.h"

namespace dynmesh {

/// Merges vertices that lie within `tolerance` of each other (vertex_clusters.h says which): meshes that
/// touch grow together. The lower slot stays, with its position and attributes, and the other one is removed.
///
/// Elements that then would name a vertex twice are removed, but a quad two of whose neighbours become one is
/// a triangle. Elements that then would be equal to one that was not touched, or to one of a lower slot, are
/// removed too. What is left keeps its attributes.
/// Findings: kMerged, kShrunk, kDegenerate, kDuplicate. A second run finds nothing to merge. Errors:
/// INVALID_ARGUMENT BAD_ARGUMENT for a tolerance that is negative or not finite; the meter's. REQUIRES: a
/// batch is open. Cost: linear.
absl::StatusOr<RepairReport> WeldVertices(RepairWork& work, double tolerance);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_REPAIR_WELD_H_
