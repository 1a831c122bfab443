// Undoing journal entries, last first.
//
// A slot that was freed in the batch has had no other occupant since, so the arrays still hold what stood
// there, or are given it again by kRecycle: putting an entity back means linking it again.

#include "core/mesh/mesh.h"

namespace dynmesh {

void Mesh::Rollback() {
  RollbackTo(0);
  batch_open_ = false;
  journal_.Clear();
}

void Mesh::RollbackTo(Savepoint savepoint) {
  batch_open_ = false;  // undoing is not recorded
  while (journal_.entries.size() > savepoint) {
    const JournalEntry entry = journal_.entries.back();
    journal_.entries.pop_back();
    Undo(entry);
  }
  batch_open_ = true;
}

void Mesh::Undo(const JournalEntry& entry) {
  const EntityId id(entry.kind, entry.slot);
  switch (entry.op) {
    case JournalOp::kRecycle:
      return UndoRecycle(id);
    case JournalOp::kCreate:
      return UndoCreate(entry);
    case JournalOp::kDestroy:
      return UndoDestroy(entry);
    case JournalOp::kSetElement:
      ClearElementFlag(id);
      return changed_[Dimension(id.kind)].Restore(id.slot, entry.b);
    case JournalOp::kClearElement:
      SetElementFlag(id);
      return changed_[Dimension(id.kind)].Restore(id.slot, entry.b);
    case JournalOp::kSetDuplicate:
      return SetDuplicateFlag(id, false);
    case JournalOp::kClearDuplicate:
      return SetDuplicateFlag(id, true);
    case JournalOp::kFlipEdge:
      return FlipEdge(EdgeId(id.slot));
    case JournalOp::kReorderFace:
      return ReorderFace(FaceId(id.slot), FaceCode{static_cast<uint8_t>(entry.a)});
    case JournalOp::kMoveVertex:
      return UndoMove(entry);
    case JournalOp::kAddAttribute:
      return attributes_.pop_back();
    case JournalOp::kSetAttribute:
      return UndoSetAttribute(entry);
  }
}

void Mesh::UndoCreate(const JournalEntry& entry) {
  switch (entry.kind) {
    case EntityKind::kVertex: {
      const VertexId v(entry.slot);
      checksum_.topology -= Checksum::VertexTerm(v.slot());
      checksum_.geometry -= Checksum::PositionTerm(v.slot(), Position(v));
      break;
    }
    case EntityKind::kEdge:
      UnlinkEdge(EdgeId(entry.slot));
      break;
    case EntityKind::kFace:
      UnlinkFace(FaceId(entry.slot));
      break;
    case EntityKind::kCell:
      UnlinkCell(CellId(entry.slot));
      SettleBoundary(CellId(entry.slot));
      break;
  }
  const EntityId id(entry.kind, entry.slot);
  if (IsElement(id)) CountElement(id, -1);
  if (IsDuplicate(id)) CountDuplicate(id, -1);
  mutable_slots(entry.kind).UndoAllocate(entry.slot, entry.a);
  changed_[Dimension(entry.kind)].Restore(entry.slot, entry.b);
}

void Mesh::UndoRecycle(EntityId id) {
  mutable_slots(id.kind).UndoRecycle(id.slot);
  if (id.kind == EntityKind::kVertex) {
    positions_[id.slot] = journal_.positions.back();
    return journal_.positions.pop_back();
  }
  const SlotContent& content = journal_.contents.back();
  flags(id) = content.flags;
  const size_t num_vertices = NumVertices(Type(id));
  const auto end = content.vertices.begin() + num_vertices;
  if (id.kind == EntityKind::kEdge) {
    std::copy(content.vertices.begin(), end, edge_vertices_[id.slot].begin());
  } else if (id.kind == EntityKind::kFace) {
    const size_t row = size_t{id.slot} * face_stride_;
    std::copy(content.vertices.begin(), end, face_vertices_.begin() + row);
    std::transform(content.parts.begin(), content.parts.begin() + num_vertices, face_edges_.begin() + row,
                   [](Slot slot) { return EdgeId(slot); });
  } else {
    std::copy(content.vertices.begin(), end, cell_vertices_.begin() + size_t{id.slot} * cell_vertex_stride_);
    std::transform(content.parts.begin(), content.parts.begin() + TemplateOf(Type(id)).num_faces,
                   cell_faces_.begin() + size_t{id.slot} * cell_face_stride_,
                   [](uint32_t packed) { return OrientedFace::FromPacked(packed); });
  }
  journal_.contents.pop_back();
}

void Mesh::UndoDestroy(const JournalEntry& entry) {
  mutable_slots(entry.kind).UndoFree(entry.slot);
  switch (entry.kind) {
    case EntityKind::kVertex: {
      const VertexId v(entry.slot);
      checksum_.topology += Checksum::VertexTerm(v.slot());
      checksum_.geometry += Checksum::PositionTerm(v.slot(), Position(v));
      break;
    }
    case EntityKind::kEdge:
      LinkEdge(EdgeId(entry.slot));
      break;
    case EntityKind::kFace:
      LinkFace(FaceId(entry.slot));
      break;
    case EntityKind::kCell:
      LinkCell(CellId(entry.slot));
      SettleBoundary(CellId(entry.slot));
      CountElement(CellId(entry.slot), +1);
      break;
  }
  const EntityId id(entry.kind, entry.slot);
  if (IsDuplicate(id)) CountDuplicate(id, +1);
  if (entry.kind == EntityKind::kVertex || entry.kind == EntityKind::kCell) {
    changed_[Dimension(entry.kind)].Restore(entry.slot, entry.b);
  }
}

void Mesh::UndoMove(const JournalEntry& entry) {
  const VertexId v(entry.slot);
  checksum_.geometry -= Checksum::PositionTerm(v.slot(), Position(v));
  positions_[v.slot()] = journal_.positions.back();
  journal_.positions.pop_back();
  checksum_.geometry += Checksum::PositionTerm(v.slot(), Position(v));
  changed_[0].Restore(v.slot(), entry.b);
}

void Mesh::UndoSetAttribute(const JournalEntry& entry) {
  AttributeColumn& column = attributes_[entry.a];
  const size_t row_bytes = column.spec().row_bytes();
  const auto row = absl::MakeConstSpan(journal_.rows).last(row_bytes);
  column.RestoreRow(entry.slot, row, entry.b);
  journal_.rows.resize(journal_.rows.size() - row_bytes);
}

}  // namespace dynmesh
