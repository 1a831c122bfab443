#include "core/edit/restore_batches.h"

#include <algorithm>
#include <utility>

#include "core/edit/run_batch.h"

namespace dynmesh {
namespace {

absl::Status Charge(const BatchImage& image, WorkMeter& meter) {
  return meter.ChargeSteps(std::min(image.num_items(), WorkMeter::kMaxCharge));
}

/// Keeps the last of what fits.
void Keep(BatchImage image, size_t max_bytes, std::deque<BatchImage>& images) {
  images.push_back(std::move(image));
  size_t bytes = 0;
  for (const BatchImage& kept : images) bytes += kept.memory_bytes();
  for (; !images.empty() && bytes > max_bytes; images.pop_front()) bytes -= images.front().memory_bytes();
}

}  // namespace

absl::StatusOr<RestoredBatches> RunRestore(Mesh& mesh, const RestoreOptions& options,
                                           absl::FunctionRef<absl::Status(std::deque<BatchImage>&)> restore) {
  RestoredBatches result;
  DYNMESH_RETURN_IF_ERROR(RunInBatch(mesh, [&] { return restore(result.images); }));
  const BatchImage::Fit now = mesh.FitNow();
  result.checksum = now.checksum;
  result.counts = now.num_live;
  if (options.dry_run) result.images.clear();
  const BatchEnding ending = options.dry_run ? BatchEnding::kRollBack : BatchEnding::kCommit;
  DYNMESH_RETURN_IF_ERROR(EndBatch(mesh, ending, options.keeper));
  result.revision = mesh.revision();
  return result;
}

absl::StatusOr<RestoredBatches> RestoreBatches(Mesh& mesh, absl::Span<const BatchImage* const> images,
                                               const RestoreOptions& options) {
  return RunRestore(mesh, options, [&](std::deque<BatchImage>& inverses) -> absl::Status {
    for (const BatchImage* image : images) {
      DYNMESH_RETURN_IF_ERROR(Charge(*image, options.meter));
      DYNMESH_ASSIGN_OR_RETURN(BatchImage inverse, mesh.Restore(*image));
      Keep(std::move(inverse), options.max_image_bytes, inverses);
    }
    return absl::OkStatus();
  });
}

}  // namespace dynmesh
