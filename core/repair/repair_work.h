#ifndef DYNMESH_CORE_REPAIR_REPAIR_WORK_H_
#define DYNMESH_CORE_REPAIR_REPAIR_WORK_H_

#include <algorithm>
#include <cstdint>

#include "absl/status/status.h"
#include "core/edit/apply_patch.h"
#include "core/edit/patch.h"
#include "core/mesh/mesh.h"
#include "core/mesh/work_meter.h"

namespace dynmesh {

/// A mesh in an open batch, and the meter whom a repair asks before it goes on.
///
///     patch.Remove(...); patch.Add(...);
///     DYNMESH_RETURN_IF_ERROR(work.ApplyIfLarge(patch));   // in a loop
///     DYNMESH_RETURN_IF_ERROR(work.Apply(patch));          // the rest
///
/// After an error the caller rolls the batch back. Thread safety: that of std::vector.
class RepairWork {
 public:
  RepairWork(Mesh& mesh, WorkMeter& meter) : mesh_(mesh), meter_(meter) {}

  Mesh& mesh() { return mesh_; }
  const Mesh& mesh() const { return mesh_; }

  /// To be called before `steps` entities or entries are looked at. Errors: the meter's.
  absl::Status Charge(uint64_t steps);
  absl::Status ChargeBytes(uint64_t bytes) { return meter_.ChargeBytes(bytes); }
  /// For elements that are added without a patch.
  absl::Status ChargeNewElements(uint64_t count);

  /// Carries a patch out and clears it. Errors: those of ApplyPatch and the meter's.
  absl::Status Apply(Patch& patch);
  /// The same once it is worth the while.
  absl::Status ApplyIfLarge(Patch& patch) {
    return patch.removed.size() < kLarge ? absl::OkStatus() : Apply(patch);
  }
  /// What the last patch that was carried out became.
  const AppliedPatch& applied() const { return applied_; }

 private:
  static constexpr size_t kLarge = 256;

  Mesh& mesh_;
  WorkMeter& meter_;
  uint64_t uncharged_ = 0;
  AppliedPatch applied_;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_REPAIR_REPAIR_WORK_H_
