// Which faces and edges the elements of a bulk build have, and which of these are shared.

#include <algorithm>
#include <utility>

#include "core/mesh/bulk_build.h"
#include "core/mesh/first_equal.h"

namespace dynmesh {
namespace {

constexpr size_t kItemsPerTick = 32768;
/// How many cells ahead scattered input is fetched: far enough for memory, near enough for the cache.
constexpr Slot kPrefetchDistance = 24;
/// Names are 32-bit numbers; between two ticks there come fewer than a million.
constexpr size_t kMaxNames = kNoSlot - kItemsPerTick * kMaxElementEdges;

/// A face's key. Triangles of a mesh without quads have two other vertices, quads three.
template <int Words>
VertexKey<Words> KeyOf(absl::Span<const VertexId> cycle) {
  VertexKey<Words> key;
  key.others.fill(kNoSlot);
  if (cycle.size() == 3) {
    Slot a = cycle[0].slot(), b = cycle[1].slot(), c = cycle[2].slot();
    if (a > b) std::swap(a, b);
    if (b > c) std::swap(b, c);
    if (a > b) std::swap(a, b);
    key.lowest = a;
    key.others[0] = b;
    key.others[1] = c;
    return key;
  }
  const CycleKey canonical = CanonicalCycle(cycle);
  key.lowest = canonical[0].slot();
  for (int k = 0; k < Words; ++k) key.others[k] = canonical[k + 1].slot();
  return key;
}

/// One face of a cell as a cycle of the cell's vertices.
class CellFace {
 public:
  CellFace(const LocalFace& face, const VertexId* cell) : size_(face.size) {
    for (int k = 0; k < face.size; ++k) vertices_[k] = cell[face.vertices[k]];
  }
  absl::Span<const VertexId> span() const { return {vertices_.data(), static_cast<size_t>(size_)}; }

 private:
  int size_;
  std::array<VertexId, kMaxFaceVertices> vertices_;
};

/// MatchFace for cycles that are known to be equal and name no vertex twice.
FaceCode CodeOfEqual(absl::Span<const VertexId> stored, absl::Span<const VertexId> key) {
  const int n = stored.size();
  int rotation = 0;
  while (stored[rotation] != key[0]) ++rotation;
  const bool flipped = stored[rotation + 1 == n ? 0 : rotation + 1] != key[1];
  return FaceCode{static_cast<uint8_t>(rotation | (flipped ? 4 : 0))};
}

}  // namespace

// ---- Faces: find the first equal use of each use ----

absl::Status BulkBuilder::MatchFaces() {
  return mesh_.face_stride_ == 3 ? MatchFaceKeys<2>() : MatchFaceKeys<3>();
}

template <int Words>
absl::Status BulkBuilder::MatchFaceKeys() {
  const Slot num_faces = NumElements(EntityKind::kFace), num_cells = NumElements(EntityKind::kCell);
  FirstEqual<Words> first(UseOf(num_cells), NumElements(EntityKind::kVertex));
  const auto for_each_use = [&](Slot c, auto fn) {
    const VertexId* vertices = &mesh_.cell_vertices_[size_t{c} * mesh_.cell_vertex_stride_];
    const ElementTemplate& shape = TemplateOf(mesh_.Type(CellId(c)));
    for (int i = 0; i < shape.num_faces; ++i) {
      fn(UseOf(c) + i, KeyOf<Words>(CellFace(shape.faces[i], vertices).span()));
    }
  };
  for (Slot f = 0; f < num_faces; ++f) first.Count(KeyOf<Words>(mesh_.Vertices(FaceId(f))).lowest);
  for (Slot c = 0; c < num_cells; ++c)
    for_each_use(c, [&](uint32_t, const auto& key) { first.Count(key.lowest); });
  first.EndCount();
  for (Slot f = 0; f < num_faces; ++f) first.Put(f, KeyOf<Words>(mesh_.Vertices(FaceId(f))));
  for (Slot k = 0; k < num_cells; ++k) {
    if (!walk_.empty() && k + kPrefetchDistance < num_cells) {
      __builtin_prefetch(
          &mesh_.cell_vertices_[size_t{walk_[k + kPrefetchDistance]} * mesh_.cell_vertex_stride_]);
    }
    for_each_use(walk_.empty() ? k : walk_[k], [&](uint32_t use, const auto& key) { first.Put(use, key); });
    if (k % kItemsPerTick == 0) DYNMESH_RETURN_IF_ERROR(Tick(std::min<size_t>(kItemsPerTick, num_cells - k)));
  }
  uses_ = std::move(first).Take();
  return absl::OkStatus();
}

// ---- Scan: number faces as they first occur, name edges ----

absl::Status BulkBuilder::ScanFaces() {
  const Slot num_elements = NumElements(EntityKind::kFace), num_uses = uses_.size();
  size_t num_faces = num_elements;
  for (uint32_t use = num_elements; use < num_uses; ++use) num_faces += uses_[use] == use;
  const uint32_t limit = mesh_.options_.limits.max_slots[2];
  if (num_faces > limit) return LimitExceeded("max_faces", limit, num_faces);
  const size_t rows = num_faces + num_faces / kHeadroom;
  mesh_.face_vertices_.reserve(rows * mesh_.face_stride_);
  mesh_.face_edges_.reserve(rows * mesh_.face_stride_);
  mesh_.face_cells_.reserve(rows);
  mesh_.flags_[2].reserve(rows);
  mesh_.face_edges_.resize(size_t{num_elements} * mesh_.face_stride_);
  mesh_.face_cells_.resize(num_elements);
  names_ = std::move(mesh_.edge_vertices_);
  names_.reserve(names_.size() + num_faces);
  for (Slot f = 0; f < num_elements; ++f) ScanFaceElement(FaceId(f));
  return ScanCells();
}

void BulkBuilder::ScanFaceElement(FaceId f) {
  const auto vertices = mesh_.Vertices(f);
  EdgeId* edges = &mesh_.face_edges_[size_t{f.slot()} * mesh_.face_stride_];
  const FaceId first(uses_[f.slot()]);
  if (first == f) {
    for (size_t k = 0; k < vertices.size(); ++k)
      edges[k] = NewName(vertices[k], vertices[(k + 1) % vertices.size()]);
    return;
  }
  const FaceCode code = *MatchFace(mesh_.Vertices(first), vertices);
  const auto known = mesh_.Edges(first);
  for (size_t k = 0; k < vertices.size(); ++k) edges[k] = known[code.StoredEdge(k, vertices.size())];
}

absl::Status BulkBuilder::ScanCells() {
  const Slot num_cells = NumElements(EntityKind::kCell);
  for (Slot c = 0; c < num_cells; ++c) {
    if (!walk_.empty()) {
      if (c + 2 * kPrefetchDistance < num_cells) PrefetchUses(c + 2 * kPrefetchDistance);
      if (c + kPrefetchDistance < num_cells) PrefetchFaces(c + kPrefetchDistance, UseOf(c));
    }
    ScanCell(CellId(c));
    if (c % kItemsPerTick != 0) continue;
    if (names_.size() > kMaxNames) return LimitExceeded("max_edges", kMaxNames, names_.size());
    DYNMESH_RETURN_IF_ERROR(Tick(std::min<size_t>(kItemsPerTick, num_cells - c)));
  }
  return absl::OkStatus();
}

void BulkBuilder::PrefetchUses(Slot c) const {
  for (uint32_t use = UseOf(c); use < UseOf(c + 1); ++use) __builtin_prefetch(&uses_[uses_[use]]);
}

void BulkBuilder::PrefetchFaces(Slot c, uint32_t known) const {
  for (uint32_t use = UseOf(c); use < UseOf(c + 1); ++use) {
    const uint32_t first = uses_[use];
    if (first >= known) continue;
    __builtin_prefetch(&mesh_.face_vertices_[size_t{uses_[first]} * mesh_.face_stride_]);
    __builtin_prefetch(&mesh_.face_edges_[size_t{uses_[first]} * mesh_.face_stride_]);
    __builtin_prefetch(&mesh_.face_cells_[uses_[first]]);
  }
}

void BulkBuilder::ScanCell(CellId c) {
  const ElementTemplate& shape = TemplateOf(mesh_.Type(c));
  const auto vertices = mesh_.Vertices(c);
  const bool degenerate = HasRepeats(vertices);
  const uint32_t first_use = UseOf(c.slot());
  EdgeNames names;
  OrientedFace* faces = &mesh_.cell_faces_[size_t{c.slot()} * mesh_.cell_face_stride_];
  for (int i = 0; i < shape.num_faces; ++i) {
    const uint32_t first = uses_[first_use + i];
    if (first >= first_use) continue;
    const FaceId f(uses_[first]);
    faces[i] = OrientFace(f, CellFace(shape.faces[i], vertices.data()).span(), degenerate);
    const auto known = mesh_.Edges(f);
    for (size_t k = 0; k < known.size(); ++k) {
      names[shape.faces[i].edges[k]] = known[faces[i].code().StoredEdge(k, known.size())];
    }
  }
  for (int e = 0; e < shape.num_edges; ++e) {
    const LocalEdge& ends = shape.edges[e];
    if (!names[e].valid()) names[e] = NewName(vertices[ends.vertices[0]], vertices[ends.vertices[1]]);
  }
  for (int i = 0; i < shape.num_faces; ++i) {
    const uint32_t first = uses_[first_use + i];
    const CellFace face(shape.faces[i], vertices.data());
    if (first == first_use + i) {
      std::array<EdgeId, kMaxFaceVertices> edges;
      for (int k = 0; k < shape.faces[i].size; ++k) edges[k] = names[shape.faces[i].edges[k]];
      faces[i] = OrientedFace(NewFace(face.span(), {edges.data(), shape.faces[i].size}), FaceCode());
      if (degenerate && HasRepeats(face.span())) mesh_.flags_[2].back() |= Mesh::kDegenerateFlag;
    } else if (first >= first_use) {  // two faces of a degenerate cell are one
      faces[i] = OrientFace(faces[first - first_use].face(), face.span(), degenerate);
    }
  }
  for (int i = 0; i < shape.num_faces; ++i) {
    uses_[first_use + i] = faces[i].face().slot();
    AddFaceCell(faces[i].face(), c);
  }
}

OrientedFace BulkBuilder::OrientFace(FaceId f, absl::Span<const VertexId> vertices, bool degenerate) const {
  const auto stored = mesh_.Vertices(f);
  return OrientedFace(f, degenerate ? *MatchFace(stored, vertices) : CodeOfEqual(stored, vertices));
}

FaceId BulkBuilder::NewFace(absl::Span<const VertexId> vertices, absl::Span<const EdgeId> names) {
  const FaceId f(mesh_.face_cells_.size());
  const size_t padding = mesh_.face_stride_ - vertices.size();
  mesh_.face_vertices_.insert(mesh_.face_vertices_.end(), vertices.begin(), vertices.end());
  mesh_.face_edges_.insert(mesh_.face_edges_.end(), names.begin(), names.end());
  mesh_.face_vertices_.insert(mesh_.face_vertices_.end(), padding, VertexId());
  mesh_.face_edges_.insert(mesh_.face_edges_.end(), padding, EdgeId());
  mesh_.face_cells_.push_back({CellId(), CellId()});
  mesh_.flags_[2].push_back(
      static_cast<uint8_t>(vertices.size() == 4 ? ElementType::kQuad : ElementType::kTriangle));
  return f;
}

EdgeId BulkBuilder::NewName(VertexId a, VertexId b) {
  names_.push_back({a, b});
  return EdgeId(names_.size() - 1);
}

void BulkBuilder::AddFaceCell(FaceId f, CellId c) {
  auto& uses = mesh_.face_cells_[f.slot()];
  if (!uses[0].valid()) {
    uses[0] = c;
  } else if (!uses[1].valid()) {
    uses[1] = c;
  } else {
    mesh_.AddFaceCell(f, c);  // the third use changes no boundary
  }
}

// ---- Edges: names that mean the same, in order of their first occurrence ----

void BulkBuilder::MatchEdges() {
  const Slot num_elements = NumElements(EntityKind::kEdge);
  FirstEqual<1> first(names_.size(), NumElements(EntityKind::kVertex));
  for (const auto& [a, b] : names_) first.Count(std::min(a, b).slot());
  first.EndCount();
  for (uint32_t name = 0; name < names_.size(); ++name) {
    const auto [low, high] = std::minmax(names_[name][0], names_[name][1]);
    first.Put(name, {low.slot(), {high.slot()}});
  }
  std::vector<uint32_t> edge_of = std::move(first).Take();
  size_t num_edges = num_elements;
  for (uint32_t name = num_elements; name < names_.size(); ++name) num_edges += edge_of[name] == name;
  mesh_.edge_vertices_.reserve(num_edges + num_edges / kHeadroom);
  for (uint32_t name = 0; name < names_.size(); ++name) {
    const uint32_t leader = edge_of[name];
    if (leader != name && name < num_elements) mesh_.flags_[1][name] |= Mesh::kDuplicateFlag;
    if (leader == name || name < num_elements) mesh_.edge_vertices_.push_back(names_[name]);
    edge_of[name] = leader == name || name < num_elements ? mesh_.edge_vertices_.size() - 1 : edge_of[leader];
  }
  names_ = {};
  num_edge_faces_.resize(num_edges);
  const Slot num_faces = mesh_.face_cells_.size();
  for (Slot f = 0; f < num_faces; ++f) {
    for (int k = mesh_.FaceSize(FaceId(f)) - 1; k >= 0; --k) {
      EdgeId& edge = mesh_.face_edges_[size_t{f} * mesh_.face_stride_ + k];
      edge = EdgeId(edge_of[edge.slot()]);
      ++num_edge_faces_[edge.slot()];
    }
  }
}

}  // namespace dynmesh
