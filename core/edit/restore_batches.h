#ifndef DYNMESH_CORE_EDIT_RESTORE_BATCHES_H_
#define DYNMESH_CORE_EDIT_RESTORE_BATCHES_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <limits>

#include "absl/functional/function_ref.h"
#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "core/edit/batch_keeper.h"
#include "core/mesh/batch_image.h"
#include "core/mesh/mesh.h"
#include "core/mesh/work_meter.h"

namespace dynmesh {

struct RestoreOptions {
  /// Roll back after success: the result is what would have been, without images.
  bool dry_run = false;
  /// Charged the items of each image before it is restored: who stops it has changed nothing.
  WorkMeter& meter = WorkMeter::Unlimited();
  /// Images that are given back take no more than this: the first ones are left out.
  size_t max_image_bytes = std::numeric_limits<size_t>::max();
  /// As BatchOptions::keeper.
  BatchKeeper* keeper = nullptr;
};

/// What undoing or redoing batches, or going back to a revision, did or, for a dry run, would have done.
struct RestoredBatches {
  int64_t revision = 0;  ///< after it; of the dry run: before
  Checksum checksum;
  std::array<uint32_t, kNumEntityKinds> counts = {};
  /// What takes it back: one for each that was restored, in that order, or only the last of these.
  std::deque<BatchImage> images;
};

/// Undoes batches, or redoes them: restores their images one after the other, all or nothing, as one
/// revision. The first must fit `mesh`, and each other one what the one before leaves: images of batches,
/// last batch first; to redo, what that gave, last first again.
///
/// Errors: those of Mesh::Restore, of the meter and of the keeper. After an error or a dry run the mesh is as
/// it was, to the last id and stamp. REQUIRES: no batch is open on `mesh`. Cost: that of Mesh::Restore.
absl::StatusOr<RestoredBatches> RestoreBatches(Mesh& mesh, absl::Span<const BatchImage* const> images,
                                               const RestoreOptions& options);

/// What restoring is made of: runs restore(images), which edits `mesh` and gives what takes that back, as a
/// batch that is kept and committed or, for a dry run, rolled back. Errors: those of RunInBatch, EndBatch.
absl::StatusOr<RestoredBatches> RunRestore(
    Mesh& mesh, const RestoreOptions& options,
    absl::FunctionRef<absl::Status(std::deque<BatchImage>& images)> restore);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_EDIT_RESTORE_BATCHES_H_
