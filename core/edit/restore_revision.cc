#include "core/edit/restore_revision.h"

#include <utility>

#include "core/edit/revision_image.h"

namespace dynmesh {
namespace {

/// Of another mesh, whatever else it got past.
absl::Status CheckEqual(const Mesh& mesh, const Mesh& target) {
  if (mesh.FitNow() == target.FitNow()) return absl::OkStatus();
  return NotAnEarlierState("its checksum does not follow from what changed since");
}

}  // namespace

absl::StatusOr<RestoredBatches> RestoreRevision(Mesh& mesh, const Mesh& target,
                                                const RestoreOptions& options) {
  return RunRestore(mesh, options, [&](std::deque<BatchImage>& images) -> absl::Status {
    DYNMESH_ASSIGN_OR_RETURN(const BatchImage image, ImageOfRevision(mesh, target, options.meter));
    DYNMESH_RETURN_IF_ERROR(options.meter.ChargeManySteps(image.num_items()));
    DYNMESH_ASSIGN_OR_RETURN(BatchImage inverse, mesh.Restore(image));
    if (inverse.memory_bytes() <= options.max_image_bytes) images.push_back(std::move(inverse));
    return CheckEqual(mesh, target);
  });
}

}  // namespace dynmesh
