#include "core/mesh/bulk_build.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/mesh/vector.h"

namespace dynmesh {
namespace {

/// Passes over the elements that Tick() is told of, for the total.
constexpr uint64_t kPasses = 3;
/// Input is scattered if fewer of its neighbours in order share a vertex.
constexpr double kCoherentShare = 0.5;
constexpr Slot kFewCells = 50'000;  ///< everything about so many stays in the cache

/// rows[k] = old rows[order[k]], for rows of `stride` items.
template <typename T>
void Permute(const Permutation& order, size_t stride, std::vector<T>& rows) {
  std::vector<T> sorted(rows.size());
  for (size_t k = 0; k < order.size(); ++k) {
    std::copy_n(&rows[order[k] * stride], stride, &sorted[k * stride]);
  }
  rows = std::move(sorted);
}

bool ShareVertex(absl::Span<const VertexId> a, absl::Span<const VertexId> b) {
  return std::find_first_of(a.begin(), a.end(), b.begin(), b.end()) != a.end();
}

}  // namespace

// ---- Input ----

absl::Status BulkBuilder::AddVertices(absl::Span<const Point> positions) {
  const auto bad = std::find_if_not(positions.begin(), positions.end(), IsFinite);
  if (bad != positions.end()) {
    return InvalidArgument(reason::kNonFinite, "a coordinate is NaN or infinite",
                           {{"position", absl::StrCat(counts_[0] + (bad - positions.begin()))}});
  }
  const uint64_t count = counts_[0] + positions.size();
  const uint32_t limit = options_.mesh.limits.max_slots[0];
  if (count > limit) return LimitExceeded("max_vertices", limit, count);
  mesh_.positions_.insert(mesh_.positions_.end(), positions.begin(), positions.end());
  counts_[0] = count;
  return absl::OkStatus();
}

absl::Status BulkBuilder::AddElements(ElementType type, absl::Span<const VertexId> vertices) {
  if (!IsElementType(static_cast<int>(type))) {
    return InvalidArgument(reason::kBadElementType,
                           absl::StrCat("element type ", static_cast<int>(type), " is none of 1-7"));
  }
  const size_t size = NumVertices(type);
  if (vertices.size() % size != 0) {
    return InvalidArgument(
        reason::kBadArrayLength,
        absl::StrCat(vertices.size(), " ids are no whole number of ", ElementTypeName(type), "s"));
  }
  for (VertexId v : vertices) {
    if (v.slot() >= counts_[0]) return EntityNotFound(reason::kUnknownEntity, v);
  }
  constexpr absl::string_view kLimitNames[] = {"max_vertices", "max_edges", "max_faces", "max_cells"};
  const int kind = Dimension(KindOf(type));
  const uint64_t count = counts_[kind] + vertices.size() / size;
  const uint32_t limit = options_.mesh.limits.max_slots[kind];
  if (count > limit) return LimitExceeded(kLimitNames[kind], limit, count);
  if (kind == 2) mesh_.WidenFaces(size);
  if (kind == 3) mesh_.WidenCells(size, TemplateOf(type).num_faces);
  for (size_t begin = 0; begin < vertices.size(); begin += size) AppendElement(type, &vertices[begin]);
  counts_[kind] = count;
  return absl::OkStatus();
}

void BulkBuilder::AppendElement(ElementType type, const VertexId* vertices) {
  const EntityKind kind = KindOf(type);
  const bool degenerate = HasRepeats(absl::MakeConstSpan(vertices, NumVertices(type)));
  mesh_.flags_[Dimension(kind)].push_back(static_cast<uint8_t>(type) | Mesh::kElementFlag |
                                          (degenerate ? Mesh::kDegenerateFlag : 0));
  mesh_.num_degenerate_ += degenerate;
  if (kind == EntityKind::kEdge) {
    mesh_.edge_vertices_.push_back({vertices[0], vertices[1]});
    return;
  }
  const bool cell = kind == EntityKind::kCell;
  auto& rows = cell ? mesh_.cell_vertices_ : mesh_.face_vertices_;
  const size_t stride = cell ? mesh_.cell_vertex_stride_ : mesh_.face_stride_;
  rows.insert(rows.end(), vertices, vertices + NumVertices(type));
  rows.resize((rows.size() + stride - 1) / stride * stride);
}

// ---- The build ----

absl::StatusOr<BulkResult> BulkBuilder::Finish() && {
  total_ = counts_[0] + kPasses * counts_[3];
  const uint64_t uses = counts_[2] + uint64_t{counts_[3]} * mesh_.cell_face_stride_;
  if (uses >= kNoSlot) return LimitExceeded("max_face_uses", kNoSlot - 1, uses);
  if (std::any_of(mesh_.flags_[3].begin(), mesh_.flags_[3].end(), [](uint8_t flags) {
        return (flags & Mesh::kTypeMask) != static_cast<uint8_t>(ElementType::kTetrahedron);
      })) {
    mesh_.WidenFaces(kMaxFaceVertices);  // every other cell has a quad
  }
  mesh_.cell_faces_.resize(size_t{counts_[3]} * mesh_.cell_face_stride_);
  options_.order == SlotOrder::kHilbert ? SortItems() : ChooseWalk();
  DYNMESH_RETURN_IF_ERROR(Tick(counts_[0]));
  DYNMESH_RETURN_IF_ERROR(MatchFaces());
  DYNMESH_RETURN_IF_ERROR(ScanFaces());
  MatchEdges();
  DYNMESH_RETURN_IF_ERROR(CheckRoom());
  CountElements();
  FillEdgeFaces();
  FillVertexEdges();
  MarkBoundary();
  IndexHubs();
  DYNMESH_RETURN_IF_ERROR(Tick(counts_[3]));
  DYNMESH_RETURN_IF_ERROR(ReportElements());
  result_.mesh = std::move(mesh_);
  return std::move(result_);
}

absl::Status BulkBuilder::Tick(uint64_t items) {
  done_ += items;
  return options_.progress ? options_.progress(done_, total_) : absl::OkStatus();
}

absl::Status BulkBuilder::CheckRoom() const {
  const uint64_t num_edges = mesh_.edge_vertices_.size();
  const uint32_t limit = options_.mesh.limits.max_slots[1];
  if (num_edges > limit) return LimitExceeded("max_edges", limit, num_edges);
  const uint64_t entries = std::max<uint64_t>(2 * num_edges, mesh_.face_edges_.size());
  if (entries >= IncidenceLists<EdgeId>::kMaxEntries) {
    return LimitExceeded("max_incident_entities", IncidenceLists<EdgeId>::kMaxEntries, entries);
  }
  return absl::OkStatus();
}

// ---- Order ----

void BulkBuilder::SortItems() {
  result_.slots[0] = Inverse(HilbertOrder(mesh_.positions_));
  const Permutation& ranks = result_.slots[0];
  Permute(Inverse(ranks), 1, mesh_.positions_);
  SortElements(EntityKind::kEdge, ranks);
  SortElements(EntityKind::kFace, ranks);
  SortElements(EntityKind::kCell, ranks);
}

void BulkBuilder::SortElements(EntityKind kind, const Permutation& ranks) {
  const Slot count = NumElements(kind);
  std::vector<uint32_t> keys(count, kNoSlot);
  const auto renumber = [&](auto& rows, size_t stride) {
    for (Slot slot = 0; slot < count; ++slot) {
      for (size_t k = 0; k < stride; ++k) {
        VertexId& v = rows[slot * stride + k];
        if (!v.valid()) continue;  // the padding of a narrow row
        v = VertexId(ranks[v.slot()]);
        keys[slot] = std::min(keys[slot], v.slot());
      }
    }
    const Permutation order = CountingOrder(keys, NumElements(EntityKind::kVertex));
    Permute(order, stride, rows);
    Permute(order, 1, mesh_.flags_[Dimension(kind)]);
    result_.slots[Dimension(kind)] = Inverse(order);
  };
  if (kind == EntityKind::kCell) {
    renumber(mesh_.cell_vertices_, mesh_.cell_vertex_stride_);
  } else if (kind == EntityKind::kFace) {
    renumber(mesh_.face_vertices_, mesh_.face_stride_);
  } else {
    std::vector<VertexId> rows;
    for (const auto& ends : mesh_.edge_vertices_) rows.insert(rows.end(), ends.begin(), ends.end());
    renumber(rows, 2);
    for (Slot e = 0; e < count; ++e) mesh_.edge_vertices_[e] = {rows[2 * e], rows[2 * e + 1]};
  }
}

void BulkBuilder::ChooseWalk() {
  const Slot num_cells = NumElements(EntityKind::kCell);
  if (num_cells < kFewCells) return;
  Slot sharing = 0;
  for (Slot c = 1; c < num_cells; ++c) {
    sharing += ShareVertex(mesh_.Vertices(CellId(c - 1)), mesh_.Vertices(CellId(c)));
  }
  if (sharing > kCoherentShare * num_cells) return;
  const Permutation ranks = Inverse(HilbertOrder(mesh_.positions_));
  std::vector<uint32_t> keys(num_cells, kNoSlot);
  for (Slot c = 0; c < num_cells; ++c) {
    for (VertexId v : mesh_.Vertices(CellId(c))) keys[c] = std::min(keys[c], ranks[v.slot()]);
  }
  walk_ = CountingOrder(keys, NumElements(EntityKind::kVertex));
}

// ---- What follows from faces and edges ----

void BulkBuilder::FillEdgeFaces() {
  mesh_.edge_faces_.Layout(num_edge_faces_);
  const Slot num_faces = mesh_.face_cells_.size();
  for (Slot f = 0; f < num_faces; ++f) {
    for (EdgeId e : mesh_.Edges(FaceId(f))) mesh_.edge_faces_.Append(e.slot(), FaceId(f));
  }
  mesh_.edge_faces_.IndexLongLists();
}

void BulkBuilder::FillVertexEdges() {
  std::vector<uint32_t> degrees(NumElements(EntityKind::kVertex));
  for (const auto& ends : mesh_.edge_vertices_) {
    for (VertexId v : ends) ++degrees[v.slot()];
  }
  mesh_.vertex_edges_.Layout(degrees);
  const Slot num_edges = mesh_.edge_vertices_.size();
  for (Slot e = 0; e < num_edges; ++e) {
    for (VertexId v : mesh_.edge_vertices_[e]) mesh_.vertex_edges_.Append(v.slot(), EdgeId(e));
  }
  mesh_.vertex_edges_.IndexLongLists();
}

void BulkBuilder::MarkBoundary() {
  mesh_.boundary_uses_[0].resize(NumElements(EntityKind::kVertex));
  mesh_.boundary_uses_[1].resize(mesh_.edge_vertices_.size());
  const Slot num_faces = mesh_.face_cells_.size(), num_edges = mesh_.edge_vertices_.size();
  for (Slot f = 0; f < num_faces; ++f) {
    const auto& uses = mesh_.face_cells_[f];
    if (uses[0].valid() && !uses[1].valid()) mesh_.SetFaceOnBoundary(FaceId(f), +1);
  }
  for (Slot e = 0; e < num_edges; ++e) {
    if (num_edge_faces_[e] == 1) mesh_.CountBoundary(EdgeId(e), +1);
  }
}

void BulkBuilder::IndexHubs() {
  const Slot num_vertices = NumElements(EntityKind::kVertex), num_edges = mesh_.edge_vertices_.size();
  for (Slot v = 0; v < num_vertices; ++v) {
    if (mesh_.vertex_edges_.Length(v) > Mesh::kHubDegree) mesh_.IndexHubEdges(VertexId(v));
  }
  for (Slot e = 0; e < num_edges; ++e) {
    if (num_edge_faces_[e] > Mesh::kHubDegree) mesh_.IndexHubFaces(EdgeId(e));
  }
}

void BulkBuilder::CountElements() {
  mesh_.flags_[1].resize(mesh_.edge_vertices_.size(), static_cast<uint8_t>(ElementType::kWireEdge));
  for (Slot e = counts_[1]; e < mesh_.edge_vertices_.size(); ++e) {
    if (mesh_.edge_vertices_[e][0] == mesh_.edge_vertices_[e][1]) mesh_.flags_[1][e] |= Mesh::kDegenerateFlag;
  }
  const size_t counts[] = {counts_[0], mesh_.edge_vertices_.size(), mesh_.face_cells_.size(), counts_[3]};
  for (EntityKind kind : kEntityKinds) {
    const int k = Dimension(kind);
    mesh_.slots_[k].AllocateFirst(counts[k], mesh_.next_stamp());
    mesh_.changed_[k].TouchFirst(counts_[k], mesh_.next_stamp());
    if (kind != EntityKind::kVertex) mesh_.num_elements_[k] = counts_[k];
  }
  for (Slot f = 0; f < counts_[2]; ++f) {
    if (uses_[f] != f) mesh_.flags_[2][f] |= Mesh::kDuplicateFlag;
  }
  uses_ = {};
  Checksum& sum = mesh_.checksum_;
  for (Slot v = 0; v < counts_[0]; ++v) {
    sum.topology += Checksum::VertexTerm(v);
    sum.geometry += Checksum::PositionTerm(v, mesh_.positions_[v]);
  }
  for (EntityKind kind : {EntityKind::kEdge, EntityKind::kFace, EntityKind::kCell}) {
    for (Slot slot = 0; slot < NumElements(kind); ++slot) sum.topology += mesh_.ElementTerm({kind, slot});
  }
}

// ---- What deserves a look ----

absl::Status BulkBuilder::ReportElements() {
  for (EntityKind kind : {EntityKind::kEdge, EntityKind::kFace, EntityKind::kCell}) {
    for (Slot slot = 0; slot < NumElements(kind); ++slot) {
      const EntityId id(kind, slot);
      if (mesh_.IsDegenerate(id)) result_.degenerate.push_back(id);
      const bool duplicate = mesh_.IsDuplicate(id);
      if (duplicate) mesh_.CountDuplicate(id, +1);
      if (!duplicate && !(kind == EntityKind::kCell && HasLowerTwin(CellId(slot)))) continue;
      if (options_.mesh.duplicates == DuplicatePolicy::kRefuse) return RefuseDuplicate(id);
      result_.duplicate.push_back(id);
    }
  }
  return absl::OkStatus();
}

bool BulkBuilder::HasLowerTwin(CellId c) const {
  const CellId twin = mesh_.FindTwin(c);
  return twin.valid() && twin < c;
}

// The later of the two as they were put in is the duplicate, whatever slots they got.
absl::Status BulkBuilder::RefuseDuplicate(EntityId id) const {
  EntityId twin(id.kind, kNoSlot);
  if (id.kind == EntityKind::kCell) twin = mesh_.FindTwin(CellId(id.slot));
  if (id.kind == EntityKind::kFace) twin = mesh_.FindFace(mesh_.VerticesOf(id));
  if (id.kind == EntityKind::kEdge) twin = mesh_.FindEdge(mesh_.VerticesOf(id)[0], mesh_.VerticesOf(id)[1]);
  const Slot place = PlaceOf(id), place_of_twin = PlaceOf(twin);
  return WithMetadata(mesh_.RefuseDuplicate({id.kind, std::min(place, place_of_twin)}), "position",
                      absl::StrCat(std::max(place, place_of_twin)));
}

Slot BulkBuilder::PlaceOf(EntityId element) const {
  const Permutation& slots = result_.slots[Dimension(element.kind)];
  if (slots.empty()) return element.slot;
  return std::find(slots.begin(), slots.end(), element.slot) - slots.begin();
}

}  // namespace dynmesh
