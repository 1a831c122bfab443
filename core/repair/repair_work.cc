#include "core/repair/repair_work.h"

#include "core/mesh/error.h"

namespace dynmesh {
namespace {

/// The meter is asked after so many steps at the latest.
constexpr uint64_t kStepsBetweenCharges = WorkMeter::kMaxCharge / 2;

/// Of an element that is replaced: finding, linking and journaling it and what it needs.
constexpr uint64_t kStepsToReplace = 20;

/// Of a new element with its share of new faces and edges, and of the journal: often less, at times more.
constexpr uint64_t kBytesOfElement = 150;

}  // namespace

absl::Status RepairWork::Charge(uint64_t steps) {
  uncharged_ += steps;
  while (uncharged_ >= kStepsBetweenCharges) {
    const uint64_t charge = std::min(uncharged_, WorkMeter::kMaxCharge);
    uncharged_ -= charge;
    DYNMESH_RETURN_IF_ERROR(meter_.ChargeSteps(charge));
  }
  return absl::OkStatus();
}

absl::Status RepairWork::ChargeNewElements(uint64_t count) {
  DYNMESH_RETURN_IF_ERROR(Charge(kStepsToReplace * count));
  return ChargeBytes(kBytesOfElement * count);
}

absl::Status RepairWork::Apply(Patch& patch) {
  DYNMESH_RETURN_IF_ERROR(Charge(kStepsToReplace * patch.removed.size()));
  DYNMESH_RETURN_IF_ERROR(ChargeNewElements(patch.added.size() + patch.new_vertices.size()));
  DYNMESH_RETURN_IF_ERROR(ApplyPatch(mesh_, patch, applied_));
  patch.Clear();
  return ChargeBytes(applied_.attribute_bytes);
}

}  // namespace dynmesh
