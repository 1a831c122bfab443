#ifndef DYNMESH_CORE_EDIT_POLYGON_H_
#define DYNMESH_CORE_EDIT_POLYGON_H_

#include <array>
#include <cstddef>

#include "absl/types/span.h"
#include "core/edit/star.h"
#include "core/mesh/element_type.h"

/// What becomes of the vertices of an edge or face where an edge is collapsed or split.
namespace dynmesh {

/// Up to four vertices of an edge or face.
struct Polygon {
  std::array<VertexId, kMaxFaceVertices> vertices;
  size_t size = 0;

  absl::Span<const VertexId> span() const { return absl::MakeConstSpan(vertices.data(), size); }
};

/// The cycle with `gone` as `kept`; one vertex shorter if it has both.
inline Polygon Merged(absl::Span<const VertexId> cycle, VertexId kept, VertexId gone) {
  Polygon merged;
  const bool both = Contains(cycle, kept) && Contains(cycle, gone);
  for (VertexId v : cycle) {
    if (v == gone && both) continue;
    merged.vertices[merged.size++] = v == gone ? kept : v;
  }
  return merged;
}

/// Calls fn(from, to) for each side of a cycle but a-b, in its order.
template <typename Fn>
void ForEachOtherSide(absl::Span<const VertexId> cycle, VertexId a, VertexId b, Fn fn) {
  for (size_t k = 0; k < cycle.size(); ++k) {
    const VertexId from = cycle[k], to = cycle[(k + 1) % cycle.size()];
    if (!((from == a && to == b) || (from == b && to == a))) fn(from, to);
  }
}

}  // namespace dynmesh

#endif  // DYNMESH_CORE_EDIT_POLYGON_H_
