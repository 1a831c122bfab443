#ifndef DYNMESH_CORE_REPAIR_REPAIR_H_
#define DYNMESH_CORE_REPAIR_REPAIR_H_

#include <cstddef>
#include <variant>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/types/span.h"
#include "core/mesh/mesh.h"
#include "core/mesh/work_meter.h"
#include "core/repair/orient.h"
#include "core/repair/remove_duplicates.h"
#include "core/repair/repair_report.h"

namespace dynmesh {

/// The steps of a repair, as values; what each does is said in the header of the same name.
struct OrientStep {
  OrientOptions options;
};
struct WeldStep {
  double tolerance = 0;  ///< a length
};
struct RemoveDuplicatesStep {
  RemoveDuplicatesOptions options;
};
struct SplitNonManifoldStep {};
struct FillHolesStep {
  size_t max_edges = 0;
};

using RepairStep =
    std::variant<OrientStep, WeldStep, RemoveDuplicatesStep, SplitNonManifoldStep, FillHolesStep>;

/// Takes the steps in order, each on what the one before left. Calls done(i, report) after each.
///
/// Errors: those of the steps, with metadata "step" (index in `steps`); the meter's. The caller rolls the
/// batch back then. REQUIRES: a batch is open. Cost: that of the steps.
absl::Status RepairMesh(Mesh& mesh, absl::Span<const RepairStep> steps, WorkMeter& meter,
                        absl::FunctionRef<void(size_t, const RepairReport&)> done);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_REPAIR_REPAIR_H_
