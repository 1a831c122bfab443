#ifndef DYNMESH_CORE_REPAIR_REMOVE_DUPLICATES_H_
#define DYNMESH_CORE_REPAIR_REMOVE_DUPLICATES_H_

#include "absl/status/statusor.h"
#include "absl/types/optional.h"
#include "core/repair/repair_report.h"
#include "core/repair/repair_work.h"

namespace dynmesh {

struct RemoveDuplicatesOptions {
  /// Elements of at most this length, area or volume (whatever its sign) are degenerate; nullopt: just those
  /// that name a vertex twice. In the units of the positions to the power of the element's dimension.
  absl::optional<double> max_measure = 0;
  /// Vertices that no element has go too.
  bool isolated_vertices = false;
};

/// Removes elements that are degenerate, and those that are equal to another one: of equal wires or faces the
/// one stays that faces or cells share, else the lowest slot.
///
/// Findings: kDegenerate, kDuplicate, kIsolated. A second run finds nothing. Errors: INVALID_ARGUMENT
/// BAD_ARGUMENT for a measure that is negative or no number; the meter's. REQUIRES: a batch is open. Cost:
/// linear.
absl::StatusOr<RepairReport> RemoveDuplicates(RepairWork& work, const RemoveDuplicatesOptions& options = {});

}  // namespace dynmesh

#endif  // DYNMESH_CORE_REPAIR_REMOVE_DUPLICATES_H_
