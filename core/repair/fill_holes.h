#ifndef DYNMESH_CORE_REPAIR_FILL_HOLES_H_
#define DYNMESH_CORE_REPAIR_FILL_HOLES_H_

#include <cstddef>

#include "absl/status/statusor.h"
#include "core/repair/repair_report.h"
#include "core/repair/repair_work.h"

namespace dynmesh {

/// Holes of more edges get a vertex in the middle, as the best triangulation would take too long.
inline constexpr size_t kMaxFlatHole = 64;

/// Closes holes of at most `max_edges` edges (holes.h) with triangles that turn as the surface does.
///
/// Up to kMaxFlatHole edges without a new vertex: the triangulation of least area, and of those the one of
/// best shape (Barequet and Sharir, "Filling gaps in the boundary of a polyhedron", 1995), whose edges are
/// new. Where there is none, and for longer holes, round a vertex in the middle, whose attributes are the
/// mean of those of the rim. New faces have the default attributes. Findings: kFilled, kAdded, kHoleTooLong,
/// kHoleBranches, kHoleInconsistent, kHoleFaceExists. A second run finds nothing to fill. Errors: those of
/// Mesh's edits; the meter's. REQUIRES: a batch is open. Cost: linear in the boundary, and O(n^3) for a hole
/// of n edges.
absl::StatusOr<RepairReport> FillHoles(RepairWork& work, size_t max_edges);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_REPAIR_FILL_HOLES_H_
