#ifndef DYNMESH_CORE_EDIT_REVISION_IMAGE_H_
#define DYNMESH_CORE_EDIT_REVISION_IMAGE_H_

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/mesh/batch_image.h"
#include "core/mesh/error.h"
#include "core/mesh/mesh.h"
#include "core/mesh/work_meter.h"

namespace dynmesh {

/// INVALID_ARGUMENT BAD_ARGUMENT: a mesh was to be put back to what it never was. `why` ends the sentence.
absl::Status NotAnEarlierState(absl::string_view why, ErrorMetadata metadata = {});

/// What takes `mesh` to `target`, for Mesh::Restore(): `target` is what `mesh` was at target.revision().
///
/// An entity is the same in both if it lives in `mesh` and was born by then; whoever else lives at a slot has
/// to go, and who lived there in `target` is put back. Columns that `target` has not stay, with default rows.
///
/// Errors: OUT_OF_RANGE REVISION_IN_FUTURE, metadata revision and requested; NotAnEarlierState() where that
/// is seen: of another mesh not all is looked at. Those of `meter`, which is charged the slots looked at.
/// REQUIRES: no batch is open on `target`, none that has edited on `mesh`.
/// Cost: the difference; of vertices, cells and rows the pages touched since, by their stamps. All edges and
/// faces: whether one is a duplicate, and its order of vertices, bear no stamps.
absl::StatusOr<BatchImage> ImageOfRevision(const Mesh& mesh, const Mesh& target, WorkMeter& meter);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_EDIT_REVISION_IMAGE_H_
