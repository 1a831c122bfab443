// Single entities: creating and destroying them with their links, boundary counters, checksum terms and
// journal entries. Everything that Rollback has to undo happens here.

#include <algorithm>

#include "core/mesh/mesh.h"

namespace dynmesh {

// ---- Create ----

void Mesh::FillVertex(VertexId v, const Point& position) {
  positions_[v.slot()] = position;
  checksum_.topology += Checksum::VertexTerm(v.slot());
  checksum_.geometry += Checksum::PositionTerm(v.slot(), position);
  Touch(v);
}

EdgeId Mesh::CreateEdge(VertexId a, VertexId b, uint8_t extra_flags) {
  JournalEntry entry;
  const EdgeId e(NewSlot(EntityKind::kEdge, entry));
  FillEdge(e, {a, b}, extra_flags);
  Record(entry);
  return e;
}

void Mesh::FillEdge(EdgeId e, const std::array<VertexId, 2>& ends, uint8_t extra_flags) {
  edge_vertices_[e.slot()] = ends;
  flags(e) =
      static_cast<uint8_t>(ElementType::kWireEdge) | extra_flags | (ends[0] == ends[1] ? kDegenerateFlag : 0);
  if (IsDuplicate(e)) CountDuplicate(e, +1);
  LinkEdge(e);
  if (IsElement(e)) CountElement(e, +1);
}

FaceId Mesh::CreateFace(VertexSpan vertices, absl::Span<const EdgeId> edges, uint8_t extra_flags) {
  JournalEntry entry;
  const FaceId f(NewSlot(EntityKind::kFace, entry));
  FillFace(f, vertices, edges, extra_flags);
  Record(entry);
  return f;
}

void Mesh::FillFace(FaceId f, VertexSpan vertices, absl::Span<const EdgeId> edges, uint8_t extra_flags) {
  const size_t row = size_t{f.slot()} * face_stride_;
  for (size_t k = 0; k < 3; ++k) {  // known to the compiler, which else calls memmove
    face_vertices_[row + k] = vertices[k];
    face_edges_[row + k] = edges[k];
  }
  if (vertices.size() == 4) {
    face_vertices_[row + 3] = vertices[3];
    face_edges_[row + 3] = edges[3];
  }
  const ElementType type = vertices.size() == 4 ? ElementType::kQuad : ElementType::kTriangle;
  flags(f) = static_cast<uint8_t>(type) | extra_flags | (HasRepeats(vertices) ? kDegenerateFlag : 0);
  if (IsDuplicate(f)) CountDuplicate(f, +1);
  LinkFace(f);
  if (IsElement(f)) CountElement(f, +1);
}

CellId Mesh::CreateCell(ElementType type, VertexSpan vertices, absl::Span<const OrientedFace> faces) {
  JournalEntry entry;
  const CellId c(NewSlot(EntityKind::kCell, entry));
  FillCell(c, type, vertices, faces);
  Record(entry);
  return c;
}

void Mesh::FillCell(CellId c, ElementType type, VertexSpan vertices, absl::Span<const OrientedFace> faces) {
  std::copy(vertices.begin(), vertices.end(),
            cell_vertices_.begin() + size_t{c.slot()} * cell_vertex_stride_);
  std::copy(faces.begin(), faces.end(), cell_faces_.begin() + size_t{c.slot()} * cell_face_stride_);
  flags(c) = static_cast<uint8_t>(type) | kElementFlag | (HasRepeats(vertices) ? kDegenerateFlag : 0);
  LinkCell(c);
  CountElement(c, +1);
}

// ---- Destroy ----

void Mesh::DestroyVertex(VertexId v) {
  ResetAttributes(v);
  Record({JournalOp::kDestroy, EntityKind::kVertex, v.slot(), 0, changed(EntityKind::kVertex).At(v.slot())});
  checksum_.topology -= Checksum::VertexTerm(v.slot());
  checksum_.geometry -= Checksum::PositionTerm(v.slot(), Position(v));
  Touch(v);
  mutable_slots(EntityKind::kVertex).Free(v.slot());
}

void Mesh::DestroyEdge(EdgeId e) {
  EndEdge(e);
  PassOnPrimary(e);
}

void Mesh::EndEdge(EdgeId e) {
  ResetAttributes(e);
  Record({JournalOp::kDestroy, EntityKind::kEdge, e.slot(), 0, 0});
  if (IsDuplicate(e)) CountDuplicate(e, -1);
  UnlinkEdge(e);
  mutable_slots(EntityKind::kEdge).Free(e.slot());
}

void Mesh::DestroyFace(FaceId f) {
  EndFace(f);
  PassOnPrimary(f);
}

void Mesh::EndFace(FaceId f) {
  ResetAttributes(f);
  Record({JournalOp::kDestroy, EntityKind::kFace, f.slot(), 0, 0});
  if (IsDuplicate(f)) CountDuplicate(f, -1);
  UnlinkFace(f);
  mutable_slots(EntityKind::kFace).Free(f.slot());
}

void Mesh::DestroyCell(CellId c) {
  ResetAttributes(c);
  Record({JournalOp::kDestroy, EntityKind::kCell, c.slot(), 0, changed(EntityKind::kCell).At(c.slot())});
  UnlinkCell(c);
  CountElement(c, -1);
  mutable_slots(EntityKind::kCell).Free(c.slot());
}

bool Mesh::IsUnneeded(EdgeId e) const { return IsLive(e) && !IsElement(e) && IncidentFaces(e).empty(); }

bool Mesh::IsUnneeded(FaceId f) const { return IsLive(f) && !IsElement(f) && NumFaceCells(f) == 0; }

// ---- Links ----

void Mesh::LinkEdge(EdgeId e) {
  for (VertexId v : Vertices(e)) {
    vertex_edges_.Add(v.slot(), e, IsSolid() ? 8 : 6);
    if (vertex_edges_.Length(v.slot()) == kHubDegree + 1) IndexHubEdges(v);
  }
  IndexHubEdge(e);
  if (stored_.any()) stored_.EdgeLinked(*this, e);
}

bool Mesh::IsLastBetweenEnds(EdgeId e) const {
  const auto& duplicates = duplicates_[1];
  return !IsDuplicate(e) && (duplicates.empty() || duplicates.count(CanonicalCycle(Vertices(e))) == 0);
}

void Mesh::UnlinkEdge(EdgeId e) {
  if (stored_.any()) stored_.EdgeUnlinking(*this, e, IsLastBetweenEnds(e));
  ForgetHubEdge(e);
  for (VertexId v : Vertices(e)) vertex_edges_.Remove(v.slot(), e);
}

void Mesh::ForgetHubEdge(EdgeId e) {
  if (hub_edges_.empty()) return;
  const auto [a, b] = edge_vertices_[e.slot()];
  const auto it = hub_edges_.find(std::minmax(a, b));
  if (it != hub_edges_.end() && it->second == e) hub_edges_.erase(it);
}

void Mesh::IndexHubEdges(VertexId v) {
  for (EdgeId e : IncidentEdges(v)) IndexHubEdge(e);
}

void Mesh::IndexHubEdge(EdgeId e) {
  const auto [a, b] = edge_vertices_[e.slot()];
  if (vertex_edges_.Length(a.slot()) <= kHubDegree || vertex_edges_.Length(b.slot()) <= kHubDegree) return;
  if (!IsDuplicate(e)) hub_edges_[std::minmax(a, b)] = e;
}

void Mesh::LinkFace(FaceId f) {
  face_cells_[f.slot()] = {CellId(), CellId()};
  for (EdgeId e : Edges(f)) {
    AddEdgeFace(e, f);
    if (edge_faces_.Length(e.slot()) == kHubDegree + 1) IndexHubFaces(e);
  }
  IndexHubFace(f);
  if (stored_.any()) stored_.FaceLinked(*this, f);
}

void Mesh::IndexHubFaces(EdgeId e) {
  for (FaceId f : IncidentFaces(e)) IndexHubFace(f);
}

void Mesh::IndexHubFace(FaceId f) {
  const auto edges = Edges(f);
  const bool hubs = std::all_of(edges.begin(), edges.end(),
                                [this](EdgeId e) { return edge_faces_.Length(e.slot()) > kHubDegree; });
  if (hubs && !IsDuplicate(f)) hub_faces_[CanonicalCycle(Vertices(f))] = f;
}

void Mesh::ForgetHubFace(FaceId f) {
  if (hub_faces_.empty()) return;
  const auto it = hub_faces_.find(CanonicalCycle(Vertices(f)));
  if (it != hub_faces_.end() && it->second == f) hub_faces_.erase(it);
}

void Mesh::UnlinkFace(FaceId f) {
  if (stored_.any()) stored_.FaceUnlinking(*this, f);
  ForgetHubFace(f);
  for (EdgeId e : Edges(f)) RemoveEdgeFace(e, f);
}

void Mesh::LinkCell(CellId c) {
  for (OrientedFace oriented : Faces(c)) AddFaceCell(oriented.face(), c);
  if (stored_.any()) stored_.CellLinked(*this, c);
}

void Mesh::UnlinkCell(CellId c) {
  if (stored_.any()) stored_.CellUnlinking(*this, c);
  for (OrientedFace oriented : Faces(c)) RemoveFaceCell(oriented.face(), c);
}

uint32_t Mesh::NumFaceCells(FaceId f) const { return IncidentCells(f).size(); }

void Mesh::AddFaceCell(FaceId f, CellId c) {
  auto& uses = face_cells_[f.slot()];
  if (uses[1] == kOverflow) {
    face_overflow_.Add(uses[0].slot(), c);
  } else if (uses[1].valid()) {
    Slot list = num_overflow_lists_;
    if (free_overflow_lists_.empty()) {
      ++num_overflow_lists_;
    } else {
      list = free_overflow_lists_.back();
      free_overflow_lists_.pop_back();
    }
    for (CellId use : {uses[0], uses[1], c}) face_overflow_.Add(list, use);
    uses = {CellId(list), kOverflow};
  } else if (uses[0].valid()) {
    uses = {std::min(uses[0], c), std::max(uses[0], c)};
  } else {
    uses[0] = c;
  }
}

void Mesh::RemoveFaceCell(FaceId f, CellId c) {
  auto& uses = face_cells_[f.slot()];
  if (uses[1] == kOverflow) {
    const Slot list = uses[0].slot();
    face_overflow_.Remove(list, c);
    if (face_overflow_.Length(list) > 2) return;
    const auto rest = face_overflow_.Of(list);
    uses = {rest[0], rest[1]};
    for (CellId use : uses) face_overflow_.Remove(list, use);
    free_overflow_lists_.push_back(list);
  } else if (uses[1].valid()) {
    if (uses[0] == c) uses[0] = uses[1];
    uses[1] = CellId();
  } else {
    uses[0] = CellId();
  }
}

void Mesh::AddEdgeFace(EdgeId e, FaceId f) {
  const uint32_t before = edge_faces_.Length(e.slot());
  edge_faces_.Add(e.slot(), f, IsSolid() ? 6 : 2);
  if (before < 2) CountBoundary(e, before == 0 ? +1 : -1);
}

void Mesh::RemoveEdgeFace(EdgeId e, FaceId f) {
  edge_faces_.Remove(e.slot(), f);
  const uint32_t after = edge_faces_.Length(e.slot());
  if (after < 2) CountBoundary(e, after == 0 ? -1 : +1);
}

// ---- Boundary ----

bool Mesh::IsSettled(FaceId f) const {
  const auto& uses = face_cells_[f.slot()];
  return (uses[0].valid() && !uses[1].valid()) == IsOnBoundary(f);
}

void Mesh::SettleBoundary(FaceId f) {
  if (!IsSettled(f)) SetFaceOnBoundary(f, IsOnBoundary(f) ? -1 : +1);
}

void Mesh::SettleBoundary(CellId c) {
  for (OrientedFace oriented : Faces(c)) SettleBoundary(oriented.face());
}

void Mesh::SetFaceOnBoundary(FaceId f, int change) {
  boundary_[2].Assign(f.slot(), change > 0);
  for (EdgeId e : Edges(f)) CountBoundary(e, change);
}

void Mesh::CountBoundary(EdgeId e, int change) {
  const bool before = boundary_uses_[1][e.slot()] != 0;
  const bool after = (boundary_uses_[1][e.slot()] += change) != 0;
  if (before == after) return;
  boundary_[1].Assign(e.slot(), after);
  for (VertexId v : edge_vertices_[e.slot()]) {
    uint32_t& uses = boundary_uses_[0][v.slot()];
    if (after ? uses++ == 0 : --uses == 0) boundary_[0].Assign(v.slot(), after);
  }
}

// ---- Flags and order ----

uint64_t Mesh::ElementTerm(EntityId id) const {
  return Checksum::ElementTerm(Type(id), id.slot, VerticesOf(id));
}

void Mesh::CountElement(EntityId id, int change) {
  num_elements_[Dimension(id.kind)] += change;
  if (flags(id) & kDegenerateFlag) num_degenerate_ += change;
  checksum_.topology += change > 0 ? ElementTerm(id) : -ElementTerm(id);
  Touch(id);
}

void Mesh::SetElementFlag(EntityId id) {
  Record({JournalOp::kSetElement, id.kind, id.slot, 0, changed(id.kind).At(id.slot)});
  flags(id) |= kElementFlag;
  CountElement(id, +1);
}

void Mesh::ClearElementFlag(EntityId id) {
  Record({JournalOp::kClearElement, id.kind, id.slot, 0, changed(id.kind).At(id.slot)});
  CountElement(id, -1);
  flags(id) &= ~kElementFlag;
}

void Mesh::FlipEdge(EdgeId e) {
  Record({JournalOp::kFlipEdge, EntityKind::kEdge, e.slot(), 0, 0});
  std::swap(edge_vertices_[e.slot()][0], edge_vertices_[e.slot()][1]);
}

void Mesh::ReorderFace(FaceId f, FaceCode code) {
  const int n = FaceSize(f);
  if (code.value == 0) return;
  Record({JournalOp::kReorderFace, EntityKind::kFace, f.slot(), code.Inverse(n).value, 0});
  std::array<VertexId, kMaxFaceVertices> vertices;
  std::array<EdgeId, kMaxFaceVertices> edges;
  std::copy(Vertices(f).begin(), Vertices(f).end(), vertices.begin());
  std::copy(Edges(f).begin(), Edges(f).end(), edges.begin());
  for (int k = 0; k < n; ++k) {
    face_vertices_[size_t{f.slot()} * face_stride_ + k] = vertices[code.StoredVertex(k, n)];
    face_edges_[size_t{f.slot()} * face_stride_ + k] = edges[code.StoredEdge(k, n)];
  }
  for (CellId c : IncidentCells(f)) RecodeFace(c, f);
}

void Mesh::RecodeFace(CellId c, FaceId f) {
  const ElementTemplate& shape = TemplateOf(Type(c));
  for (int i = 0; i < shape.num_faces; ++i) {
    OrientedFace& oriented = cell_faces_[size_t{c.slot()} * cell_face_stride_ + i];
    if (oriented.face() == f) oriented = OrientedFace(f, CodeInCell(c, i, f));
  }
}

FaceCode Mesh::CodeInCell(CellId c, int local_face, FaceId f) const {
  const LocalFace& face = TemplateOf(Type(c)).faces[local_face];
  std::array<VertexId, kMaxFaceVertices> key;
  for (int k = 0; k < face.size; ++k) key[k] = Vertices(c)[face.vertices[k]];
  return *MatchFace(Vertices(f), absl::MakeConstSpan(key.data(), face.size));
}

}  // namespace dynmesh
