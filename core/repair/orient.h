#ifndef DYNMESH_CORE_REPAIR_ORIENT_H_
#define DYNMESH_CORE_REPAIR_ORIENT_H_

#include "absl/status/statusor.h"
#include "core/repair/repair_report.h"
#include "core/repair/repair_work.h"

namespace dynmesh {

struct OrientOptions {
  /// Closed surfaces are to face outwards (each shell by itself, that of a cavity too), and cells to have
  /// positive volume. Else, and for open surfaces, most elements of a component stay as they are.
  bool outward = true;
};

/// Makes neighbours turn alike: faces that are elements across edges of two such faces, cells across faces of
/// two cells. Each component that these connect is oriented as a whole, by its total volume or by its
/// majority, so a cell that is turned over between others (a vertex lies on the wrong side) stays.
/// Components that cannot be oriented, like a Moebius strip, stay as they are. Degenerate elements are left
/// alone.
///
/// A reversed element is replaced by one with another vertex order and the same attributes; faces keep their
/// ids (but duplicates), cells get new ones. Findings: kReversed, kNotOrientable. A second run finds nothing
/// to reverse. Errors: the meter's. REQUIRES: a batch is open. Cost: linear.
absl::StatusOr<RepairReport> OrientElements(RepairWork& work, const OrientOptions& options = {});

}  // namespace dynmesh

#endif  // DYNMESH_CORE_REPAIR_ORIENT_H_
