#include "core/mesh/box.h"

namespace dynmesh {

Box BoundsOf(const Mesh& mesh, EntityId id) {
  if (id.kind == EntityKind::kVertex) {
    const Point& position = mesh.Position(VertexId(id.slot));
    return {position, position};
  }
  const auto vertices = mesh.VerticesOf(id);
  Box box{mesh.Position(vertices[0]), mesh.Position(vertices[0])};
  for (VertexId v : vertices.subspan(1)) Include(mesh.Position(v), box);
  return box;
}

absl::optional<Box> BoundsOf(const Mesh& mesh) {
  const BitSet& live = mesh.slots(EntityKind::kVertex).live();
  if (live.empty()) return absl::nullopt;
  Box box = BoundsOf(mesh, VertexId(live.Next(0)));
  live.ForEach([&](Slot slot) { Include(mesh.Position(VertexId(slot)), box); });
  return box;
}

}  // namespace dynmesh
