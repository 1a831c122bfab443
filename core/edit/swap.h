#ifndef DYNMESH_CORE_EDIT_SWAP_H_
#define DYNMESH_CORE_EDIT_SWAP_H_

#include "absl/status/status.h"
#include "core/edit/patch.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

/// Removes an edge and fills the gap anew, without a new vertex.
///
///     two triangles a b c, b a d    ->  a d c, d b c (flip)
///     three tetrahedra round a b    ->  two, between a and b and the triangle of the other three (3-2)
///     n tetrahedra round a b        ->  2 (n - 2): the best triangulation of the ring round the edge, as
///     seen
///                                       from a and from b (4-4, and general edge removal)
///
/// "Best": the smallest Quality of the new tetrahedra is largest; found by dynamic programming over the ring
/// (ring_triangulation.h; Shewchuk, "Two discrete optimization algorithms for the topological improvement of
/// tetrahedral meshes", 2002).
/// Errors: FAILED_PRECONDITION BOUNDARY (one triangle, or the ring is open), NON_MANIFOLD_EDGE (more than two
/// triangles, more than one ring, triangles and cells at the same edge), NOT_SIMPLEX, ELEMENT_IN_THE_WAY (the
/// edge or a face at it is an element beside cells), EDGE_EXISTS / FACE_EXISTS (what it would make is there:
/// no triangulation is left), INCONSISTENT_ORIENTATION, TOO_MANY_ELEMENTS (more than kMaxRing of
/// ring_triangulation.h), DEGENERATE_ELEMENT. REQUIRES: `e` is live. Cost: O(n^3).
absl::Status PlanSwapEdge(const Mesh& mesh, EdgeId e, Patch& patch);

/// Removes a face between two tetrahedra and joins the vertices across it by an edge (2-3).
/// Errors: FAILED_PRECONDITION BOUNDARY, NON_MANIFOLD_FACE, NOT_SIMPLEX, ELEMENT_IN_THE_WAY, EDGE_EXISTS,
/// INCONSISTENT_ORIENTATION, DEGENERATE_ELEMENT. REQUIRES: `f` is live.
absl::Status PlanSwapFace(const Mesh& mesh, FaceId f, Patch& patch);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_EDIT_SWAP_H_
