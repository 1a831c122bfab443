#ifndef DYNMESH_CORE_REPAIR_HOLES_H_
#define DYNMESH_CORE_REPAIR_HOLES_H_

#include <vector>

#include "absl/status/statusor.h"
#include "absl/types/optional.h"
#include "core/repair/repair_report.h"
#include "core/repair/repair_work.h"

namespace dynmesh {

/// A rim of the surface that face elements make: edges of just one face, that is an element and no cell's.
struct Hole {
  EdgeId lowest;
  /// In the direction in which a face that fills it turns. Empty where there is a problem.
  std::vector<VertexId> loop;
  /// kHoleBranches, kHoleInconsistent, kHoleTooLong.
  absl::optional<RepairFinding> problem;
};

/// All holes, by their lowest edges. The outer rim of an open sheet is a hole like others. Loops of more than
/// `max_edges` are not told, nor those that meet in a vertex, as nobody can say which way they go on.
/// Errors: the meter's. Cost: linear in the boundary.
absl::StatusOr<std::vector<Hole>> FindHoles(RepairWork& work, size_t max_edges);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_REPAIR_HOLES_H_
