#include "core/mesh/row_block.h"

#include <algorithm>
#include <bit>
#include <cstring>

#include "core/mesh/cells_across.h"
#include "core/mesh/sort_unique.h"
#include "core/mesh/tetrahedron_edges.h"

namespace dynmesh {
namespace {

/// How many rows ahead memory is fetched.
constexpr size_t kAhead = 16;

/// Faces of a cell at each of its vertices, as bits.
using VertexFaces = std::array<std::array<uint8_t, kMaxElementVertices>, kNumElementTypes + 1>;
VertexFaces MakeVertexFaces() {
  VertexFaces faces{};
  for (ElementType type : kElementTypes) {
    const ElementTemplate& shape = TemplateOf(type);
    for (int i = 0; i < shape.num_faces; ++i) {
      for (int k = 0; k < shape.faces[i].size; ++k) {
        faces[static_cast<int>(type)][shape.faces[i].vertices[k]] |= 1 << i;
      }
    }
  }
  return faces;
}
const VertexFaces kFacesAtVertex = MakeVertexFaces();

}  // namespace

void RowBlock::Grow(size_t needed) {
  const size_t capacity = std::max(needed, 2 * capacity_ + 1024);
  auto ids = std::make_unique_for_overwrite<Slot[]>(capacity);
  if (size_ > 0) std::memcpy(ids.get(), ids_.get(), size_ * sizeof(Slot));
  ids_ = std::move(ids);
  capacity_ = capacity;
}

/// One method for each way of gathering a row; they append to the block, then Finish() makes the row
/// canonical.
class RowKernels {
 public:
  RowKernels(const Mesh& mesh, RowBlock& block) : mesh_(mesh), block_(block), plain_(mesh.IsPlain()) {}

  void Gather(Relation relation, absl::Span<const Slot> slots) {
    block_.size_ = 0;
    block_.offsets_[0] = 0;
    switch (relation.from) {
      case EntityKind::kVertex:
        return OfVertices(relation.to, slots);
      case EntityKind::kEdge:
        return OfEdges(relation.to, slots);
      case EntityKind::kFace:
        return OfFaces(relation.to, slots);
      case EntityKind::kCell:
        return OfCells(relation.to, slots);
    }
  }

 private:
  template <typename Fn>
  void ForEach(absl::Span<const Slot> slots, Fn fn) {
    for (size_t i = 0; i < slots.size(); ++i) {
      fn(slots[i]);
      block_.offsets_[i + 1] = block_.size_;
    }
  }

  // ---- Appending ----

  template <typename Ids>
  void PushAll(const Ids& ids) {
    Slot* out = block_.Room(ids.size());
    for (auto id : ids) *out++ = id.slot();
    block_.size_ += ids.size();
  }

  /// PushAll for a list of the mesh, most of which are short: eight entries at once, whatever there is of
  /// them.
  template <typename Id>
  void PushList(absl::Span<const Id> list) {
    static_assert(sizeof(Id) == sizeof(Slot));
    constexpr size_t kShort = PooledLists<Id>::kReadable;
    Slot* const out = block_.Room(list.size());
    std::memcpy(out, list.data(), kShort * sizeof(Slot));
    if (list.size() > kShort) std::memcpy(out, list.data(), list.size() * sizeof(Slot));
    block_.size_ += list.size();
  }

  /// Sorts the row that began at `begin` and drops repeats.
  void Canonicalize(size_t begin) {
    block_.size_ = begin + SortUnique(block_.ids_.get() + begin, block_.size_ - begin);
  }

  /// The same where only meshes that are not plain have repeats.
  void CanonicalizePlain(size_t begin) {
    plain_ ? SortDistinct(block_.ids_.get() + begin, block_.size_ - begin) : Canonicalize(begin);
  }

  /// The same, without `self`.
  void CanonicalizeWithout(size_t begin, Slot self) {
    block_.size_ = begin + SortUnique(block_.ids_.get() + begin, block_.size_ - begin, self);
  }

  /// The same where `self` stands just `times` times.
  void CanonicalizeWithout(size_t begin, Slot self, size_t times) {
    block_.size_ = begin + SortUniqueWithout(block_.ids_.get() + begin, block_.size_ - begin, self, times);
  }

  // ---- Vertices ----

  void OfVertices(EntityKind to, absl::Span<const Slot> slots) {
    switch (to) {
      case EntityKind::kVertex:
        return ForEach(slots, [&](Slot v) { VertexVertices(VertexId(v)); });
      case EntityKind::kEdge:
        return ForEach(slots, [&](Slot v) {
          const size_t begin = block_.size_;
          PushList(mesh_.IncidentEdges(VertexId(v)));
          CanonicalizePlain(begin);
        });
      case EntityKind::kFace:
        return ForEach(slots, [&](Slot v) { VertexFaces(VertexId(v)); });
      case EntityKind::kCell:
        return ForEach(slots, [&](Slot v) { VertexCells(VertexId(v)); });
    }
  }

  VertexId OtherEnd(EdgeId e, VertexId v) const {
    const auto& ends = mesh_.edge_vertices_[e.slot()];
    return VertexId(ends[0].slot() ^ ends[1].slot() ^ v.slot());
  }

  void VertexVertices(VertexId v) {
    const size_t begin = block_.size_;
    const auto edges = mesh_.IncidentEdges(v);
    Slot* out = block_.Room(edges.size());
    for (EdgeId e : edges) *out++ = OtherEnd(e, v).slot();
    block_.size_ += edges.size();
    plain_ ? Canonicalize(begin) : CanonicalizeWithout(begin, v.slot());
  }

  /// The neighbour of `v` in face `f` that is not `x`, in a mesh without degenerate faces.
  Slot OtherNeighbor(FaceId f, VertexId v, VertexId x) const {
    const VertexId* cycle = &mesh_.face_vertices_[size_t{f.slot()} * mesh_.face_stride_];
    if (mesh_.FaceSize(f) == 3)
      return cycle[0].slot() ^ cycle[1].slot() ^ cycle[2].slot() ^ v.slot() ^ x.slot();
    const int at = std::find(cycle, cycle + 4, v) - cycle;
    return cycle[(at + 1) % 4].slot() ^ cycle[(at + 3) % 4].slot() ^ x.slot();
  }

  /// A face at a vertex v, and the neighbours x < y of v in it.
  struct Corner {
    FaceId face;
    Slot x, y;
  };

  /// Each face at `v` once, in a mesh without degenerate faces. Every face is met by both its edges at `v`
  /// and kept by one: what is not kept is overwritten, because a branch would be mispredicted half the time.
  absl::Span<const Corner> CornersAt(VertexId v) {
    size_t count = 0;
    for (EdgeId e : mesh_.IncidentEdges(v)) {
      const VertexId x = OtherEnd(e, v);
      const auto faces = mesh_.IncidentFaces(e);
      if (count + faces.size() > corners_.size()) corners_.resize(2 * (count + faces.size()));
      Corner* const corners = corners_.data();
      for (FaceId f : faces) {
        const Slot y = OtherNeighbor(f, v, x);
        corners[count] = {f, x.slot(), y};
        count += x.slot() < y;
      }
    }
    return absl::MakeConstSpan(corners_.data(), count);
  }

  void VertexFaces(VertexId v) {
    const size_t begin = block_.size_;
    if (!plain_) {
      for (EdgeId e : mesh_.IncidentEdges(v)) PushList(mesh_.IncidentFaces(e));
      return Canonicalize(begin);
    }
    const auto corners = CornersAt(v);
    Slot* out = block_.Room(corners.size());
    for (const Corner& corner : corners) *out++ = corner.face.slot();
    block_.size_ += corners.size();
    SortDistinct(block_.ids_.get() + begin, corners.size());
  }

  void VertexCells(VertexId v) {
    const size_t begin = block_.size_;
    if (!plain_) {
      for (EdgeId e : mesh_.IncidentEdges(v)) PushEdgeCells(e);
      return Canonicalize(begin);
    }
    for (const Corner& corner : CornersAt(v)) {
      const auto cells = mesh_.IncidentCells(corner.face);
      Slot* out = block_.Room(cells.size());
      for (CellId c : cells) {
        *out = c.slot();
        out += CountsHere(c, v, corner);
      }
      block_.size_ = out - block_.ids_.get();
    }
    SortDistinct(block_.ids_.get() + begin, block_.size_ - begin);
  }

  /// Whether the corner's is the one of the faces of `c` at `v` where `c` is counted.
  bool CountsHere(CellId c, VertexId v, const Corner& corner) const {
    const VertexId* vertices = &mesh_.cell_vertices_[size_t{c.slot()} * mesh_.cell_vertex_stride_];
    const ElementType type = mesh_.Type(c);
    if (type == ElementType::kTetrahedron) {
      const Slot all = vertices[0].slot() ^ vertices[1].slot() ^ vertices[2].slot() ^ vertices[3].slot();
      return (all ^ v.slot() ^ corner.x ^ corner.y) > corner.y;
    }
    const OrientedFace* faces = &mesh_.cell_faces_[size_t{c.slot()} * mesh_.cell_face_stride_];
    int local = 0;
    while (vertices[local] != v) ++local;
    for (unsigned bits = kFacesAtVertex[static_cast<int>(type)][local]; bits != 0; bits &= bits - 1) {
      if (faces[std::countr_zero(bits)].face() < corner.face) return false;
    }
    return true;
  }

  // ---- Edges ----

  void OfEdges(EntityKind to, absl::Span<const Slot> slots) {
    switch (to) {
      case EntityKind::kVertex:
        return ForEach(slots, [&](Slot e) { PushAll(mesh_.edge_vertices_[e]); });
      case EntityKind::kEdge:
        return ForEach(slots, [&](Slot e) {
          const size_t begin = block_.size_;
          for (VertexId v : mesh_.edge_vertices_[e]) PushList(mesh_.IncidentEdges(v));
          plain_ ? CanonicalizeWithout(begin, e, 2) : CanonicalizeWithout(begin, e);
        });
      case EntityKind::kFace:
        return ForEach(slots, [&](Slot e) {
          const size_t begin = block_.size_;
          PushList(mesh_.IncidentFaces(EdgeId(e)));
          CanonicalizePlain(begin);
        });
      case EntityKind::kCell:
        return ForEach(slots, [&](Slot e) {
          const size_t begin = block_.size_;
          PushEdgeCells(EdgeId(e));
          Canonicalize(begin);
        });
    }
  }

  void PushEdgeCells(EdgeId e) {
    for (FaceId f : mesh_.IncidentFaces(e)) PushAll(mesh_.IncidentCells(f));
  }

  // ---- Faces ----

  void OfFaces(EntityKind to, absl::Span<const Slot> slots) {
    switch (to) {
      case EntityKind::kVertex:
        return ForEach(slots, [&](Slot f) { PushAll(mesh_.Vertices(FaceId(f))); });
      case EntityKind::kEdge:
        return ForEach(slots, [&](Slot f) { PushAll(mesh_.Edges(FaceId(f))); });
      case EntityKind::kFace:
        return ForEach(slots, [&](Slot f) {
          const size_t begin = block_.size_;
          const auto edges = mesh_.Edges(FaceId(f));
          for (EdgeId e : edges) PushList(mesh_.IncidentFaces(e));
          plain_ ? CanonicalizeWithout(begin, f, edges.size()) : CanonicalizeWithout(begin, f);
        });
      case EntityKind::kCell:
        return ForEach(slots, [&](Slot f) {
          const size_t begin = block_.size_;
          PushAll(mesh_.IncidentCells(FaceId(f)));
          CanonicalizePlain(begin);
        });
    }
  }

  // ---- Cells ----

  void OfCells(EntityKind to, absl::Span<const Slot> slots) {
    switch (to) {
      case EntityKind::kVertex:
        return ForEach(slots, [&](Slot c) { PushAll(mesh_.Vertices(CellId(c))); });
      case EntityKind::kEdge:
        return CellEdges(slots);
      case EntityKind::kFace:
        return mesh_.cell_face_stride_ == 4   ? CellFaces<4>(slots)
               : mesh_.cell_face_stride_ == 5 ? CellFaces<5>(slots)
                                              : CellFaces<6>(slots);
      case EntityKind::kCell:
        return ForEach(slots, [&](Slot c) {
          if (!plain_ || mesh_.Type(CellId(c)) != ElementType::kTetrahedron || !TetTets(c))
            CellCells(CellId(c));
        });
    }
  }

  /// `kStride`: as many faces as any cell has. Those that a cell has not are overwritten.
  template <size_t kStride>
  void CellFaces(absl::Span<const Slot> slots) {
    Slot* out = block_.Room(slots.size() * kStride);
    Slot* const begin = out;
    for (size_t i = 0; i < slots.size(); ++i) {
      const auto faces = mesh_.Faces(CellId(slots[i]));
      for (size_t k = 0; k < kStride; ++k) out[k] = faces.data()[k].face().slot();
      out += faces.size();
      block_.offsets_[i + 1] = out - begin;
    }
    block_.size_ = out - begin;
  }

  /// The row of a tetrahedron whose faces have at most two cells each, in registers; false for others.
  bool TetTets(Slot c) {
    const OrientedFace* faces = &mesh_.cell_faces_[size_t{c} * mesh_.cell_face_stride_];
    const std::array<CellId, 2>* uses[4];
    for (int i = 0; i < 4; ++i) uses[i] = &mesh_.face_cells_[faces[i].face().slot()];
    const int size = CellsAcross(c, uses, Mesh::kOverflow, block_.Room(4));
    block_.size_ += std::max(size, 0);
    return size >= 0;
  }

  void CellCells(CellId c) {
    const size_t begin = block_.size_;
    Slot* out = block_.Room(kMaxElementFaces);
    bool crowded = false;
    for (OrientedFace oriented : mesh_.Faces(c)) {
      const auto& uses = mesh_.face_cells_[oriented.face().slot()];
      crowded |= uses[1] == Mesh::kOverflow;
      *out = uses[0].slot() ^ uses[1].slot() ^ c.slot();
      out += uses[1].valid();
    }
    if (!crowded) {
      block_.size_ = out - block_.ids_.get();
    } else {
      for (OrientedFace oriented : mesh_.Faces(c)) PushAll(mesh_.IncidentCells(oriented.face()));
    }
    CanonicalizeWithout(begin, c.slot());
  }

  void CellEdges(absl::Span<const Slot> slots) {
    Slot* out = block_.Room(slots.size() * kMaxElementEdges);
    Slot* const begin = out;
    const size_t ahead = IsScattered(slots) ? kAhead : slots.size();
    for (size_t i = 0; i < ahead % slots.size(); ++i) FetchFaceEdges(slots[i]);
    for (size_t i = 0; i < slots.size(); ++i) {
      if (i + ahead < slots.size()) FetchFaceEdges(slots[i + ahead]);
      const ElementType type = mesh_.Type(CellId(slots[i]));
      const OrientedFace* faces = &mesh_.cell_faces_[size_t{slots[i]} * mesh_.cell_face_stride_];
      if (type == ElementType::kTetrahedron) {
        const auto edges = mesh_.face_stride_ == 3 ? TetrahedronEdges<3>(faces, mesh_.face_edges_.data())
                                                   : TetrahedronEdges<4>(faces, mesh_.face_edges_.data());
        out = std::copy(edges.begin(), edges.end(), out);
      } else {
        out = EdgesOf(CellId(slots[i]), out);
      }
      block_.offsets_[i + 1] = out - begin;
    }
    block_.size_ = out - begin;
  }

  /// Whether the faces of cells that follow each other lie far apart, so that fetching them ahead pays.
  bool IsScattered(absl::Span<const Slot> slots) const {
    size_t distance = 0;
    for (size_t i = kAhead; i < slots.size(); i += kAhead) {
      const Slot one = FirstFace(slots[i - 1]), next = FirstFace(slots[i]);
      distance += one < next ? next - one : one - next;
    }
    return distance > slots.size() * kAhead;
  }

  Slot FirstFace(Slot c) const {
    return mesh_.cell_faces_[size_t{c} * mesh_.cell_face_stride_].face().slot();
  }

  void FetchFaceEdges(Slot c) const {
    const OrientedFace* faces = &mesh_.cell_faces_[size_t{c} * mesh_.cell_face_stride_];
    for (int i = 0; i < 3; ++i) {
      __builtin_prefetch(&mesh_.face_edges_[size_t{faces[i].face().slot()} * mesh_.face_stride_]);
    }
  }

  Slot* EdgesOf(CellId c, Slot* out) const {
    const int num_edges = TemplateOf(mesh_.Type(c)).num_edges;
    for (int e = 0; e < num_edges; ++e) *out++ = mesh_.Edge(c, e).slot();
    return out;
  }

  const Mesh& mesh_;
  RowBlock& block_;
  const bool plain_;
  std::vector<Corner> corners_;
};

void RowBlock::Gather(const Mesh& mesh, Relation relation, absl::Span<const Slot> slots) {
  RowKernels(mesh, *this).Gather(relation, slots);
}

}  // namespace dynmesh
