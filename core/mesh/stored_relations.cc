#include "core/mesh/stored_relations.h"

#include <algorithm>
#include <array>
#include <utility>

#include "core/mesh/relations.h"

namespace dynmesh {
namespace {

constexpr uint64_t kBytesOfList = 2 * sizeof(uint32_t);

/// Calls fn(slot, row) for all rows; what fn returns is charged as bytes, what it costs as steps, for many
/// rows at once. Errors: the meter's.
template <typename Fn>
absl::Status ForEachMeteredRow(const Mesh& mesh, Relation relation, WorkMeter& meter, Fn fn) {
  uint64_t bytes = 0, steps = 0;
  const auto take = [&](Slot slot, absl::Span<const Slot> row) {
    bytes += fn(slot, row);
    steps += 1 + row.size();
  };
  const auto charge = [&] {
    const absl::Status charged = meter.ChargeBytes(std::exchange(bytes, 0));
    const uint64_t made = std::min(std::exchange(steps, 0), WorkMeter::kMaxCharge);
    return charged.ok() ? meter.ChargeSteps(made) : charged;
  };
  if (InverseRows::Pays(mesh, relation)) {  // in linear time
    ForEachRow(mesh, relation, take);
    return charge();
  }
  std::array<Slot, RowBlock::kMaxRows> part;
  for (Slot next = 0;;) {
    const size_t count = mesh.slots(relation.from).live().Collect(next, part.data(), part.size());
    if (count == 0) return absl::OkStatus();
    ForEachRow(mesh, relation, absl::MakeConstSpan(part.data(), count), take);
    DYNMESH_RETURN_IF_ERROR(charge());
    next = part[count - 1] + 1;
  }
}

}  // namespace

bool StoredRelations::Has(Relation relation) const {
  return StorableIndex(relation) == kCellEdges ? cell_edges_.has_value() : Find(relation) != nullptr;
}

bool StoredRelations::HasRoom(uint32_t count) const {
  return std::all_of(tables_.begin(), tables_.end(),
                     [&](const Table& table) { return !table.has_value() || table->HasRoom(count); });
}

absl::Status StoredRelations::Build(const Mesh& mesh, Relation relation, WorkMeter& meter) {
  if (StorableIndex(relation) == kCellEdges) return BuildCellEdges(mesh, meter);
  std::vector<uint32_t> lengths(mesh.slots(relation.from).limit());
  uint64_t entries = 0;
  DYNMESH_RETURN_IF_ERROR(meter.ChargeBytes(lengths.size() * kBytesOfList));
  DYNMESH_RETURN_IF_ERROR(
      ForEachMeteredRow(mesh, relation, meter, [&](Slot slot, absl::Span<const Slot> row) {
        lengths[slot] = row.size() <= StoredRows::kMaxRow ? row.size() : 0;
        entries += lengths[slot];
        return lengths[slot] * sizeof(Slot);
      }));
  if (entries >= StoredRows::kMaxEntries) {
    return LimitExceeded("max_stored_neighbors", StoredRows::kMaxEntries, entries);
  }
  StoredRows table;
  table.Layout(lengths);
  DYNMESH_RETURN_IF_ERROR(
      ForEachMeteredRow(mesh, relation, meter, [&](Slot slot, absl::Span<const Slot> row) {
        if (row.size() > StoredRows::kMaxRow) table.Open(slot);
        for (size_t i = 0; i < row.size() && row.size() <= StoredRows::kMaxRow; ++i)
          table.Append(slot, row[i]);
        return 0;
      }));
  if (StorableIndex(relation) == kCellCells) OpenCrowds(mesh, table);
  tables_[StorableIndex(relation)] = std::move(table);
  ++num_tables_;
  return absl::OkStatus();
}

absl::Status StoredRelations::BuildCellEdges(const Mesh& mesh, WorkMeter& meter) {
  CellEdgeRows rows;
  DYNMESH_RETURN_IF_ERROR(ForEachMeteredRow(mesh, kStorableRelations[kCellEdges], meter,
                                            [&](Slot c, absl::Span<const Slot> edges) {
                                              rows.Put(c, edges);
                                              return edges.size() * sizeof(Slot);
                                            }));
  cell_edges_ = std::move(rows);
  return absl::OkStatus();
}

void StoredRelations::OpenCrowds(const Mesh& mesh, StoredRows& table) {
  mesh.slots(EntityKind::kFace).live().ForEach([&](Slot f) {
    const auto cells = mesh.IncidentCells(FaceId(f));
    if (cells.size() <= kMaxJoinedUses) return;
    for (CellId c : cells) table.Open(c.slot());
  });
}

void StoredRelations::Drop(Relation relation) {
  if (!Has(relation)) return;
  if (StorableIndex(relation) == kCellEdges) {
    cell_edges_.reset();
  } else {
    tables_[StorableIndex(relation)].reset();
    --num_tables_;
  }
}

size_t StoredRelations::memory_bytes(Relation relation) const {
  if (!Has(relation)) return 0;
  return StorableIndex(relation) == kCellEdges ? cell_edges_->memory_bytes() : Find(relation)->memory_bytes();
}

// ---- Keeping current ----

void StoredRelations::Begin(EntityId id) {
  for (int i = 0; i < kNumStorableRelations; ++i) {
    if (tables_[i].has_value() && kStorableRelations[i].from == id.kind) tables_[i]->Reset(id.slot);
  }
}

void StoredRelations::CellLinked(const Mesh& mesh, CellId c) {
  if (cell_edges_.has_value() || tables_[kEdgeCells].has_value()) {
    std::array<Slot, kMaxElementEdges> edges;
    const size_t num_edges = TemplateOf(mesh.Type(c)).num_edges;
    for (size_t e = 0; e < num_edges; ++e) edges[e] = mesh.Edge(c, e).slot();
    if (cell_edges_.has_value()) cell_edges_->Put(c.slot(), absl::MakeConstSpan(edges.data(), num_edges));
    for (size_t e = 0; e < num_edges && tables_[kEdgeCells].has_value(); ++e) {
      tables_[kEdgeCells]->Insert(edges[e], c.slot());
    }
  }
  if (tables_[kVertexCells].has_value()) {
    for (VertexId v : mesh.Vertices(c)) tables_[kVertexCells]->Insert(v.slot(), c.slot());
  }
  if (tables_[kCellCells].has_value()) {
    for (OrientedFace oriented : mesh.Faces(c)) JoinCells(mesh, c, oriented.face());
  }
}

void StoredRelations::JoinCells(const Mesh& mesh, CellId c, FaceId f) {
  StoredRows& table = *tables_[kCellCells];
  const auto cells = mesh.IncidentCells(f);
  if (cells.size() > kMaxJoinedUses) {
    // A cell adds at most kMaxElementFaces uses: beyond those the rows of the others are open already.
    if (cells.size() > kMaxJoinedUses + kMaxElementFaces) return table.Open(c.slot());
    for (CellId other : cells) table.Open(other.slot());
    return;
  }
  for (CellId other : cells) {
    if (other == c) continue;
    table.Insert(c.slot(), other.slot());
    table.Insert(other.slot(), c.slot());
  }
}

void StoredRelations::CellUnlinking(const Mesh& mesh, CellId c) {
  if (tables_[kEdgeCells].has_value()) {
    for (int e = 0; e < TemplateOf(mesh.Type(c)).num_edges; ++e) {
      tables_[kEdgeCells]->Erase(mesh.Edge(c, e).slot(), c.slot());
    }
  }
  if (tables_[kVertexCells].has_value()) {
    for (VertexId v : mesh.Vertices(c)) tables_[kVertexCells]->Erase(v.slot(), c.slot());
  }
  if (!tables_[kCellCells].has_value()) return;
  StoredRows& table = *tables_[kCellCells];
  for (OrientedFace oriented : mesh.Faces(c)) {
    const auto cells = mesh.IncidentCells(oriented.face());
    if (cells.size() > kMaxJoinedUses) continue;  // the rows of all of them are open
    for (CellId other : cells) table.Erase(other.slot(), c.slot());
  }
  table.Reset(c.slot());
}

void StoredRelations::FaceLinked(const Mesh& mesh, FaceId f) {
  if (!tables_[kVertexFaces].has_value()) return;
  for (VertexId v : mesh.Vertices(f)) tables_[kVertexFaces]->Insert(v.slot(), f.slot());
}

void StoredRelations::FaceUnlinking(const Mesh& mesh, FaceId f) {
  if (!tables_[kVertexFaces].has_value()) return;
  for (VertexId v : mesh.Vertices(f)) tables_[kVertexFaces]->Erase(v.slot(), f.slot());
}

void StoredRelations::EdgeLinked(const Mesh& mesh, EdgeId e) {
  const auto ends = mesh.Vertices(e);
  if (!tables_[kVertexVertices].has_value() || ends[0] == ends[1]) return;
  tables_[kVertexVertices]->Insert(ends[0].slot(), ends[1].slot());
  tables_[kVertexVertices]->Insert(ends[1].slot(), ends[0].slot());
}

void StoredRelations::EdgeUnlinking(const Mesh& mesh, EdgeId e, bool last) {
  const auto ends = mesh.Vertices(e);
  if (!tables_[kVertexVertices].has_value() || !last) return;
  tables_[kVertexVertices]->Erase(ends[0].slot(), ends[1].slot());
  tables_[kVertexVertices]->Erase(ends[1].slot(), ends[0].slot());
}

}  // namespace dynmesh
