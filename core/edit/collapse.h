#ifndef DYNMESH_CORE_EDIT_COLLAPSE_H_
#define DYNMESH_CORE_EDIT_COLLAPSE_H_

#include "absl/status/status.h"
#include "absl/types/optional.h"
#include "core/edit/patch.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

/// Where the two ends of a collapsed edge meet.
struct CollapsePlace {
  /// On the edge: 0 is its first vertex, 1 its second, unless `origin` says so. The nearer end keeps its id,
  /// that of 0 at 0.5.
  double parameter = 0;
  /// Anywhere: then `parameter` only says which end stays and weighs the attributes.
  absl::optional<Point> position = {};
  /// The end where the parameter is 0; invalid: the first vertex.
  VertexId origin = {};
};

/// Draws an edge together: the vertex `gone` becomes the vertex `kept` in every element.
///
///     wire, triangle, tetrahedron with the edge  ->  nothing
///     quad                                       ->  a triangle
///     other cells with the edge                  ->  tetrahedra and pyramids between the kept vertex and the
///                                                    faces without it where all its own faces are triangles
///                                                    then, else between a new vertex in the middle and all
///                                                    faces
///     elements with `gone` only                  ->  the same with `kept`
///
/// Faces without the edge stay what they are, triangles or quads, so the mesh stays conforming.
///
/// Nothing merges but what the edge's own faces and cells tie together (link condition: Dey, Edelsbrunner,
/// Guha, Nekhayev, "Topology preserving edge contraction", 1999, with a boundary that counts as part of a
/// link), so manifold stays manifold and the Euler characteristic what it is. Errors: FAILED_PRECONDITION
/// LINK_CONDITION with the vertices that would close a gap, or the faces that would merge; BOUNDARY where an
/// inner edge joins two boundary vertices; NOT_SIMPLEX where the ends are opposite corners of a quad or cell;
/// TOO_MANY_ELEMENTS; DEGENERATE_ELEMENT. REQUIRES: `e` is live. Cost: linear in the stars of both ends,
/// times their look-ups.
absl::Status PlanCollapseEdge(const Mesh& mesh, EdgeId e, const CollapsePlace& place, Patch& patch);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_EDIT_COLLAPSE_H_
