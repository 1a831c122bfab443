#ifndef DYNMESH_CORE_EDIT_RESTORE_REVISION_H_
#define DYNMESH_CORE_EDIT_RESTORE_REVISION_H_

#include "absl/status/statusor.h"
#include "core/edit/restore_batches.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

/// Puts a mesh back to what it was at an earlier revision, as a new revision: `target` is the mesh as it was
/// then, a Clone() or what an archive gives back (core/archive).
///
///     const Mesh then = *std::move(rebuilder).Finish();    // of what an archive held at revision 17
///     const RestoredBatches restored = *RestoreRevision(mesh, then, {.keeper = &log});
///     undo.Push(restored.images[0]);                       // to RestoreBatches(), as that of any batch
///
/// All comes back with its ids of all kinds: elements and duplicates, what is below them, orders of vertices,
/// positions, rows. What differs is stamped, and nothing else: entities that had ended meanwhile are born
/// now, so ids read in between are refused where they mean somebody else. Columns added since stay, with
/// default rows; relations are stored or not as they were.
///
/// The result has one image, or none: after a dry run, or if that takes more than options.max_image_bytes.
/// Errors: those of ImageOfRevision, of Mesh::Restore, of the meter, which is charged each slot looked at and
/// each item of the difference, and of the keeper. After an error or a dry run the mesh is as it was, to the
/// last id and stamp. REQUIRES: no batch is open on either. Cost: of ImageOfRevision and Mesh::Restore.
absl::StatusOr<RestoredBatches> RestoreRevision(Mesh& mesh, const Mesh& target,
                                                const RestoreOptions& options);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_EDIT_RESTORE_REVISION_H_
