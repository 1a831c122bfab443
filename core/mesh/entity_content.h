#ifndef DYNMESH_CORE_MESH_ENTITY_CONTENT_H_
#define DYNMESH_CORE_MESH_ENTITY_CONTENT_H_

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/mesh/batch_image.h"
#include "core/mesh/element_type.h"
#include "core/mesh/ids.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

/// One edge, face or cell, as BatchImage::Entities tells it.
struct EntityContent {
  ElementType type = ElementType::kUnspecified;
  uint8_t state = 0;
  std::array<VertexId, kMaxElementVertices> vertices = {};
  std::array<Slot, kMaxElementFaces> parts = {};
  int num_parts = 0;

  /// All but the parts, which follow from the vertices.
  bool IsShapedAs(const EntityContent& other) const;
};

/// Of an entity that lives, or was the last at its slot. REQUIRES: id.kind is not kVertex.
EntityContent ContentOf(const Mesh& mesh, EntityId id);

void Append(Slot slot, const EntityContent& content, BatchImage::Entities& entities);

/// Room for what most entities need: of tetrahedra exactly.
void Expect(size_t count, BatchImage::Entities& entities);

/// Images may be kept for long.
void Trim(BatchImage::Entities& entities);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_MESH_ENTITY_CONTENT_H_
