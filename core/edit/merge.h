#ifndef DYNMESH_CORE_EDIT_MERGE_H_
#define DYNMESH_CORE_EDIT_MERGE_H_

#include "absl/status/status.h"
#include "absl/types/optional.h"
#include "core/edit/patch.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

/// Welds two vertices: `gone` becomes `kept` in every element, and is removed. Edges and faces that have the
/// same vertices then are one: two meshes that touch grow together vertex by vertex. This is the one operator
/// that is meant to change the topology.
///
/// `position`: where the vertex is then; by default where `kept` is. Attributes follow the policies
/// of their columns, where `kept` has all the weight.
/// Errors: FAILED_PRECONDITION EDGE_EXISTS with the edge that joins the two (collapse it), NOT_SIMPLEX with
/// an element that has both, DUPLICATE_ELEMENT with an element that another one would equal,
/// DEGENERATE_ELEMENT; INVALID_ARGUMENT BAD_ARGUMENT when both are the same. REQUIRES: both are live. Cost:
/// linear in the star of `gone`, times its look-ups.
absl::Status PlanMergeVertices(const Mesh& mesh, VertexId kept, VertexId gone,
                               const absl::optional<Point>& position, Patch& patch);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_EDIT_MERGE_H_
