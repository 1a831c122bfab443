// Asking memory for the neighbourhood of edges and faces that are about to be edited.
//
// Random places lie in some hundred cache lines each, which one after the other would take far longer than
// the edit itself.

#include <algorithm>

#include "core/mesh/mesh.h"
#include "core/mesh/pipeline.h"

namespace dynmesh {
namespace {

/// Larger stars are not asked for: they would only push out each other.
constexpr size_t kLargestStar = 16;

}  // namespace

void Mesh::PrefetchVertex(VertexId v, int step) const {
  if (step == 1) return vertex_edges_.PrefetchEntries(v.slot());
  Prefetch(&positions_[v.slot()]);
  Prefetch(&boundary_uses_[0][v.slot()]);
  vertex_edges_.PrefetchList(v.slot());
}

void Mesh::PrefetchEdge(EdgeId e, int step) const {
  if (step == 1) return edge_faces_.PrefetchEntries(e.slot());
  Prefetch(&edge_vertices_[e.slot()]);
  Prefetch(&boundary_uses_[1][e.slot()]);
  Prefetch(&flags_[1][e.slot()]);
  edge_faces_.PrefetchList(e.slot());
}

void Mesh::PrefetchFace(FaceId f) const {
  Prefetch(&face_vertices_[size_t{f.slot()} * face_stride_]);
  Prefetch(&face_edges_[size_t{f.slot()} * face_stride_]);
  Prefetch(&face_cells_[f.slot()]);
  Prefetch(&flags_[2][f.slot()]);
  if (!IsSolid()) changed_[2].PrefetchStamp(f.slot());  // faces of solids are rarely elements
}

void Mesh::PrefetchCell(CellId c) const {
  Prefetch(&cell_vertices_[size_t{c.slot()} * cell_vertex_stride_]);
  Prefetch(&cell_faces_[size_t{c.slot()} * cell_face_stride_]);
  Prefetch(&flags_[3][c.slot()]);
  changed_[3].PrefetchStamp(c.slot());
}

/// A corner of a face that an edge, or of a cell that a face has not.
template <typename Lower, typename Upper>
VertexId Mesh::OppositeOf(Lower lower, Upper upper) const {
  const auto shared = Vertices(lower);
  for (VertexId v : Vertices(upper)) {
    if (std::find(shared.begin(), shared.end(), v) == shared.end()) return v;
  }
  return shared[0];
}

void Mesh::PrefetchNeighbors(VertexId v) const {
  const auto edges = IncidentEdges(v);
  if (edges.size() > kLargestStar) return;
  for (EdgeId e : edges) Prefetch(&edge_vertices_[e.slot()]);
}

void Mesh::PrefetchEdges(FaceId f, int step) const {
  for (EdgeId e : Edges(f)) PrefetchEdge(e, step);
}

void Mesh::PrefetchStar(EdgeId e, int stage) const {
  if (!IsLive(e)) return;
  if (stage == 0) slots_[1].births().PrefetchStamp(e.slot());
  if (stage < 2) return PrefetchEdge(e, stage);
  const auto faces = IncidentFaces(e);
  if (faces.size() > kLargestStar) return;
  for (FaceId f : faces) {
    stage == 2 ? PrefetchFace(f) : PrefetchRound(f, stage - 2);
    if (stage == kPrefetchStages - 1 && !IsSolid()) PrefetchNeighbors(OppositeOf(e, f));
  }
}

void Mesh::PrefetchStar(FaceId f, int stage) const {
  if (!IsLive(f)) return;
  if (stage == 0) slots_[2].births().PrefetchStamp(f.slot());
  stage == 0 ? PrefetchFace(f) : PrefetchRound(f, stage);
  if (stage < 3 || stage > 5 || IncidentCells(f).size() > 2) return;
  for (CellId c : IncidentCells(f)) {  // their other corners may be joined by an edge
    const VertexId apex = OppositeOf(f, c);
    stage == 5 ? PrefetchNeighbors(apex) : PrefetchVertex(apex, stage - 3);
  }
}

void Mesh::PrefetchRound(FaceId f, int stage) const {
  const auto cells = IncidentCells(f);
  if (cells.size() > 2) return;
  if (stage <= 2) {
    PrefetchEdges(f, stage - 1);
    for (VertexId v : Vertices(f)) PrefetchVertex(v, stage - 1);
  }
  for (CellId c : cells) {
    if (stage == 1) PrefetchCell(c);
    if (stage == 2) {
      for (OrientedFace oriented : Faces(c)) PrefetchFace(oriented.face());
    }
    // One face more brings the last edge.
    if (stage > 2) PrefetchEdges(Faces(c)[Faces(c)[0].face() == f ? 1 : 0].face(), stage - 3);
  }
}

void Mesh::PrefetchStar(VertexId v, int stage) const {
  if (!IsLive(v)) return;
  if (stage < 2) return PrefetchVertex(v, stage);
  const auto edges = IncidentEdges(v);
  if (edges.size() > 2 * kLargestStar) return;
  for (EdgeId e : edges) {
    if (stage < 4) {
      PrefetchEdge(e, stage - 2);
      continue;
    }
    const auto faces = IncidentFaces(e);
    if (faces.size() > kLargestStar) return;
    for (FaceId f : faces) {
      if (stage == 4) PrefetchFace(f);
      if (stage == 5 && IncidentCells(f).size() == 2) PrefetchCell(IncidentCells(f)[0]);
      if (stage == 6 && IncidentCells(f).size() == 2) {
        for (OrientedFace oriented : Faces(IncidentCells(f)[0])) PrefetchFace(oriented.face());
      }
    }
  }
}

}  // namespace dynmesh
