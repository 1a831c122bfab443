#ifndef DYNMESH_CORE_EDIT_CONE_H_
#define DYNMESH_CORE_EDIT_CONE_H_

#include "absl/types/span.h"
#include "core/edit/patch.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

/// Adds the cell between a face and an apex: a tetrahedron or a pyramid. `face`: three or four vertices,
/// turning outwards as seen from the apex, as the faces of a template do from inside its cell.
void AddCone(absl::Span<const VertexId> face, VertexId apex, Patch& patch);

/// Adds cones from `apex` to the faces of a cell, but those of which `leaves_out(face)`.
template <typename LeavesOut>
void AddCones(ElementType type, absl::Span<const VertexId> cell, VertexId apex, LeavesOut leaves_out,
              Patch& patch) {
  const ElementTemplate& shape = TemplateOf(type);
  for (int i = 0; i < shape.num_faces; ++i) {
    const FaceVertices face(shape.faces[i], cell);
    if (!leaves_out(face.span())) AddCone(face.span(), apex, patch);
  }
}

}  // namespace dynmesh

#endif  // DYNMESH_CORE_EDIT_CONE_H_
