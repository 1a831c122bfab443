#ifndef DYNMESH_CORE_REPAIR_SPLIT_NON_MANIFOLD_H_
#define DYNMESH_CORE_REPAIR_SPLIT_NON_MANIFOLD_H_

#include "absl/status/statusor.h"
#include "core/repair/repair_report.h"
#include "core/repair/repair_work.h"

namespace dynmesh {

/// Gives each fan of elements at a vertex (fans.h) a vertex of its own: the first fan keeps the vertex, the
/// others get copies of it, with its position and attributes. Vertices are taken in ascending order, and
/// those of the elements that got a copy once more: a face that hung on a cell may have lost it.
///
///     two fans of triangles at v       ->  v and v'
///     three faces on the edge a b      ->  a sheet each, but where two go on together at both ends
///     solids that touch in a vertex or an edge  ->  apart
///
/// Surfaces are manifold afterwards: after its own turn a vertex has edges of at most two faces, in one fan,
/// and later turns take no such edge apart (cutting of Gueziec, Taubin, Lazarus, Horn, "Cutting and
/// stitching: converting sets of polygons to manifold surfaces", 2001). Solids may stay non-manifold where an
/// edge or a face is pinched between cells that hang together at both ends: copies of vertices cannot mend
/// that. Findings: kSplit, kAdded, kStillNonManifold (edges of more than two faces that are elements, or that
/// bound solids; faces of more than two cells). A second run finds nothing to split. Errors: those of Mesh's
/// edits; the meter's. REQUIRES: a batch is open. Cost: linear in the stars of all vertices.
absl::StatusOr<RepairReport> SplitNonManifold(RepairWork& work);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_REPAIR_SPLIT_NON_MANIFOLD_H_
