#include "core/edit/patch.h"

#include <algorithm>
#include <utility>

#include "core/mesh/vector.h"

namespace dynmesh {

void Patch::Clear() {
  new_vertices.clear();
  moves.clear();
  mergers.clear();
  cuts.clear();
  removed.clear();
  added.clear();
  parents.clear();
  removed_vertices.clear();
  check_euler = false;
  orientation = 0;
  work = 0;
}

VertexId Patch::AddVertex(const Point& position, Blend blend) {
  new_vertices.push_back({position, std::move(blend)});
  return VertexId(kNewVertex | static_cast<Slot>(new_vertices.size() - 1));
}

void Patch::Add(ElementType type, absl::Span<const VertexId> vertices) {
  AddChildOf(removed.size() - 1, type, vertices);
}

void Patch::AddChildOf(size_t parent, ElementType type, absl::Span<const VertexId> vertices) {
  added.emplace_back(type, vertices);
  parents.push_back(parent);
}

Patch::NewVertex MiddleOf(const Mesh& mesh, const Patch& patch, absl::Span<const VertexId> vertices) {
  Patch::NewVertex middle{{0, 0, 0}, {}};
  const double weight = 1.0 / vertices.size();
  for (VertexId v : vertices) {
    middle.position = middle.position + weight * PositionAfter(mesh, patch, v);
    middle.blend.vertices.push_back(v);
    middle.blend.weights.push_back(weight);
  }
  return middle;
}

Point PositionAfter(const Mesh& mesh, const Patch& patch, VertexId v) {
  if (v.slot() & kNewVertex) return patch.new_vertices[v.slot() & ~kNewVertex].position;
  const auto move = std::find_if(patch.moves.begin(), patch.moves.end(),
                                 [v](const Patch::Move& candidate) { return candidate.vertex == v; });
  return move == patch.moves.end() ? mesh.Position(v) : move->position;
}

}  // namespace dynmesh
