#ifndef DYNMESH_CORE_EDIT_APPLY_PATCH_H_
#define DYNMESH_CORE_EDIT_APPLY_PATCH_H_

#include <cstdint>
#include <limits>
#include <vector>

#include "absl/status/status.h"
#include "core/edit/patch.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

/// What a patch became: ids of its new vertices and elements, in its order.
struct AppliedPatch {
  std::vector<VertexId> new_vertices;
  std::vector<EntityId> added;
  uint64_t attribute_bytes = 0;  ///< that attributes of new and kept entities took
};

/// Carries out a patch. Faces and edges that old and new elements share live on. Attributes follow the
/// policies of their columns (mix_rows.h): new elements take those of the element whose place they take, new
/// vertices those of their blend, kept vertices those of both; for edges and faces see derived_rows.h.
///
/// Errors: those of Mesh's edits; FAILED_PRECONDITION WOULD_CHANGE_TOPOLOGY when the Euler characteristic
/// (vertices - edges + faces - cells) would change and Patch::check_euler is set; RESOURCE_EXHAUSTED when
/// attributes take more than `max_attribute_bytes`. Nothing has changed then. REQUIRES: a batch is open; the
/// mesh is as it was when the patch was planned. Cost: linear in the patch.
absl::Status ApplyPatch(Mesh& mesh, const Patch& patch, AppliedPatch& applied,
                        uint64_t max_attribute_bytes = std::numeric_limits<uint64_t>::max());

}  // namespace dynmesh

#endif  // DYNMESH_CORE_EDIT_APPLY_PATCH_H_
