#include "core/mesh/entity_content.h"

#include <algorithm>

namespace dynmesh {

bool EntityContent::IsShapedAs(const EntityContent& other) const {
  return type == other.type && state == other.state &&
         std::equal(vertices.begin(), vertices.begin() + NumVertices(type), other.vertices.begin());
}

EntityContent ContentOf(const Mesh& mesh, EntityId id) {
  EntityContent content;
  content.type = mesh.Type(id);
  if (mesh.IsElement(id)) content.state |= BatchImage::kElement;
  if (mesh.IsDuplicate(id)) content.state |= BatchImage::kDuplicate;
  const auto vertices = mesh.VerticesOf(id);
  std::copy(vertices.begin(), vertices.end(), content.vertices.begin());
  if (id.kind == EntityKind::kFace) {
    for (EdgeId e : mesh.Edges(FaceId(id.slot))) content.parts[content.num_parts++] = e.slot();
  } else if (id.kind == EntityKind::kCell) {
    for (OrientedFace oriented : mesh.Faces(CellId(id.slot))) {
      content.parts[content.num_parts++] = oriented.face().slot();
    }
  }
  return content;
}

void Append(Slot slot, const EntityContent& content, BatchImage::Entities& entities) {
  entities.slots.push_back(slot);
  entities.types.push_back(content.type);
  entities.states.push_back(content.state);
  entities.vertices.insert(entities.vertices.end(), content.vertices.begin(),
                           content.vertices.begin() + NumVertices(content.type));
  entities.parts.insert(entities.parts.end(), content.parts.begin(),
                        content.parts.begin() + content.num_parts);
}

void Expect(size_t count, BatchImage::Entities& entities) {
  constexpr size_t kTypicalVertices = 4;
  entities.slots.reserve(count);
  entities.types.reserve(count);
  entities.states.reserve(count);
  entities.vertices.reserve(count * kTypicalVertices);
  entities.parts.reserve(count * kTypicalVertices);
}

void Trim(BatchImage::Entities& entities) {
  entities.slots.shrink_to_fit();
  entities.types.shrink_to_fit();
  entities.states.shrink_to_fit();
  entities.vertices.shrink_to_fit();
  entities.parts.shrink_to_fit();
}

}  // namespace dynmesh
