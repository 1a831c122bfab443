// Duplicate edges and faces: elements that stand where an equal one stood. Exactly one of them, the primary,
// is used by faces or cells; when the primary ceases to be an element, another takes over its uses.

#include <algorithm>

#include "core/mesh/mesh.h"

namespace dynmesh {

void Mesh::PassOnPrimary(EntityId id) {
  if (num_duplicates_[Dimension(id.kind)] == 0 || IsDuplicate(id)) return;
  if (id.kind == EntityKind::kFace) {
    const FaceId heir = FindDuplicateOf(FaceId(id.slot));
    if (!heir.valid()) return;
    MoveUsesTo(FaceId(id.slot), heir);
    SetDuplicateFlag(id, true);
    SetDuplicateFlag(heir, false);
  } else {
    const EdgeId heir = FindDuplicateOf(EdgeId(id.slot));
    if (!heir.valid()) return;
    MoveUsesTo(EdgeId(id.slot), heir);
    SetDuplicateFlag(id, true);
    SetDuplicateFlag(heir, false);
  }
}

// Both search from the end, where later uses stand: a pile of equal elements is cleared in linear time.

EdgeId Mesh::FindDuplicateOf(EdgeId e) const {
  auto [a, b] = edge_vertices_[e.slot()];
  if (vertex_edges_.Length(b.slot()) < vertex_edges_.Length(a.slot())) std::swap(a, b);
  const auto candidates = IncidentEdges(a);
  const auto heir = std::find_if(candidates.rbegin(), candidates.rend(), [&, a = a, b = b](EdgeId other) {
    const auto& ends = edge_vertices_[other.slot()];
    const bool joins = (ends[0] == a && ends[1] == b) || (ends[0] == b && ends[1] == a);
    return joins && IsDuplicate(other);
  });
  return heir == candidates.rend() ? EdgeId() : *heir;
}

FaceId Mesh::FindDuplicateOf(FaceId f) const {
  const auto candidates = IncidentFaces(LeastUsed(Edges(f)));
  const auto heir = std::find_if(candidates.rbegin(), candidates.rend(), [&](FaceId other) {
    return IsDuplicate(other) && MatchFace(Vertices(other), Vertices(f));
  });
  return heir == candidates.rend() ? FaceId() : *heir;
}

void Mesh::MoveUsesTo(EdgeId from, EdgeId to) {
  const auto uses = IncidentFaces(from);
  const std::vector<FaceId> faces(uses.begin(), uses.end());
  for (FaceId f : faces) {
    for (int k = 0; k < FaceSize(f); ++k) {
      if (Edges(f)[k] == from) ReplaceFaceEdge(f, k, to);
    }
  }
}

void Mesh::MoveUsesTo(FaceId from, FaceId to) {
  const auto uses = IncidentCells(from);
  const std::vector<CellId> cells(uses.begin(), uses.end());
  for (CellId c : cells) {
    for (size_t i = 0; i < Faces(c).size(); ++i) {
      if (Faces(c)[i].face() == from) ReplaceCellFace(c, i, to);
    }
  }
}

void Mesh::ReplaceCellFace(CellId c, int local_face, FaceId to) {
  OrientedFace& oriented = cell_faces_[size_t{c.slot()} * cell_face_stride_ + local_face];
  const FaceId from = oriented.face();
  Record({JournalOp::kReplaceCellFace, EntityKind::kCell, c.slot(), static_cast<uint32_t>(local_face),
          from.slot()});
  RemoveFaceCell(from, c);
  oriented = OrientedFace(to, CodeInCell(c, local_face, to));
  AddFaceCell(to, c);
}

void Mesh::ReplaceFaceEdge(FaceId f, int local_edge, EdgeId to) {
  EdgeId& edge = face_edges_[size_t{f.slot()} * face_stride_ + local_edge];
  const EdgeId from = edge;
  Record({JournalOp::kReplaceFaceEdge, EntityKind::kFace, f.slot(), static_cast<uint32_t>(local_edge),
          from.slot()});
  const bool on_boundary = IsOnBoundary(f);
  if (on_boundary) CountBoundary(from, -1);
  RemoveEdgeFace(from, f);
  edge = to;
  AddEdgeFace(to, f);
  if (on_boundary) CountBoundary(to, +1);
}

void Mesh::SetDuplicateFlag(EntityId id, bool duplicate) {
  Record({duplicate ? JournalOp::kSetDuplicate : JournalOp::kClearDuplicate, id.kind, id.slot, 0, 0});
  flags(id) = duplicate ? flags(id) | kDuplicateFlag : flags(id) & ~kDuplicateFlag;
  num_duplicates_[Dimension(id.kind)] += duplicate ? 1 : -1;
  if (id.kind == EntityKind::kEdge && !duplicate) IndexHubEdge(EdgeId(id.slot));
}

}  // namespace dynmesh
