#include "core/delta/diff.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>

namespace dynmesh {
namespace {

constexpr int kAttributeStage = 4;
constexpr int kDone = 5;
constexpr size_t kTypicalVertices = 4;  ///< of an element, for room

/// Room for `count` items more, in steps that keep appending linear.
template <typename T>
void MakeRoom(size_t count, std::vector<T>& items) {
  const size_t needed = items.size() + count;
  if (needed > items.capacity()) items.reserve(std::max(needed, 2 * items.capacity()));
}

/// Appends after-images of slots to a delta.
class DiffBuilder {
 public:
  DiffBuilder(const Mesh& mesh, int64_t from, Delta& delta)
      : mesh_(mesh), from_(static_cast<Stamp>(from)), delta_(delta) {}

  /// Visits slots from `cursor` on until `budget` slots have been appended; stops at page ends.
  void Advance(DiffCursor& cursor, size_t budget) {
    while (!cursor.done() && items_ < budget) {
      const Slot end = PageEnd(cursor, budget);
      VisitRange(cursor, end);
      cursor.next = end;
      if (end >= StageLimit(cursor)) NextStage(cursor);
    }
  }

 private:
  /// Everything at once when the budget is unlimited, else the next page of stamps.
  Slot PageEnd(const DiffCursor& cursor, size_t budget) const {
    const Slot limit = StageLimit(cursor);
    if (budget == std::numeric_limits<size_t>::max()) return limit;
    return std::min<uint64_t>(limit, uint64_t{cursor.next} + StampColumn::kPageSlots);
  }

  Slot StageLimit(const DiffCursor& cursor) const {
    if (cursor.stage < kAttributeStage) return mesh_.changed(kEntityKinds[cursor.stage]).size();
    const auto& columns = mesh_.attributes();
    return cursor.column < static_cast<int>(columns.size()) ? columns[cursor.column].stamps().size() : 0;
  }

  void NextStage(DiffCursor& cursor) const {
    cursor.next = 0;
    if (cursor.stage == kAttributeStage) ++cursor.column;
    if (cursor.stage < kAttributeStage) ++cursor.stage;
    if (cursor.stage == kAttributeStage && cursor.column >= static_cast<int>(mesh_.attributes().size())) {
      cursor.stage = kDone;
    }
  }

  void VisitRange(const DiffCursor& cursor, Slot end) {
    if (cursor.stage == kAttributeStage) return VisitRows(cursor, end);
    const EntityKind kind = kEntityKinds[cursor.stage];
    const size_t count = mesh_.changed(kind).CountSince(from_, cursor.next, end);
    if (count == 0) return;
    items_ += count;
    kind == EntityKind::kVertex ? VisitVertices(cursor.next, end, count)
                                : VisitElements(kind, cursor.next, end, count);
  }

  /// Calls whole(begin, end) for pages of [begin, end) all of whose slots changed and live, and one(slot) for
  /// every other slot that changed.
  template <typename Whole, typename One>
  void ForEachChange(EntityKind kind, Slot begin, Slot end, Whole whole, One one) const {
    const StampColumn& stamps = mesh_.changed(kind);
    const BitSet& live = mesh_.slots(kind).live();
    for (Slot page = begin; page < end;) {
      const Slot next =
          std::min<uint64_t>(end, (page / StampColumn::kPageSlots + 1) * uint64_t{StampColumn::kPageSlots});
      if (stamps.AreAllSince(from_, page, next) && live.TestAll(page, next)) {
        whole(page, next);
      } else {
        stamps.ForEachSince(from_, page, next, one);
      }
      page = next;
    }
  }

  /// Of `count` changed slots in [begin, end).
  void VisitVertices(Slot begin, Slot end, size_t count) {
    MakeRoom(count, delta_.vertex_slots);
    MakeRoom(count, delta_.positions);
    const auto whole = [&](Slot first, Slot last) {
      AppendRange(first, last, delta_.vertex_slots);
      const Point* positions = &mesh_.Position(VertexId(first));
      delta_.positions.insert(delta_.positions.end(), positions, positions + (last - first));
    };
    ForEachChange(EntityKind::kVertex, begin, end, whole, [&](Slot slot) {
      if (!mesh_.IsLive(VertexId(slot))) return delta_.removed_vertices.push_back(slot);
      delta_.vertex_slots.push_back(slot);
      delta_.positions.push_back(mesh_.Position(VertexId(slot)));
    });
  }

  void VisitElements(EntityKind kind, Slot begin, Slot end, size_t count) {
    ElementChanges& changes = delta_.OfKind(kind);
    MakeRoom(count, changes.slots);
    MakeRoom(count, changes.types);
    MakeRoom(count * kTypicalVertices, changes.vertices);
    if (kind == EntityKind::kCell && mesh_.IsTetrahedral()) return VisitTetrahedra(begin, end, changes);
    VisitEach(kind, begin, end, changes);
  }

  void VisitTetrahedra(Slot begin, Slot end, ElementChanges& changes) {
    const auto whole = [&](Slot first, Slot last) {
      AppendRange(first, last, changes.slots);
      changes.types.insert(changes.types.end(), last - first, ElementType::kTetrahedron);
      const VertexId* vertices = mesh_.Vertices(CellId(first)).data();
      changes.vertices.insert(changes.vertices.end(), vertices, vertices + 4 * size_t{last - first});
    };
    ForEachChange(EntityKind::kCell, begin, end, whole,
                  [&](Slot slot) { VisitEach(EntityKind::kCell, slot, slot + 1, changes); });
  }

  void VisitEach(EntityKind kind, Slot begin, Slot end, ElementChanges& changes) {
    mesh_.changed(kind).ForEachSince(from_, begin, end, [&](Slot slot) {
      const EntityId id(kind, slot);
      if (!mesh_.IsLive(id) || !mesh_.IsElement(id)) return changes.removed.push_back(slot);
      const auto vertices = mesh_.VerticesOf(id);
      changes.slots.push_back(slot);
      changes.types.push_back(mesh_.Type(id));
      changes.vertices.insert(changes.vertices.end(), vertices.begin(), vertices.end());
    });
  }

  static void AppendRange(Slot begin, Slot end, std::vector<Slot>& slots) {
    std::array<Slot, StampColumn::kPageSlots> range;
    std::iota(range.begin(), range.begin() + (end - begin), begin);
    slots.insert(slots.end(), range.begin(), range.begin() + (end - begin));
  }

  /// Rows of dead slots travel too, as the defaults that removal left: derived entities die unseen by a mirror.
  void VisitRows(const DiffCursor& cursor, Slot end) {
    if (cursor.column >= static_cast<int>(mesh_.attributes().size())) return;
    const AttributeColumn& column = mesh_.attributes()[cursor.column];
    AttributeChanges changes;
    changes.spec = column.spec();
    column.stamps().ForEachSince(from_, cursor.next, end, [&](Slot slot) {
      ++items_;
      const auto row = column.Row(slot);
      changes.slots.push_back(slot);
      changes.rows.insert(changes.rows.end(), row.begin(), row.end());
    });
    const bool news = !changes.slots.empty() || (column.born() > from_ && cursor.next == 0);
    if (news) Append(std::move(changes));
  }

  /// Joins pages of the same column.
  void Append(AttributeChanges changes) {
    if (!delta_.attributes.empty() && delta_.attributes.back().spec == changes.spec) {
      AttributeChanges& last = delta_.attributes.back();
      last.slots.insert(last.slots.end(), changes.slots.begin(), changes.slots.end());
      last.rows.insert(last.rows.end(), changes.rows.begin(), changes.rows.end());
    } else {
      delta_.attributes.push_back(std::move(changes));
    }
  }

  const Mesh& mesh_;
  const Stamp from_;
  Delta& delta_;
  size_t items_ = 0;
};

Delta EmptyDelta(const Mesh& mesh, int64_t from) {
  Delta delta;
  delta.from_revision = from;
  delta.to_revision = mesh.revision();
  delta.checksum = mesh.checksum();
  return delta;
}

}  // namespace

Delta Diff(const Mesh& mesh, int64_t from) {
  Delta delta = EmptyDelta(mesh, from);
  DiffCursor cursor;
  DiffBuilder(mesh, from, delta).Advance(cursor, std::numeric_limits<size_t>::max());
  return delta;
}

Delta ClosingDiff(const Mesh& mesh, int64_t start, int64_t base) {
  Delta delta = Diff(mesh, start);
  delta.from_revision = base;
  return delta;
}

Delta DiffPart(const Mesh& mesh, int64_t from, size_t max_items, DiffCursor& cursor) {
  Delta delta = EmptyDelta(mesh, from);
  delta.consistent = false;
  DiffBuilder(mesh, from, delta).Advance(cursor, std::max<size_t>(max_items, 1));
  return delta;
}

size_t DiffSizeBound(const Mesh& mesh, int64_t from) {
  size_t bound = 0;
  for (EntityKind kind : kEntityKinds) bound += mesh.changed(kind).BoundSince(from);
  for (const AttributeColumn& column : mesh.attributes()) bound += column.stamps().BoundSince(from);
  return bound;
}

}  // namespace dynmesh
