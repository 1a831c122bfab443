// Rows of the arrays: growing, widening, counting bytes.

#include <algorithm>
#include <numeric>

#include "absl/strings/str_cat.h"
#include "core/mesh/mesh.h"

namespace dynmesh {
namespace {

template <typename T>
void GrowTo(std::vector<T>& rows, size_t size) {
  if (rows.size() < size) rows.resize(size);
}

/// Spreads rows of `old_stride` to rows of `new_stride`.
template <typename T>
void Restride(std::vector<T>& rows, int old_stride, int new_stride) {
  const size_t num_rows = rows.size() / old_stride;
  std::vector<T> wide(num_rows * new_stride);
  for (size_t row = 0; row < num_rows; ++row) {
    std::copy_n(&rows[row * old_stride], old_stride, &wide[row * new_stride]);
  }
  rows = std::move(wide);
}

template <typename T>
size_t Bytes(const std::vector<T>& rows) {
  return rows.size() * sizeof(T);
}

}  // namespace

Slot Mesh::NewSlot(EntityKind kind, JournalEntry& entry) {
  if (journaling()) journal_.Expect(1);
  const auto [slot, born_before, at_end] = mutable_slots(kind).Allocate(next_stamp());
  entry = {JournalOp::kCreate, kind, slot, born_before, changed(kind).At(slot)};
  if (at_end) EnsureRow(kind, slot);
  if (stored_.any()) stored_.Begin({kind, slot});
  return slot;
}

void Mesh::RetakeSlot(EntityId id, JournalEntry& entry) {
  if (journaling()) journal_.Expect(2);
  Slots& slots = mutable_slots(id.kind);
  if (!slots.IsFree(id.slot)) {
    SaveContent(id);
    Record({JournalOp::kRecycle, id.kind, id.slot, 0, 0});
    slots.Recycle(id.slot);
  }
  const Slots::Allocation taken = slots.AllocateAt(id.slot, next_stamp());
  entry = {JournalOp::kCreate, id.kind, id.slot, taken.born_before, changed(id.kind).At(id.slot)};
  if (stored_.any()) stored_.Begin(id);
}

void Mesh::SaveContent(EntityId id) {
  if (id.kind == EntityKind::kVertex) return journal_.positions.push_back(Position(VertexId(id.slot)));
  SlotContent& content = journal_.contents.emplace_back();
  content.type = Type(id);
  content.flags = flags(id);
  const auto vertices = VerticesOf(id);
  std::copy(vertices.begin(), vertices.end(), content.vertices.begin());
  if (id.kind == EntityKind::kFace) {
    const auto edges = Edges(FaceId(id.slot));
    std::transform(edges.begin(), edges.end(), content.parts.begin(), [](EdgeId e) { return e.slot(); });
  } else if (id.kind == EntityKind::kCell) {
    const auto faces = Faces(CellId(id.slot));
    std::transform(faces.begin(), faces.end(), content.parts.begin(),
                   [](OrientedFace oriented) { return oriented.packed(); });
  }
}

void Mesh::EnsureRow(EntityKind kind, Slot slot) {
  constexpr size_t kRowsAtOnce = 64;
  const size_t dimension = Dimension(kind);
  if (slot < (kind == EntityKind::kVertex ? positions_.size() : flags_[dimension].size())) return;
  const size_t rows = slot / kRowsAtOnce * kRowsAtOnce + kRowsAtOnce;
  switch (kind) {
    case EntityKind::kVertex:
      GrowTo(boundary_uses_[0], rows);
      GrowTo(positions_, rows);
      return;
    case EntityKind::kEdge:
      GrowTo(edge_vertices_, rows);
      GrowTo(boundary_uses_[1], rows);
      break;
    case EntityKind::kFace:
      GrowTo(face_vertices_, rows * face_stride_);
      GrowTo(face_edges_, rows * face_stride_);
      GrowTo(face_cells_, rows);
      break;
    case EntityKind::kCell:
      GrowTo(cell_vertices_, rows * cell_vertex_stride_);
      GrowTo(cell_faces_, rows * cell_face_stride_);
      break;
  }
  GrowTo(flags_[dimension], rows);  // last: it says that there is room, and any of them may run out of memory
}

void Mesh::WidenFaces(int stride) {
  if (stride <= face_stride_) return;
  Restride(face_vertices_, face_stride_, stride);
  Restride(face_edges_, face_stride_, stride);
  face_stride_ = stride;
}

void Mesh::WidenCells(int vertex_stride, int face_stride) {
  if (vertex_stride > cell_vertex_stride_) {
    Restride(cell_vertices_, cell_vertex_stride_, vertex_stride);
    cell_vertex_stride_ = vertex_stride;
  }
  if (face_stride > cell_face_stride_) {
    Restride(cell_faces_, cell_face_stride_, face_stride);
    cell_face_stride_ = face_stride;
  }
}

void Mesh::Reserve(const std::array<uint64_t, kNumEntityKinds>& counts) {
  const auto [vertices, edges, faces, cells] = counts;
  for (int kind = 0; kind < kNumEntityKinds; ++kind) {
    slots_[kind].Reserve(counts[kind]);
    if (kind != 0) flags_[kind].reserve(counts[kind]);
  }
  positions_.reserve(vertices);
  changed_[0].Reserve(vertices);
  changed_[3].Reserve(cells);
  boundary_uses_[0].reserve(vertices);
  boundary_uses_[1].reserve(edges);
  edge_vertices_.reserve(edges);
  face_vertices_.reserve(faces * face_stride_);
  face_edges_.reserve(faces * face_stride_);
  face_cells_.reserve(faces);
  cell_vertices_.reserve(cells * cell_vertex_stride_);
  cell_faces_.reserve(cells * cell_face_stride_);
  vertex_edges_.Reserve(vertices, 0);
  edge_faces_.Reserve(edges, 0);
}

std::vector<std::pair<std::string, size_t>> Mesh::MemoryByArray() const {
  std::vector<std::pair<std::string, size_t>> arrays = {
      {"position", Bytes(positions_)},
      {"edge->vertices", Bytes(edge_vertices_)},
      {"face->vertices", Bytes(face_vertices_)},
      {"face->edges", Bytes(face_edges_)},
      {"face->cells", Bytes(face_cells_) + face_overflow_.memory_bytes()},
      {"cell->vertices", Bytes(cell_vertices_)},
      {"cell->faces", Bytes(cell_faces_)},
      {"vertex->edges", vertex_edges_.memory_bytes()},
      {"edge->faces", edge_faces_.memory_bytes()},
      {"hub faces", hub_faces_.size() * (sizeof(CycleKey) + sizeof(FaceId) + 1)},
      {"hub edges", hub_edges_.capacity() * (sizeof(std::pair<VertexId, VertexId>) + sizeof(EdgeId) + 1)},
      {"journal",
       Bytes(journal_.entries) + Bytes(journal_.positions) + Bytes(journal_.rows) + Bytes(journal_.contents)},
  };
  for (EntityKind kind : kEntityKinds) {
    const int k = Dimension(kind);
    const std::string name(EntityKindName(kind));
    arrays.emplace_back(name + " slots", slots_[k].memory_bytes());
    arrays.emplace_back(name + " changed", changed_[k].memory_bytes());
    arrays.emplace_back(name + " flags", Bytes(flags_[k]));
    arrays.emplace_back(name + " boundary",
                        boundary_[k].memory_bytes() + (k < 2 ? Bytes(boundary_uses_[k]) : 0));
  }
  for (Relation relation : kStorableRelations) {
    arrays.emplace_back(
        absl::StrCat(EntityKindName(relation.from), "->", EntityKindName(relation.to), " stored"),
        stored_.memory_bytes(relation));
  }
  for (const AttributeColumn& column : attributes_) {
    arrays.emplace_back("attribute " + column.spec().name, column.memory_bytes());
  }
  return arrays;
}

size_t Mesh::memory_bytes() const {
  const auto arrays = MemoryByArray();
  return std::accumulate(arrays.begin(), arrays.end(), size_t{0},
                         [](size_t sum, const auto& array) { return sum + array.second; });
}

}  // namespace dynmesh
