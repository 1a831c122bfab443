#ifndef DYNMESH_CORE_MESH_RELATIONS_H_
#define DYNMESH_CORE_MESH_RELATIONS_H_

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <type_traits>
#include <vector>

#include "absl/types/span.h"
#include "core/mesh/inverse_rows.h"
#include "core/mesh/mesh.h"
#include "core/mesh/pipeline.h"
#include "core/mesh/row_block.h"
#include "core/mesh/tetrahedron_edges.h"

/// The 16 neighbour relations V/E/F/C -> V/E/F/C (paper, section 4).
///
/// From a higher dimension to a lower one: template order (edges: stored order), an entry for each local
/// vertex, edge or face, so degenerate elements repeat. Otherwise *incident* (lower to higher) or *adjacent*
/// (same dimension) entities, ascending, each once, never the entity itself. Adjacent: vertices through an
/// edge, edges through a vertex, faces through an edge, cells through a face.
///
/// The answer is the same whether a relation is stored (Mesh::StoreRelation) or worked out on demand.
namespace dynmesh {

/// Rows of neighbours, as compressed sparse rows: row i is ids[offsets[i] .. offsets[i + 1]).
struct CsrTable {
  std::vector<uint32_t> offsets = {0};
  std::vector<Slot> ids;

  size_t num_rows() const { return offsets.size() - 1; }
  absl::Span<const Slot> Row(size_t i) const {
    return absl::MakeConstSpan(ids).subspan(offsets[i], offsets[i + 1] - offsets[i]);
  }
};

namespace internal {

template <typename Fn>
void ForEachStoredRow(const Mesh& mesh, Relation relation, const StoredRows& stored,
                      absl::Span<const Slot> slots, RowBlock& block, Fn& fn) {
  for (Slot slot : slots) {
    if (!stored.IsOpen(slot)) {
      fn(slot, stored.Row(slot));
    } else {
      block.Gather(mesh, relation, {&slot, 1});
      fn(slot, block.Row(0));
    }
  }
}

/// Ids of one kind as the slots that they are.
template <EntityKind K>
absl::Span<const Slot> AsSlots(absl::Span<const Id<K>> ids) {
  static_assert(sizeof(Id<K>) == sizeof(Slot) && std::is_standard_layout_v<Id<K>>);
  return absl::MakeConstSpan(reinterpret_cast<const Slot*>(ids.data()), ids.size());
}

/// Rows that stand in the mesh as they are to be told; false when the relation has none such.
template <typename Fn>
bool ForEachOwnRow(const Mesh& mesh, Relation relation, absl::Span<const Slot> slots, RowBlock& block,
                   Fn& fn) {
  const auto walk = [&](auto row_of) {
    for (Slot slot : slots) {
      const absl::Span<const Slot> row = AsSlots(row_of(slot));
      if (row.size() <= Mesh::kSortedIncident) {
        fn(slot, row);
      } else {
        block.Gather(mesh, relation, {&slot, 1});
        fn(slot, block.Row(0));
      }
    }
    return true;
  };
  if (relation == Relation{EntityKind::kCell, EntityKind::kVertex})
    return walk([&](Slot c) { return mesh.Vertices(CellId(c)); });
  if (relation == Relation{EntityKind::kFace, EntityKind::kVertex})
    return walk([&](Slot f) { return mesh.Vertices(FaceId(f)); });
  if (relation == Relation{EntityKind::kFace, EntityKind::kEdge})
    return walk([&](Slot f) { return mesh.Edges(FaceId(f)); });
  if (relation == Relation{EntityKind::kEdge, EntityKind::kVertex})
    return walk([&](Slot e) { return mesh.Vertices(EdgeId(e)); });
  if (!mesh.IsPlain()) return false;  // entries may be repeated
  if (relation == Relation{EntityKind::kVertex, EntityKind::kEdge})
    return walk([&](Slot v) { return mesh.IncidentEdges(VertexId(v)); });
  if (relation == Relation{EntityKind::kEdge, EntityKind::kFace})
    return walk([&](Slot e) { return mesh.IncidentFaces(EdgeId(e)); });
  if (relation == Relation{EntityKind::kFace, EntityKind::kCell})
    return walk([&](Slot f) { return mesh.IncidentCells(FaceId(f)); });
  return false;
}

template <typename Fn>
void ForEachRow(const Mesh& mesh, Relation relation, absl::Span<const Slot> slots, RowBlock& block, Fn& fn) {
  if (const StoredRows* stored = mesh.stored().Find(relation)) {
    return ForEachStoredRow(mesh, relation, *stored, slots, block, fn);
  }
  const CellEdgeRows* cell_edges = mesh.stored().cell_edges();
  if (cell_edges != nullptr && relation == kStorableRelations[0]) {
    for (Slot slot : slots) fn(slot, cell_edges->Row(slot));
    return;
  }
  if (ForEachOwnRow(mesh, relation, slots, block, fn)) return;
  for (size_t begin = 0; begin < slots.size(); begin += RowBlock::kMaxRows) {
    const auto part = slots.subspan(begin, RowBlock::kMaxRows);
    block.Gather(mesh, relation, part);
    for (size_t i = 0; i < part.size(); ++i) fn(part[i], block.Row(i));
  }
}

/// Calls fn(slot, row) for slots whose rows of kStride entries follow each other from `ids` on.
template <size_t kStride, typename Fn>
void ForEachFixedRow(const Slot* ids, Slot begin, Slot end, Fn& fn) {
  for (Slot slot = begin; slot < end; ++slot, ids += kStride) fn(slot, absl::Span<const Slot>(ids, kStride));
}

/// All rows from one array, with a length that the compiler knows.
template <size_t kStride, typename Fn>
void ForEachFixedRow(const BitSet& live, const Slot* ids, Fn& fn) {
  live.ForEachRun(
      [&](Slot begin, Slot end) { ForEachFixedRow<kStride>(ids + kStride * begin, begin, end, fn); });
}

/// All rows of cell->faces of a mesh of tetrahedra, without their orientation codes.
template <typename Fn>
void ForEachTetrahedronFaces(const Mesh& mesh, Fn& fn) {
  mesh.slots(EntityKind::kCell).live().ForEachRun([&](Slot begin, Slot end) {
    const OrientedFace* faces = mesh.Faces(CellId(begin)).data();
    for (Slot c = begin; c < end; ++c, faces += 4) {
      const std::array<Slot, 4> row = {faces[0].face().slot(), faces[1].face().slot(), faces[2].face().slot(),
                                       faces[3].face().slot()};
      fn(c, absl::MakeConstSpan(row.data(), 4));
    }
  });
}

/// All rows of cell->edges of a mesh of tetrahedra whose faces stand kStride entries apart.
template <size_t kStride, typename Fn>
void ForEachTetrahedronEdges(const Mesh& mesh, Fn& fn) {
  constexpr Slot kAhead = 16;  // so many cells ahead memory is fetched where faces are scattered
  const Slot limit = mesh.slots(EntityKind::kCell).limit();
  if (limit == 0) return;
  const OrientedFace* const faces = mesh.Faces(CellId(0)).data();
  const EdgeId* const edges = mesh.Edges(FaceId(0)).data();
  const Slot last = limit - 1;
  mesh.slots(EntityKind::kCell).live().ForEachRun([&](Slot begin, Slot end) {
    const int64_t distance = int64_t{faces[4 * size_t{begin}].face().slot()} -
                             faces[4 * size_t{std::min(begin + kAhead, last)}].face().slot();
    const bool scattered = std::abs(distance) > kAhead * kAhead;
    for (Slot c = begin; c < end; ++c) {
      if (scattered) {
        const OrientedFace* const ahead = faces + 4 * size_t{std::min(c + kAhead, last)};
        for (int i = 0; i < 3; ++i) Prefetch(edges + kStride * ahead[i].face().slot());
      }
      const std::array<Slot, 6> row = TetrahedronEdges<kStride>(faces + 4 * size_t{c}, edges);
      fn(c, absl::MakeConstSpan(row.data(), 6));
    }
  });
}

/// All rows, where they are of one length and no list; false for other relations.
template <typename Fn>
bool ForEachFixedRow(const Mesh& mesh, Relation relation, Fn& fn) {
  const BitSet& live = mesh.slots(relation.from).live();
  const auto [ids, stride] = mesh.FixedRowsOf(relation);
  switch (ids == nullptr ? 0 : stride) {
    case 2:
      return ForEachFixedRow<2>(live, ids, fn), true;
    case 3:
      return ForEachFixedRow<3>(live, ids, fn), true;
    case 4:
      return ForEachFixedRow<4>(live, ids, fn), true;
    case 6:
      return ForEachFixedRow<6>(live, ids, fn), true;
    case 12:
      return ForEachFixedRow<12>(live, ids, fn), true;
    default:
      break;
  }
  if (relation.from != EntityKind::kCell || !mesh.IsTetrahedral()) return false;
  if (relation.to == EntityKind::kFace) return ForEachTetrahedronFaces(mesh, fn), true;
  if (relation.to == EntityKind::kEdge) {
    mesh.FaceStride() == 3 ? ForEachTetrahedronEdges<3>(mesh, fn) : ForEachTetrahedronEdges<4>(mesh, fn);
    return true;
  }
  return false;
}

}  // namespace internal

/// Calls fn(slot, row) for each of `slots`, in order; a row is valid during the call. Nothing is gathered in
/// between: the way to walk many rows. REQUIRES: all are live, fn does not change the mesh.
template <typename Fn>
void ForEachRow(const Mesh& mesh, Relation relation, absl::Span<const Slot> slots, Fn fn) {
  RowBlock block;
  internal::ForEachRow(mesh, relation, slots, block, fn);
}

/// The same for all live entities of relation.from, ascending: cheaper than naming them (InverseRows).
template <typename Fn>
void ForEachRow(const Mesh& mesh, Relation relation, Fn fn) {
  if (internal::ForEachFixedRow(mesh, relation, fn)) return;
  const BitSet& live = mesh.slots(relation.from).live();
  if (!mesh.stored().Has(relation) && InverseRows::Pays(mesh, relation)) {
    const InverseRows rows(mesh, relation);
    return live.ForEach([&](Slot slot) { fn(slot, rows.Row(slot)); });
  }
  std::array<Slot, RowBlock::kMaxRows> part;
  RowBlock block;
  for (Slot next = 0;;) {
    const size_t count = live.Collect(next, part.data(), part.size());
    if (count == 0) return;
    internal::ForEachRow(mesh, relation, absl::MakeConstSpan(part.data(), count), block, fn);
    next = part[count - 1] + 1;
  }
}

/// Puts the neighbours of `slot` into `row`, by way of `block`, which a caller of many keeps.
/// REQUIRES: `slot` is live in `mesh`.
void GetNeighbors(const Mesh& mesh, Relation relation, Slot slot, RowBlock& block, std::vector<Slot>& row);

/// Appends the neighbours of `slot` to `out`. REQUIRES: `slot` is live in `mesh`.
void AppendNeighbors(const Mesh& mesh, Relation relation, Slot slot, std::vector<Slot>& out);

/// A row for each of `slots`. REQUIRES: all are live, and the answer has fewer than 2^32 entries.
CsrTable Neighbors(const Mesh& mesh, Relation relation, absl::Span<const Slot> slots);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_MESH_RELATIONS_H_
