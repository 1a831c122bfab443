#ifndef DYNMESH_CORE_EDIT_CONE_H_
#define DYNMESH_CORE_EDIT_CONE_H_

#include "absl/types/span.h"
#include "core/edit/patch.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

/// Adds the cell between a face and an apex: a tetrahedron or a pyramid. `face`: three or four vertices,
/// turning outwards as seen from the apex, as the faces of a template do from inside its cell.
void AddCone(absl::Span<const VertexId> face, VertexId apex, Patch& patch);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_EDIT_CONE_H_
