// Hierarchical creation: which edges and faces of a new element exist already, and which must be made.

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "core/mesh/cell_parts.h"
#include "core/mesh/mesh.h"

namespace dynmesh {
namespace {

/// Beyond as many faces on a smart edge, a face is looked for round the least used of its edges.
constexpr uint32_t kCrowded = 16;

Slot XorOf(const VertexId* vertices, size_t size) {
  const Slot first_three = vertices[0].slot() ^ vertices[1].slot() ^ vertices[2].slot();
  return size == 4 ? first_three ^ vertices[3].slot() : first_three;
}

}  // namespace

// ---- Checks ----

absl::StatusOr<EntityId> Mesh::AddElement(ElementType type, absl::Span<const VertexId> vertices) {
  DYNMESH_RETURN_IF_ERROR(CheckVertices(type, vertices));
  const absl::StatusOr<EntityId> id = AddChecked(type, vertices, {});
  if (id.ok() && id->kind == EntityKind::kCell) SettleBoundary(CellId(id->slot));
  return id;
}

absl::StatusOr<EntityId> Mesh::AddChecked(ElementType type, VertexSpan vertices, const SmartEdges& known) {
  DYNMESH_RETURN_IF_ERROR(CheckRoom(type));
  switch (KindOf(type)) {
    case EntityKind::kEdge:
      return AddWireEdge(vertices);
    case EntityKind::kFace:
      return AddFaceElement(vertices);
    default:
      return AddCell(type, vertices, known);
  }
}

absl::Status Mesh::CheckVertices(ElementType type, VertexSpan vertices) const {
  if (!IsElementType(static_cast<int>(type))) {
    return InvalidArgument(reason::kBadElementType,
                           absl::StrCat("element type ", static_cast<int>(type), " is none of 1-7"));
  }
  if (vertices.size() != static_cast<size_t>(NumVertices(type))) {
    return InvalidArgument(reason::kBadArrayLength,
                           absl::StrCat("a ", ElementTypeName(type), " has ", NumVertices(type),
                                        " vertices, not ", vertices.size()));
  }
  for (VertexId v : vertices) {
    if (!IsLive(v)) return CheckLive(v);
  }
  return absl::OkStatus();
}

absl::Status Mesh::CheckRoom(ElementType type) const {
  const ElementTemplate& shape = TemplateOf(type);
  return CheckRoom({0, shape.num_edges, shape.num_faces, shape.kind == EntityKind::kCell});
}

absl::Status Mesh::CheckRoom(const std::array<uint32_t, kNumEntityKinds>& needed) const {
  constexpr absl::string_view kLimitNames[] = {"max_vertices", "max_edges", "max_faces", "max_cells"};
  for (int kind = 1; kind < kNumEntityKinds; ++kind) {
    const uint32_t limit = options_.limits.max_slots[kind];
    if (!slots_[kind].CanAllocate(needed[kind], limit)) {
      return LimitExceeded(kLimitNames[kind], limit, uint64_t{slots_[kind].num_live()} + needed[kind]);
    }
  }
  return CheckListRoom(needed);
}

absl::Status Mesh::CheckListRoom(const std::array<uint32_t, kNumEntityKinds>& needed) const {
  if (!vertex_edges_.HasRoom(2 * needed[1]) || !edge_faces_.HasRoom(kMaxFaceVertices * needed[2]) ||
      !face_overflow_.HasRoom(kMaxElementFaces * needed[3]) ||
      !stored_.HasRoom(kMaxElementFaces * 2 * StoredRows::kMaxRow)) {
    return LimitExceeded("max_incident_entities", IncidenceLists<EdgeId>::kMaxLength,
                         uint64_t{IncidenceLists<EdgeId>::kMaxLength} + 1);
  }
  return absl::OkStatus();
}

absl::Status Mesh::RefuseDuplicate(EntityId existing) const {
  return InvalidArgument(
      reason::kDuplicateElement,
      absl::StrCat("the element equals ", EntityKindName(existing.kind), " ", existing.slot),
      {{"kind", std::string(EntityKindName(existing.kind))}, {"ids", absl::StrCat(existing.slot)}});
}

// ---- Look-up ----

EdgeId Mesh::FindEdge(VertexId a, VertexId b) const {
  if (vertex_edges_.Length(b.slot()) < vertex_edges_.Length(a.slot())) std::swap(a, b);
  const auto edges = IncidentEdges(a);
  if (edges.size() > kHubDegree) {
    const auto it = hub_edges_.find(std::minmax(a, b));
    return it == hub_edges_.end() ? EdgeId() : it->second;
  }
  for (EdgeId e : edges) {
    const auto& ends = edge_vertices_[e.slot()];
    const bool joins = (ends[0] == a && ends[1] == b) || (ends[0] == b && ends[1] == a);
    if (joins && !IsDuplicate(e)) return e;
  }
  return EdgeId();
}

FaceId Mesh::FindFace(absl::Span<const VertexId> vertices) const {
  std::array<EdgeId, kMaxFaceVertices> edges;
  const size_t n = vertices.size();
  if (n < 3 || n > kMaxFaceVertices) return FaceId();
  for (size_t k = 0; k < n; ++k) {
    edges[k] = FindEdge(vertices[k], vertices[(k + 1) % n]);
    if (!edges[k].valid()) return FaceId();
  }
  return FindFaceAround(LeastUsed(absl::MakeConstSpan(edges.data(), n)), vertices).face;
}

EdgeId Mesh::LeastUsed(absl::Span<const EdgeId> edges) const {
  return *std::min_element(edges.begin(), edges.end(), [this](EdgeId a, EdgeId b) {
    return edge_faces_.Length(a.slot()) < edge_faces_.Length(b.slot());
  });
}

Mesh::FaceMatch Mesh::FindFaceAround(EdgeId e, VertexSpan vertices) const {
  if (vertices.size() > static_cast<size_t>(face_stride_)) return {};  // there are no quads
  if (edge_faces_.Length(e.slot()) > kHubDegree) {
    const auto it = hub_faces_.find(CanonicalCycle(vertices));
    return it == hub_faces_.end() ? FaceMatch()
                                  : FaceMatch{it->second, *MatchFace(Vertices(it->second), vertices)};
  }
  // Equal cycles have equal exclusive-ors: few others pass.
  const Slot sieve = XorOf(vertices.data(), vertices.size());
  for (FaceId f : IncidentFaces(e)) {
    const VertexId* stored = &face_vertices_[size_t{f.slot()} * face_stride_];
    if (XorOf(stored, vertices.size()) != sieve || IsDuplicate(f)) continue;
    if (const auto code = MatchFace(Vertices(f), vertices)) return {f, *code};
  }
  return {};
}

Mesh::FaceMatch Mesh::FindCellFace(const ElementTemplate& shape, int local_face, VertexSpan vertices,
                                   CellParts& parts) const {
  const LocalFace& face = shape.faces[local_face];
  EdgeId around = parts.edges[shape.smart_edges[shape.smart_edge_of_face[local_face]]];
  if (!around.valid()) return {};  // a face on a new edge is new
  if (edge_faces_.Length(around.slot()) > kCrowded) {
    for (int k = 0; k < face.size; ++k) {
      EdgeId& e = parts.edges[face.edges[k]];
      const LocalEdge& ends = shape.edges[face.edges[k]];
      if (!e.valid()) e = FindEdge(vertices[ends.vertices[0]], vertices[ends.vertices[1]]);
      if (!e.valid()) return {};
      if (edge_faces_.Length(e.slot()) < edge_faces_.Length(around.slot())) around = e;
    }
  }
  return FindFaceAround(around, FaceVertices(face, vertices).span());
}

void Mesh::FindCellParts(const ElementTemplate& shape, VertexSpan vertices, const SmartEdges& known,
                         CellParts& parts) const {
  for (int s = 0; s < shape.num_smart_edges; ++s) {
    EdgeId& e = parts.edges[shape.smart_edges[s]];
    const LocalEdge& ends = shape.edges[shape.smart_edges[s]];
    e = known[s].valid() ? known[s] : FindEdge(vertices[ends.vertices[0]], vertices[ends.vertices[1]]);
  }
  for (int i = 0; i < shape.num_faces; ++i) {
    parts.faces[i] = FindCellFace(shape, i, vertices, parts);
    if (parts.faces[i].face.valid()) parts.TakeEdges(shape, i, Edges(parts.faces[i].face));
  }
}

bool Mesh::HasFaces(CellId c, ElementType type, const CellParts& parts) const {
  if (Type(c) != type) return false;
  const auto faces = Faces(c);
  std::array<FaceId, kMaxElementFaces> theirs, ours;
  for (size_t i = 0; i < faces.size(); ++i) {
    theirs[i] = faces[i].face();
    ours[i] = parts.faces[i].face;
  }
  std::sort(theirs.begin(), theirs.begin() + faces.size());
  std::sort(ours.begin(), ours.begin() + faces.size());
  return std::equal(theirs.begin(), theirs.begin() + faces.size(), ours.begin());
}

CellId Mesh::FindCell(ElementType type, const CellParts& parts) const {
  return FindCellButNot(CellId(), type, parts);
}

CellId Mesh::FindCellButNot(CellId c, ElementType type, const CellParts& parts) const {
  const auto uses = [this](const FaceMatch& match) {
    return match.face.valid() ? NumFaceCells(match.face) : 0;
  };
  const auto least_used =
      std::min_element(parts.faces.begin(), parts.faces.begin() + TemplateOf(type).num_faces,
                       [&](const FaceMatch& a, const FaceMatch& b) { return uses(a) < uses(b); });
  if (!least_used->face.valid()) return CellId();
  for (CellId other : IncidentCells(least_used->face)) {
    if (other != c && HasFaces(other, type, parts)) return other;
  }
  return CellId();
}

CellId Mesh::FindTwin(CellId c) const {
  const auto faces = Faces(c);
  // Nearly always two faces have no other cell in common, and then there is none for all.
  const auto& first = face_cells_[faces[0].face().slot()];
  const auto& second = face_cells_[faces[1].face().slot()];
  const auto other = [c](const auto& uses) { return uses[0] == c ? uses[1] : uses[0]; };
  const bool inline_uses = first[1] != kOverflow && second[1] != kOverflow;
  if (inline_uses && (!other(first).valid() || other(first) != other(second))) return CellId();
  CellParts parts;
  for (size_t i = 0; i < faces.size(); ++i) parts.faces[i] = {faces[i].face(), faces[i].code()};
  return FindCellButNot(c, Type(c), parts);
}

// ---- Creation ----

EdgeId Mesh::EnsureEdge(VertexId a, VertexId b) {
  const EdgeId e = FindEdge(a, b);
  return e.valid() ? e : CreateEdge(a, b, 0);
}

absl::StatusOr<EntityId> Mesh::AddWireEdge(VertexSpan vertices) {
  const EdgeId existing = FindEdge(vertices[0], vertices[1]);
  if (!existing.valid()) return CreateEdge(vertices[0], vertices[1], kElementFlag);
  if (!IsElement(existing)) {
    if (Vertices(existing)[0] != vertices[0]) FlipEdge(existing);
    SetElementFlag(existing);
    return existing;
  }
  if (options_.duplicates == DuplicatePolicy::kRefuse) return RefuseDuplicate(existing);
  return CreateEdge(vertices[0], vertices[1], kElementFlag | kDuplicateFlag);
}

absl::StatusOr<EntityId> Mesh::AddFaceElement(VertexSpan vertices) {
  const size_t n = vertices.size();
  FaceEdges edges;
  for (size_t k = 0; k < n; ++k) edges[k] = FindEdge(vertices[k], vertices[(k + 1) % n]);
  const auto edge_span = absl::MakeConstSpan(edges.data(), n);
  const bool all_exist = std::all_of(edge_span.begin(), edge_span.end(), [](EdgeId e) { return e.valid(); });
  const FaceMatch match = all_exist ? FindFaceAround(LeastUsed(edge_span), vertices) : FaceMatch();
  return AddFaceElement(vertices, edges, match);
}

absl::StatusOr<EntityId> Mesh::AddFaceElement(VertexSpan vertices, FaceEdges& edges, const FaceMatch& match) {
  const size_t n = vertices.size();
  const bool cheap =
      match.code.value == 0 || (match.face.valid() && NumFaceCells(match.face) <= kMaxReorderedCells);
  if (match.face.valid() && !IsElement(match.face) && cheap) {
    ReorderFace(match.face, match.code);
    SetElementFlag(match.face);
    return match.face;
  }
  const bool equals_element = match.face.valid() && IsElement(match.face);
  if (equals_element && options_.duplicates == DuplicatePolicy::kRefuse) return RefuseDuplicate(match.face);
  const bool look_again = HasRepeats(vertices);  // two of its edges may be the same
  for (size_t k = 0; k < n; ++k) {
    const VertexId a = vertices[k], b = vertices[(k + 1) % n];
    if (!edges[k].valid()) edges[k] = look_again ? EnsureEdge(a, b) : CreateEdge(a, b, 0);
  }
  WidenFaces(n);
  return CreateFace(vertices, absl::MakeConstSpan(edges.data(), n),
                    kElementFlag | (match.face.valid() ? kDuplicateFlag : 0));
}

absl::StatusOr<EntityId> Mesh::AddCell(ElementType type, VertexSpan vertices, const SmartEdges& known) {
  CellParts parts;
  FindCellParts(TemplateOf(type), vertices, known, parts);
  return AddCell(type, vertices, parts);
}

absl::StatusOr<EntityId> Mesh::AddCell(ElementType type, VertexSpan vertices, CellParts& parts) {
  const ElementTemplate& shape = TemplateOf(type);
  if (options_.duplicates == DuplicatePolicy::kRefuse) {
    if (const CellId twin = FindCell(type, parts); twin.valid()) return RefuseDuplicate(twin);
  }
  EnsureCellParts(shape, vertices, parts);
  std::array<OrientedFace, kMaxElementFaces> faces;
  for (int i = 0; i < shape.num_faces; ++i) faces[i] = OrientedFace(parts.faces[i].face, parts.faces[i].code);
  WidenCells(shape.num_vertices, shape.num_faces);
  return CreateCell(type, vertices, absl::MakeConstSpan(faces.data(), shape.num_faces));
}

void Mesh::EnsureCellParts(const ElementTemplate& shape, VertexSpan vertices, CellParts& parts) {
  const bool degenerate = HasRepeats(vertices);
  const bool look_again = degenerate || !parts.all_looked_for;
  for (int e = 0; e < shape.num_edges; ++e) {
    if (parts.edges[e].valid()) continue;
    const VertexId a = vertices[shape.edges[e].vertices[0]], b = vertices[shape.edges[e].vertices[1]];
    parts.edges[e] = look_again ? EnsureEdge(a, b) : CreateEdge(a, b, 0);
  }
  for (int i = 0; i < shape.num_faces; ++i) {
    if (parts.faces[i].face.valid()) continue;
    const FaceVertices face(shape.faces[i], vertices);
    std::array<EdgeId, kMaxFaceVertices> edges;
    for (int k = 0; k < face.size; ++k) edges[k] = parts.edges[shape.faces[i].edges[k]];
    const auto edge_span = absl::MakeConstSpan(edges.data(), face.size);
    // Two faces of a degenerate cell may be the same: look again among those just made.
    if (degenerate) parts.faces[i] = FindFaceAround(LeastUsed(edge_span), face.span());
    if (parts.faces[i].face.valid()) continue;
    WidenFaces(face.size);
    parts.faces[i] = {CreateFace(face.span(), edge_span, 0), FaceCode()};
  }
}

// ---- Removal ----

absl::Status Mesh::RemoveElement(EntityId id) {
  DYNMESH_RETURN_IF_ERROR(CheckRemovable(id));
  RemoveAll(id.kind, {&id.slot, 1});
  return absl::OkStatus();
}

absl::Status Mesh::CheckRemovable(EntityId id) const {
  if (id.kind == EntityKind::kVertex) {
    return InvalidArgument(reason::kBadEntityKind, "vertices are not elements");
  }
  DYNMESH_RETURN_IF_ERROR(CheckLive(id));
  if (!IsElement(id)) {
    return FailedPrecondition(
        reason::kNotAnElement,
        absl::StrCat(EntityKindName(id.kind), " ", id.slot, " is derived: remove the elements that use it"),
        {{"kind", std::string(EntityKindName(id.kind))}, {"ids", absl::StrCat(id.slot)}});
  }
  return absl::OkStatus();
}

}  // namespace dynmesh
