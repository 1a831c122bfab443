#ifndef DYNMESH_CORE_EDIT_REMOVE_VERTEX_H_
#define DYNMESH_CORE_EDIT_REMOVE_VERTEX_H_

#include "absl/status/status.h"
#include "core/edit/patch.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

/// Removes a vertex and fills the gap anew, without a new vertex.
///
///     nothing                      ->  nothing: an isolated vertex just goes
///     two wires a v, v b           ->  the wire a b
///     n triangles all round v      ->  n - 2: the best triangulation of the ring of their other corners
///     n triangles at a boundary v  ->  n - 1, between its neighbours on the boundary, which then are joined;
///                                      a single one goes (an ear)
///     tetrahedra                   ->  the collapse of v onto that neighbour which leaves the best worst
///                                      tetrahedron; onto one along the boundary where v is on it
///
/// "Best": the smallest Quality is largest, where elements that face the other way count as negative; the
/// dynamic programme of ring_triangulation.h. Whether the best is good enough is for CheckPatch to say.
/// Errors: FAILED_PRECONDITION NON_MANIFOLD_EDGE (more than two triangles), NON_MANIFOLD_VERTEX (more than
/// one fan of triangles, or more than two wires), BOUNDARY (the end of a wire), NOT_SIMPLEX,
/// ELEMENT_IN_THE_WAY (elements of several kinds), EDGE_EXISTS / FACE_EXISTS (what it would make is there: no
/// triangulation is left), INCONSISTENT_ORIENTATION, TOO_MANY_ELEMENTS (a ring of more than kMaxRing),
/// DEGENERATE_ELEMENT; of tetrahedra the errors of the first collapse when all are refused. REQUIRES: `v` is
/// live. Cost: O(n^3); of tetrahedra, that of planning a collapse for each edge.
absl::Status PlanRemoveVertex(const Mesh& mesh, VertexId v, Patch& patch);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_EDIT_REMOVE_VERTEX_H_
