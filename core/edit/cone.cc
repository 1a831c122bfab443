#include "core/edit/cone.h"

namespace dynmesh {

void AddCone(absl::Span<const VertexId> face, VertexId apex, Patch& patch) {
  if (face.size() == 3) {
    patch.Add(ElementType::kTetrahedron, {face[0], face[2], face[1], apex});
  } else {
    patch.Add(ElementType::kPyramid, {face[0], face[3], face[2], face[1], apex});
  }
}

}  // namespace dynmesh
