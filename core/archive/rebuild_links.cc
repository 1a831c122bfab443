// Upward lists, boundary, hubs and counts of a mesh whose slots have been put: by counting, not one by one.

#include <algorithm>
#include <new>

#include "core/archive/part.h"
#include "core/archive/rebuilder.h"
#include "core/mesh/pipeline.h"

namespace dynmesh {
namespace {

/// How many faces or cells ahead their parts are asked for: far enough for memory, near enough for the cache.
constexpr Slot kAhead = 16;

/// Of a list of incident entities.
constexpr uint32_t kMaxLength = IncidenceLists<EdgeId>::kMaxLength;

/// Whether lists may be so long.
bool HaveRoom(const std::vector<uint32_t>& lengths) {
  return lengths.empty() || *std::max_element(lengths.begin(), lengths.end()) <= kMaxLength;
}

}  // namespace

absl::StatusOr<Mesh> Rebuilder::Finish() && {
  const absl::Status completed = [this]() -> absl::Status {
    try {
      return Complete();
    } catch (const std::bad_alloc&) {
      return MakeError(absl::StatusCode::kResourceExhausted, reason::kLimitExceeded, "memory ran out",
                       {{"limit", "memory"}});
    }
  }();
  if (!completed.ok()) return completed;
  return std::move(mesh_);
}

absl::Status Rebuilder::Complete() {
  if (newest_page_ > revision()) {
    return ArchiveDamaged("a page of an archive is of a later revision than its last record");
  }
  for (EntityKind kind : kEntityKinds) {
    DYNMESH_RETURN_IF_ERROR(CheckSlots(kind));
    mesh_.mutable_slots(kind).FreeDead();
  }
  for (const AttributeColumn& column : mesh_.attributes_) DYNMESH_RETURN_IF_ERROR(CheckColumn(column));
  DYNMESH_RETURN_IF_ERROR(LinkEdges());
  DYNMESH_RETURN_IF_ERROR(LinkFaces());
  DYNMESH_RETURN_IF_ERROR(LinkCells());
  DYNMESH_RETURN_IF_ERROR(CheckUses());
  DYNMESH_RETURN_IF_ERROR(CheckPrimaryEdges());
  DYNMESH_RETURN_IF_ERROR(CheckPrimaryFaces());
  MarkBoundary();
  IndexHubs();
  for (EntityKind kind : {EntityKind::kEdge, EntityKind::kFace}) {
    DYNMESH_RETURN_IF_ERROR(IndexDuplicates(kind));
  }
  CountElements();
  return CheckFit();
}

// ---- Lists ----

absl::Status Rebuilder::LinkEdges() {
  const Slot num_edges = Limit(EntityKind::kEdge);
  std::vector<uint32_t> degrees(Limit(EntityKind::kVertex));
  for (EdgeId e(0); e.slot() < num_edges; e = EdgeId(e.slot() + 1)) {
    if (!Lives(e)) continue;
    for (VertexId v : mesh_.Vertices(e)) {
      if (!mesh_.IsLive(v)) return EntityDamaged(e, "ends at a vertex that is not there");
      ++degrees[v.slot()];
    }
    if (HasRepeats(mesh_.Vertices(e))) mesh_.flags(e) |= Mesh::kDegenerateFlag;
  }
  if (!HaveRoom(degrees) || 2 * uint64_t{num_edges} >= IncidenceLists<EdgeId>::kMaxEntries) {
    return LimitExceeded("max_incident_entities", kMaxLength, uint64_t{kMaxLength} + 1);
  }
  mesh_.vertex_edges_.Layout(degrees);
  for (Slot e = 0; e < num_edges; ++e) {
    if (!Lives(EdgeId(e))) continue;
    for (VertexId v : mesh_.edge_vertices_[e]) mesh_.vertex_edges_.Append(v.slot(), EdgeId(e));
  }
  mesh_.vertex_edges_.IndexLongLists();
  return absl::OkStatus();
}

absl::Status Rebuilder::LinkFaces() {
  const Slot num_faces = Limit(EntityKind::kFace);
  std::vector<uint32_t> lengths(Limit(EntityKind::kEdge));
  for (Slot f = 0; f < num_faces; ++f) {
    if (f + kAhead < num_faces) PrefetchEdges(FaceId(f + kAhead), lengths);
    if (Lives(FaceId(f))) DYNMESH_RETURN_IF_ERROR(LinkFace(FaceId(f), lengths));
  }
  if (!HaveRoom(lengths)) return LimitExceeded("max_incident_entities", kMaxLength, uint64_t{kMaxLength} + 1);
  mesh_.edge_faces_.Layout(lengths);
  for (Slot f = 0; f < num_faces; ++f) {
    if (f + kAhead < num_faces && Lives(FaceId(f + kAhead))) {
      for (EdgeId e : mesh_.Edges(FaceId(f + kAhead))) mesh_.edge_faces_.PrefetchList(e.slot());
    }
    if (!Lives(FaceId(f))) continue;
    for (EdgeId e : mesh_.Edges(FaceId(f))) mesh_.edge_faces_.Append(e.slot(), FaceId(f));
  }
  mesh_.edge_faces_.IndexLongLists();
  return absl::OkStatus();
}

void Rebuilder::PrefetchEdges(FaceId f, const std::vector<uint32_t>& lengths) const {
  if (!Lives(f)) return;
  for (EdgeId e : mesh_.Edges(f)) {
    if (e.slot() >= lengths.size()) continue;
    Prefetch(&mesh_.edge_vertices_[e.slot()]);
    Prefetch(&lengths[e.slot()]);
  }
}

// Edges that join its vertices are live ones, and so are these.
absl::Status Rebuilder::LinkFace(FaceId f, std::vector<uint32_t>& lengths) {
  const auto vertices = mesh_.Vertices(f);
  const auto edges = mesh_.Edges(f);
  for (size_t k = 0; k < edges.size(); ++k) {
    const VertexId from = vertices[k], to = vertices[k + 1 == vertices.size() ? 0 : k + 1];
    const Slot e = edges[k].slot();
    if (e >= lengths.size()) return EntityDamaged(f, "has an edge that is not there");
    const auto& ends = mesh_.edge_vertices_[e];
    const bool joins = (ends[0] == from && ends[1] == to) || (ends[0] == to && ends[1] == from);
    if (!joins) return EntityDamaged(f, "has an edge that does not join its vertices");
    if (mesh_.IsDuplicate(EdgeId(e))) return EntityDamaged(f, "has an edge that is a duplicate");
    ++lengths[e];
  }
  if (HasRepeats(vertices)) mesh_.flags(f) |= Mesh::kDegenerateFlag;
  return absl::OkStatus();
}

absl::Status Rebuilder::LinkCells() {
  const Slot num_cells = Limit(EntityKind::kCell);
  for (Slot c = 0; c < num_cells; ++c) {
    if (c + kAhead < num_cells) PrefetchFaces(CellId(c + kAhead));
    if (Lives(CellId(c))) DYNMESH_RETURN_IF_ERROR(LinkCell(CellId(c)));
  }
  return absl::OkStatus();
}

void Rebuilder::PrefetchFaces(CellId c) const {
  if (!Lives(c)) return;
  for (OrientedFace oriented : mesh_.Faces(c)) {
    const Slot f = oriented.face().slot();
    if (f >= Limit(EntityKind::kFace)) continue;
    Prefetch(&mesh_.face_vertices_[size_t{f} * mesh_.face_stride_]);
    Prefetch(&mesh_.face_cells_[f]);
  }
}

absl::Status Rebuilder::LinkCell(CellId c) {
  const ElementTemplate& shape = TemplateOf(mesh_.Type(c));
  const auto vertices = mesh_.Vertices(c);
  const Slot num_faces = Limit(EntityKind::kFace);
  OrientedFace* faces = &mesh_.cell_faces_[size_t{c.slot()} * mesh_.cell_face_stride_];
  for (int i = 0; i < shape.num_faces; ++i) {
    const FaceId f = faces[i].face();
    if (f.slot() >= num_faces) return EntityDamaged(c, "has a face that is not there");
    const auto code = MatchFace(mesh_.Vertices(f), FaceVertices(shape.faces[i], vertices).span());
    if (!code.has_value()) return EntityDamaged(c, "has a face that is not of its vertices");
    if (mesh_.IsDuplicate(f)) return EntityDamaged(c, "has a face that is a duplicate");
    if (!mesh_.face_overflow_.HasRoom(1)) {
      return LimitExceeded("max_incident_entities", kMaxLength, uint64_t{kMaxLength} + 1);
    }
    faces[i] = OrientedFace(f, *code);
    mesh_.AddFaceCell(f, c);
  }
  if (HasRepeats(vertices)) mesh_.flags(c) |= Mesh::kDegenerateFlag;
  return absl::OkStatus();
}

// ---- What follows from the lists ----

void Rebuilder::MarkBoundary() {
  const Slot num_faces = Limit(EntityKind::kFace), num_edges = Limit(EntityKind::kEdge);
  for (Slot f = 0; f < num_faces; ++f) {
    const auto& uses = mesh_.face_cells_[f];
    if (uses[0].valid() && !uses[1].valid()) mesh_.SetFaceOnBoundary(FaceId(f), +1);
  }
  for (Slot e = 0; e < num_edges; ++e) {
    if (mesh_.edge_faces_.Length(e) == 1) mesh_.CountBoundary(EdgeId(e), +1);
  }
}

void Rebuilder::IndexHubs() {
  const Slot num_vertices = Limit(EntityKind::kVertex), num_edges = Limit(EntityKind::kEdge);
  for (Slot v = 0; v < num_vertices; ++v) {
    if (mesh_.vertex_edges_.Length(v) > Mesh::kHubDegree) mesh_.IndexHubEdges(VertexId(v));
  }
  for (Slot e = 0; e < num_edges; ++e) {
    if (mesh_.edge_faces_.Length(e) > Mesh::kHubDegree) mesh_.IndexHubFaces(EdgeId(e));
  }
}

void Rebuilder::CountElements() {
  Checksum& sum = mesh_.checksum_;
  mesh_.slots(EntityKind::kVertex).live().ForEach([&](Slot v) {
    sum.topology += Checksum::VertexTerm(v);
    sum.geometry += Checksum::PositionTerm(v, mesh_.positions_[v]);
  });
  for (EntityKind kind : {EntityKind::kEdge, EntityKind::kFace, EntityKind::kCell}) {
    const Slot limit = Limit(kind);
    for (EntityId id(kind, 0); id.slot < limit; ++id.slot) {
      if (!Lives(id) || !mesh_.IsElement(id)) continue;
      ++mesh_.num_elements_[Dimension(kind)];
      mesh_.num_degenerate_ += mesh_.IsDegenerate(id);
      sum.topology += mesh_.ElementTerm(id);
    }
  }
}

}  // namespace dynmesh
