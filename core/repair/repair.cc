#include "core/repair/repair.h"

#include "absl/strings/str_cat.h"
#include "core/mesh/error.h"
#include "core/repair/fill_holes.h"
#include "core/repair/repair_work.h"
#include "core/repair/split_non_manifold.h"
#include "core/repair/weld.h"

namespace dynmesh {
namespace {

/// Carries out a step of each kind.
struct StepRunner {
  RepairWork& work;

  absl::StatusOr<RepairReport> operator()(const OrientStep& step) {
    return OrientElements(work, step.options);
  }
  absl::StatusOr<RepairReport> operator()(const WeldStep& step) { return WeldVertices(work, step.tolerance); }
  absl::StatusOr<RepairReport> operator()(const RemoveDuplicatesStep& step) {
    return RemoveDuplicates(work, step.options);
  }
  absl::StatusOr<RepairReport> operator()(const SplitNonManifoldStep&) { return SplitNonManifold(work); }
  absl::StatusOr<RepairReport> operator()(const FillHolesStep& step) {
    return FillHoles(work, step.max_edges);
  }
};

}  // namespace

absl::Status RepairMesh(Mesh& mesh, absl::Span<const RepairStep> steps, WorkMeter& meter,
                        absl::FunctionRef<void(size_t, const RepairReport&)> done) {
  RepairWork work(mesh, meter);
  for (size_t i = 0; i < steps.size(); ++i) {
    const absl::StatusOr<RepairReport> report = std::visit(StepRunner{work}, steps[i]);
    if (!report.ok()) return WithMetadata(report.status(), "step", absl::StrCat(i));
    done(i, *report);
  }
  return absl::OkStatus();
}

}  // namespace dynmesh
