#ifndef DYNMESH_CORE_MESH_SLOTS_H_
#define DYNMESH_CORE_MESH_SLOTS_H_

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/mesh/bit_set.h"
#include "core/mesh/ids.h"
#include "core/mesh/stamps.h"

namespace dynmesh {

/// Which slots of one kind are live, when their occupants were born, and which may be used again.
///
/// A freed slot goes into quarantine until EndQuarantine() (called at each commit), so within a batch no
/// slot has two occupants; what stood in its arrays stays readable and can be put back. After that the
/// lowest free slot is handed out first. Only who saves what the arrays hold may Recycle() a slot sooner.
/// Cost: all O(1), but Allocate which skips 4096 used slots at a time.
class Slots {
 public:
  struct Allocation {
    Slot slot;
    Stamp born_before;  ///< birth of the occupant before, 0 for a slot that was never used
    bool at_end;        ///< the slot lies at the end: arrays may have to grow
  };

  /// The lowest reusable slot, or a new one at the end.
  Allocation Allocate(Stamp born) {
    Slot slot = free_.empty() ? kNoSlot : free_.Next(first_free_hint_);
    const bool at_end = slot == kNoSlot;
    if (at_end) {
      slot = limit_++;
    } else {
      free_.Clear(slot);
      first_free_hint_ = slot;
    }
    const Stamp born_before = born_.At(slot);
    born_.Touch(slot, born);
    live_.Set(slot);
    return {slot, born_before, at_end};
  }

  /// Allocates this slot, which a former occupant is to have again. REQUIRES: IsFree(slot).
  Allocation AllocateAt(Slot slot, Stamp born) {
    const Stamp born_before = born_.At(slot);
    free_.Clear(slot);
    born_.Touch(slot, born);
    live_.Set(slot);
    return {slot, born_before, /*at_end=*/false};
  }

  /// Allocates slots 0 to count - 1. REQUIRES: none was ever used.
  void AllocateFirst(Slot count, Stamp born) {
    live_.Fill(count);
    born_.TouchFirst(count, born);
    limit_ = count;
  }

  /// Whether Allocate() can be called `count` times without the limit passing `max_slots`.
  bool CanAllocate(uint32_t count, uint32_t max_slots) const {
    return limit_ <= max_slots && free_.size() + (max_slots - limit_) >= count;
  }

  /// Ends the life at `slot` and quarantines it.
  void Free(Slot slot) {
    live_.Clear(slot);
    quarantine_.push_back(slot);
  }

  /// Undoes the latest Free(slot) that was not undone. REQUIRES: no EndQuarantine() since.
  void UndoFree(Slot slot) {
    quarantine_.pop_back();
    live_.Set(slot);
  }

  /// Undoes the latest Allocate() that was not undone, which gave `slot` when its stamp was `born_before`.
  void UndoAllocate(Slot slot, Stamp born_before) {
    live_.Clear(slot);
    born_.Restore(slot, born_before);  // so that a slot beyond the limit reads as never used
    if (born_before == 0 && slot + 1 == limit_) {
      --limit_;
    } else {
      MakeFree(slot);
    }
  }

  /// Makes a quarantined slot free for AllocateAt(), which must follow.
  void Recycle(Slot slot) { free_.Set(slot); }

  /// Undoes Recycle(slot). REQUIRES: what was allocated there since is undone.
  void UndoRecycle(Slot slot) { free_.Clear(slot); }

  /// Slots freed so far may be handed out again.
  void EndQuarantine() {
    for (Slot slot : quarantine_) {
      if (!live_.Test(slot)) MakeFree(slot);  // else it was recycled
    }
    quarantine_.clear();
  }

  /// For who rebuilds a mesh from what was kept of it: someone born then lives at a slot, or did. FreeDead()
  /// must follow the last of these.
  void PutLive(Slot slot, Stamp born) {
    live_.Set(slot);
    PutBirth(slot, born);
  }
  void PutDead(Slot slot, Stamp born) {
    live_.Clear(slot);
    PutBirth(slot, born);
  }

  /// Makes all slots free in which nobody lives. REQUIRES: all below the limit were put.
  void FreeDead() {
    for (Slot slot = 0; slot < limit_; ++slot) {
      if (!live_.Test(slot)) free_.Set(slot);
    }
    first_free_hint_ = 0;
  }

  /// Whether the slot had an occupant and may have another one now.
  bool IsFree(Slot slot) const { return free_.Test(slot); }
  bool IsLive(Slot slot) const { return live_.Test(slot); }
  /// Revision at which the present or last occupant was born; 0: the slot was never used.
  Stamp Born(Slot slot) const { return slot < limit_ ? born_.At(slot) : 0; }
  /// Births by slot, for "what was born since"; those of slots beyond the limit are void.
  const StampColumn& births() const { return born_; }
  const BitSet& live() const { return live_; }
  uint32_t num_live() const { return live_.size(); }
  /// One past the highest slot that was ever used.
  Slot limit() const { return limit_; }
  /// Whether no slot is free and live or quarantined, and none lies beyond the limit.
  bool IsSound() const {
    bool sound = live_.Next(limit_) == kNoSlot && free_.Next(limit_) == kNoSlot;
    free_.ForEach([&](Slot slot) { sound = sound && !live_.Test(slot); });
    for (Slot slot : quarantine_) sound = sound && !free_.Test(slot);
    return sound;
  }
  void Reserve(size_t slots) { born_.Reserve(slots); }
  size_t memory_bytes() const {
    return live_.memory_bytes() + free_.memory_bytes() + quarantine_.size() * sizeof(Slot) +
           born_.memory_bytes();
  }

 private:
  void PutBirth(Slot slot, Stamp born) {
    born_.Touch(slot, born);
    if (slot >= limit_) limit_ = slot + 1;
  }

  void MakeFree(Slot slot) {
    free_.Set(slot);
    if (slot < first_free_hint_) first_free_hint_ = slot;
  }

  BitSet live_;
  BitSet free_;
  std::vector<Slot> quarantine_;
  StampColumn born_;
  Slot limit_ = 0;
  Slot first_free_hint_ = 0;  ///< no free slot lies below
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_MESH_SLOTS_H_
