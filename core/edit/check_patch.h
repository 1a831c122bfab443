#ifndef DYNMESH_CORE_EDIT_CHECK_PATCH_H_
#define DYNMESH_CORE_EDIT_CHECK_PATCH_H_

#include "absl/status/status.h"
#include "core/edit/patch.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

/// What the shape of new and moved elements must be.
struct PatchLimits {
  /// Cells keep the orientation of those whose place they take, triangles and quads the side that they face.
  bool keep_orientation = true;
  /// Least Quality (geometry.h) of each of them; 0: any.
  double min_quality = 0;
};

/// Whether the geometry permits a patch. Elements that are flat (kFlat), or folded, already have no
/// orientation to keep. Errors: FAILED_PRECONDITION WOULD_INVERT, WOULD_DEGRADE, with the kind and id of the
/// element whose place the offending one would take. Cost: linear in the patch and in the stars of the
/// vertices that it moves.
absl::Status CheckPatch(const Mesh& mesh, const Patch& patch, const PatchLimits& limits = {});

}  // namespace dynmesh

#endif  // DYNMESH_CORE_EDIT_CHECK_PATCH_H_
