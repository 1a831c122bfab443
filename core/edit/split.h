#ifndef DYNMESH_CORE_EDIT_SPLIT_H_
#define DYNMESH_CORE_EDIT_SPLIT_H_

#include "absl/status/status.h"
#include "absl/types/optional.h"
#include "core/edit/patch.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

/// Where the new vertex of a split goes.
struct SplitPlace {
  /// On the edge: 0 is its first vertex, 1 its second, unless `origin` says so. REQUIRES: 0 < parameter < 1.
  double parameter = 0.5;
  /// Anywhere: then `parameter` only weighs the attributes.
  absl::optional<Point> position = {};
  /// The end where the parameter is 0; invalid: the first vertex.
  VertexId origin = {};
};

/// Puts a vertex m on an edge and replaces every element at the edge: wires, faces and cells, on the boundary
/// or not, however many.
///
///     tetrahedron a b c d  ->  a m c d, m b c d          wire, triangle: two of the same
///     quad                 ->  three triangles at m
///     other cells          ->  at m, a tetrahedron or pyramid for each face that does not have the edge
///
/// Faces that do not have the edge stay as they are, so the mesh stays conforming.
/// Errors: FAILED_PRECONDITION DEGENERATE_ELEMENT. REQUIRES: `e` is live. Cost: linear in the star of the
/// edge.
absl::Status PlanSplitEdge(const Mesh& mesh, EdgeId e, const SplitPlace& place, Patch& patch);

/// Puts a vertex into an element, at `position` or else its centroid, and replaces the element by as many as
/// it has faces (a face: edges; a wire: ends), each between one of them and the new vertex. Errors:
/// FAILED_PRECONDITION DEGENERATE_ELEMENT, NOT_AN_ELEMENT; of a face that cells use ELEMENT_IN_THE_WAY, as
/// those would no longer fit. REQUIRES: `element` is live.
absl::Status PlanSplitElement(const Mesh& mesh, EntityId element, const absl::optional<Point>& position,
                              Patch& patch);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_EDIT_SPLIT_H_
