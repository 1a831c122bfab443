#include "core/delta/mirror.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "core/mesh/error.h"

namespace dynmesh {

absl::Status Mirror::Apply(const Delta& delta) {
  DYNMESH_RETURN_IF_ERROR(CheckDelta(delta));
  DYNMESH_RETURN_IF_ERROR(CheckFits(delta));
  DYNMESH_RETURN_IF_ERROR(CheckColumns(delta));
  for (EntityKind kind : {EntityKind::kEdge, EntityKind::kFace, EntityKind::kCell}) {
    ApplyElements(kind, delta.OfKind(kind));
  }
  for (Slot slot : delta.removed_vertices) RemoveVertex(slot);
  for (size_t i = 0; i < delta.vertex_slots.size(); ++i) PutVertex(delta.vertex_slots[i], delta.positions[i]);
  for (const AttributeChanges& changes : delta.attributes) ApplyAttributes(changes);
  return delta.consistent ? CheckEqual(delta) : absl::OkStatus();
}

absl::Status Mirror::CheckFits(const Delta& delta) const {
  if (delta.from_revision > revision_ || delta.to_revision < revision_) {
    return FailedPrecondition(reason::kRevisionMismatch,
                              absl::StrCat("the delta leads from revision ", delta.from_revision, " to ",
                                           delta.to_revision, ", this copy is at ", revision_));
  }
  Slot highest = delta.vertex_slots.empty() ? 0 : delta.vertex_slots.back();
  for (const ElementChanges& changes : delta.elements) {
    if (!changes.slots.empty()) highest = std::max(highest, changes.slots.back());
  }
  for (const AttributeChanges& changes : delta.attributes) {
    if (!changes.slots.empty()) highest = std::max(highest, changes.slots.back());
  }
  return highest < kMaxSlots ? absl::OkStatus() : LimitExceeded("max_mirror_slots", kMaxSlots, uint64_t{highest} + 1);
}

void Mirror::ApplyElements(EntityKind kind, const ElementChanges& changes) {
  for (Slot slot : changes.removed) RemoveElement(kind, slot);
  const VertexId* vertices = changes.vertices.data();
  for (size_t i = 0; i < changes.slots.size(); ++i) {
    PutElement(kind, changes.types[i], changes.slots[i], vertices);
    vertices += NumVertices(changes.types[i]);
  }
}

absl::Status Mirror::CheckEqual(const Delta& delta) {
  revision_ = delta.to_revision;
  const bool equal = checksum_.topology == delta.checksum.topology &&
                     (geometry_ == Geometry::kQuantized || checksum_.geometry == delta.checksum.geometry);
  if (equal) return absl::OkStatus();
  return MakeError(absl::StatusCode::kDataLoss, reason::kChecksumMismatch,
                   absl::StrCat("the copy differs from the session at revision ", delta.to_revision));
}

bool Mirror::HasVertex(VertexId v) const { return v.slot() < has_vertex_.size() && has_vertex_[v.slot()]; }

ElementType Mirror::TypeAt(EntityKind kind, Slot slot) const {
  const Table& table = elements_[Dimension(kind) - 1];
  return slot < table.types.size() ? table.types[slot] : ElementType::kUnspecified;
}

absl::Span<const VertexId> Mirror::VerticesAt(EntityKind kind, Slot slot) const {
  const Table& table = elements_[Dimension(kind) - 1];
  return absl::MakeConstSpan(&table.vertices[size_t{slot} * table.stride], NumVertices(table.types[slot]));
}

Slot Mirror::SlotLimit(EntityKind kind) const {
  return kind == EntityKind::kVertex ? has_vertex_.size() : elements_[Dimension(kind) - 1].types.size();
}

void Mirror::RemoveVertex(Slot slot) {
  if (!HasVertex(VertexId(slot))) return;
  checksum_.topology -= Checksum::VertexTerm(slot);
  checksum_.geometry -= Checksum::PositionTerm(slot, positions_[slot]);
  has_vertex_[slot] = false;
  --num_vertices_;
}

void Mirror::PutVertex(Slot slot, const Point& position) {
  RemoveVertex(slot);
  if (slot >= has_vertex_.size()) {
    positions_.resize(slot + 1);
    has_vertex_.resize(slot + 1);  // last: it says how many there are
  }
  has_vertex_[slot] = true;
  positions_[slot] = position;
  ++num_vertices_;
  checksum_.topology += Checksum::VertexTerm(slot);
  checksum_.geometry += Checksum::PositionTerm(slot, position);
}

void Mirror::RemoveElement(EntityKind kind, Slot slot) {
  const ElementType type = TypeAt(kind, slot);
  if (type == ElementType::kUnspecified) return;
  Table& table = elements_[Dimension(kind) - 1];
  checksum_.topology -= Checksum::ElementTerm(type, slot, VerticesAt(kind, slot));
  table.types[slot] = ElementType::kUnspecified;
  --table.count;
}

void Mirror::PutElement(EntityKind kind, ElementType type, Slot slot, const VertexId* vertices) {
  RemoveElement(kind, slot);
  Table& table = elements_[Dimension(kind) - 1];
  Widen(table, NumVertices(type));
  if (slot >= table.types.size()) {
    table.vertices.resize((size_t{slot} + 1) * table.stride);
    table.types.resize(slot + 1);  // last: it says how many there are
  }
  table.types[slot] = type;
  std::copy_n(vertices, NumVertices(type), &table.vertices[size_t{slot} * table.stride]);
  ++table.count;
  checksum_.topology += Checksum::ElementTerm(type, slot, VerticesAt(kind, slot));
}

void Mirror::Widen(Table& table, int stride) {
  if (stride <= table.stride) return;
  std::vector<VertexId> wide(table.types.size() * stride);
  for (size_t row = 0; row < table.types.size(); ++row) {
    std::copy_n(&table.vertices[row * table.stride], table.stride, &wide[row * stride]);
  }
  table.vertices = std::move(wide);
  table.stride = stride;
}

AttributeColumn* Mirror::FindColumn(const AttributeSpec& spec) {
  const auto column = std::find_if(attributes_.begin(), attributes_.end(), [&](const AttributeColumn& c) {
    return c.spec().name == spec.name && c.spec().kind == spec.kind;
  });
  return column == attributes_.end() ? nullptr : &*column;
}

absl::Status Mirror::CheckColumns(const Delta& delta) {
  for (const AttributeChanges& changes : delta.attributes) {
    const AttributeColumn* column = FindColumn(changes.spec);
    if (column != nullptr && column->spec() != changes.spec) {
      return MakeError(absl::StatusCode::kDataLoss, reason::kCorruptPayload,
                       absl::StrCat("attribute '", changes.spec.name, "' is described otherwise than before"));
    }
  }
  return absl::OkStatus();
}

void Mirror::ApplyAttributes(const AttributeChanges& changes) {
  AttributeColumn* column = FindColumn(changes.spec);
  if (column == nullptr) column = &attributes_.emplace_back(changes.spec);
  const size_t row_bytes = changes.spec.row_bytes();
  for (size_t i = 0; i < changes.slots.size(); ++i) {
    column->SetRow(changes.slots[i], absl::MakeConstSpan(changes.rows).subspan(i * row_bytes, row_bytes), 0);
  }
}

}  // namespace dynmesh
