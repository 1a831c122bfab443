#include "core/archive/slot_rows.h"

#include "core/mesh/vector.h"

namespace dynmesh {
namespace {

// A tag: the type, or 1 for a vertex, or 0 where nobody lives; then bits.
constexpr uint8_t kTagType = 7;
constexpr uint8_t kTagElement = 8;
constexpr uint8_t kTagDuplicate = 16;
constexpr uint8_t kTagBorn = 32;     ///< another birth than in the row before
constexpr uint8_t kTagChanged = 64;  ///< another change
constexpr uint8_t kTagVertex = 1;

}  // namespace

// ---- Writing ----

void SlotRowWriter::Write(Slot slot) {
  const EntityId id(kind_, slot);
  const bool live = mesh_.IsLive(id);
  uint8_t tag = live ? TagOf(id) : 0;
  if (mesh_.slots(kind_).Born(slot) != last_.born) tag |= kTagBorn;
  if (mesh_.changed(kind_).At(slot) != last_.changed) tag |= kTagChanged;
  row_.Fixed<uint8_t>(tag);
  WriteStamps(slot, tag);
  if (live) WriteContent(id);
  row_.MoveTo(out_);
}

uint8_t SlotRowWriter::TagOf(EntityId id) const {
  if (kind_ == EntityKind::kVertex) return kTagVertex;
  return static_cast<uint8_t>(mesh_.Type(id)) | (mesh_.IsElement(id) ? kTagElement : 0) |
         (mesh_.IsDuplicate(id) ? kTagDuplicate : 0);
}

void SlotRowWriter::WriteStamps(Slot slot, uint8_t tag) {
  const Stamp born = mesh_.slots(kind_).Born(slot), changed = mesh_.changed(kind_).At(slot);
  if (tag & kTagBorn) WriteDifference(born, last_.born, row_);
  if (tag & kTagChanged) WriteDifference(changed, last_.changed, row_);
  last_.born = born;
  last_.changed = changed;
}

void SlotRowWriter::WriteContent(EntityId id) {
  if (kind_ == EntityKind::kVertex) return row_.Fixed<Point>(mesh_.Position(VertexId(id.slot)));
  WriteSlots(mesh_.VerticesOf(id), last_.vertex, [](VertexId v) { return v.slot(); });
  if (kind_ == EntityKind::kFace) {
    WriteSlots(mesh_.Edges(FaceId(id.slot)), last_.part, [](EdgeId e) { return e.slot(); });
  } else if (kind_ == EntityKind::kCell) {
    WriteSlots(mesh_.Faces(CellId(id.slot)), last_.part,
               [](OrientedFace oriented) { return oriented.face().slot(); });
  }
}

/// The first against the first of the row before, the others against the one before in the row.
template <typename Items, typename SlotOf>
void SlotRowWriter::WriteSlots(const Items& items, Slot& last, SlotOf slot_of) {
  Slot before = last;
  last = slot_of(items[0]);
  for (const auto& item : items) {
    const Slot slot = slot_of(item);
    WriteDifference(slot, before, row_);
    before = slot;
  }
}

// ---- Reading ----

bool SlotRowReader::Read(SlotRow& row) {
  const uint8_t tag = in_.Fixed<uint8_t>();
  return ReadTag(tag, row) && ReadStamps(tag, row) && (!row.live || ReadContent(row)) && in_.ok();
}

bool SlotRowReader::ReadTag(uint8_t tag, SlotRow& row) const {
  const int type = tag & kTagType;
  const bool vertex = kind_ == EntityKind::kVertex;
  row.live = type != 0;
  row.element = tag & kTagElement;
  row.duplicate = tag & kTagDuplicate;
  row.type = vertex ? ElementType::kUnspecified : static_cast<ElementType>(type);
  if (tag > (kTagType | kTagElement | kTagDuplicate | kTagBorn | kTagChanged)) return false;
  if (!row.live || vertex) return !row.element && !row.duplicate && type <= kTagVertex;
  if (KindOf(row.type) != kind_ || (row.duplicate && !row.element)) return false;
  return kind_ != EntityKind::kCell || (row.element && !row.duplicate);
}

bool SlotRowReader::ReadStamps(uint8_t tag, SlotRow& row) {
  row.born = last_.born;
  row.changed = last_.changed;
  if (tag & kTagBorn && !ReadDifference(in_, last_.born, row.born)) return false;
  if (tag & kTagChanged && !ReadDifference(in_, last_.changed, row.changed)) return false;
  last_.born = row.born;
  last_.changed = row.changed;
  return row.born >= 1 && row.born <= kMaxStamp && row.changed <= kMaxStamp;
}

bool SlotRowReader::ReadContent(SlotRow& row) {
  if (kind_ == EntityKind::kVertex) {
    row.position = in_.Fixed<Point>();
    return IsFinite(row.position);
  }
  if (!ReadSlots(row.num_vertices(), limits_.max_slots[0], last_.vertex, row.vertices.data())) return false;
  const int num_parts = NumParts(row.type);
  if (num_parts == 0) return true;
  return ReadSlots(num_parts, limits_.max_slots[Dimension(kind_) - 1], last_.part, row.parts.data());
}

bool SlotRowReader::ReadSlots(int count, Slot limit, Slot& last, Slot* slots) {
  Slot before = last;
  bool sound = true;
  for (int k = 0; k < count; ++k) {
    sound &= ReadDifference(in_, before, slots[k]) & (slots[k] < limit);
    before = slots[k];
  }
  last = slots[0];
  return sound;
}

}  // namespace dynmesh
