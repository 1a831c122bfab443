#ifndef DYNMESH_CORE_EDIT_STAR_H_
#define DYNMESH_CORE_EDIT_STAR_H_

#include <array>

#include "absl/container/inlined_vector.h"
#include "absl/status/status.h"
#include "absl/types/span.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

/// The elements that have an edge or a vertex: ascending, each once.
struct Star {
  absl::InlinedVector<CellId, 32> cells;
  absl::InlinedVector<FaceId, 8> faces;  ///< that are elements
  absl::InlinedVector<EdgeId, 4> wires;  ///< edges that are elements
  uint64_t work = 0;                     ///< entities looked at to find them
};

/// Duplicates at the same two vertices are of the star too. Cost: linear in the star, and sorting it.
Star StarOf(const Mesh& mesh, EdgeId e);
Star StarOf(const Mesh& mesh, VertexId v);

/// Calls fn(element) for each element of a star: cells, faces, wires.
template <typename Fn>
void ForEachElement(const Star& star, Fn fn) {
  for (CellId c : star.cells) fn(EntityId(c));
  for (FaceId f : star.faces) fn(EntityId(f));
  for (EdgeId e : star.wires) fn(EntityId(e));
}

/// FAILED_PRECONDITION DEGENERATE_ELEMENT naming an element that names a vertex twice, if there is one.
absl::Status CheckNotDegenerate(const Mesh& mesh, const Star& star);

/// FAILED_PRECONDITION NOT_SIMPLEX naming a cell of another type, if there is one.
absl::Status CheckTetrahedra(const Mesh& mesh, absl::Span<const CellId> cells);

/// Whether a face, or another one of the same vertices, is an element.
bool HasElementAt(const Mesh& mesh, FaceId f);

/// What StarOf(mesh, v) would look at. Cost: the faces at the vertex.
uint64_t WorkOfStar(const Mesh& mesh, VertexId v);

inline bool Contains(absl::Span<const VertexId> vertices, VertexId v) {
  for (VertexId other : vertices) {
    if (other == v) return true;
  }
  return false;
}

/// Whether `e` is the lower one of the two edges that a face, not degenerate, has at `v`: by which faces at a
/// vertex are seen once and not twice.
bool IsLowerEdge(const Mesh& mesh, FaceId f, VertexId v, EdgeId e);

/// The ends of an edge from `origin` on, or as they are stored where that is invalid.
std::array<VertexId, 2> EndsFrom(const Mesh& mesh, EdgeId e, VertexId origin);

/// TOO_MANY_ELEMENTS naming a vertex.
absl::Status TooManyElements(VertexId v);

/// FAILED_PRECONDITION with the kind and ids of what stands in the way.
absl::Status Refuse(absl::string_view reason, absl::string_view message, EntityKind kind,
                    absl::Span<const Slot> ids);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_EDIT_STAR_H_
