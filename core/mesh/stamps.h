#ifndef DYNMESH_CORE_MESH_STAMPS_H_
#define DYNMESH_CORE_MESH_STAMPS_H_

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/mesh/ids.h"
#include "core/mesh/pipeline.h"

namespace dynmesh {

/// A revision, in the width that is stored for each slot. 0 = never. Meshes refuse to go beyond kMaxStamp.
using Stamp = uint32_t;
inline constexpr Stamp kMaxStamp = 0xfffffffeu;

/// For each slot the revision that last changed it, with a maximum for each page of 512 slots, so that
/// "what changed since r" costs nothing for pages that nobody touched.
///
/// Cost: Touch O(1); ForEachSince O(pages + slots of touched pages).
/// Thread safety: that of std::vector.
class StampColumn {
 public:
  static constexpr Slot kPageSlots = 512;

  /// 0 for slots that were never touched.
  Stamp At(Slot slot) const { return slot < stamps_.size() ? stamps_[slot] : 0; }

  void Touch(Slot slot, Stamp stamp) {
    const Slot page = slot / kPageSlots;
    if (slot >= stamps_.size()) Grow(page + 1);
    stamps_[slot] = stamp;
    page_max_[page] = std::max(page_max_[page], stamp);
  }

  /// Touches slots 0 to count - 1. REQUIRES: none was ever touched.
  void TouchFirst(Slot count, Stamp stamp) {
    stamps_.reserve(count + count / 16);
    stamps_.assign(count, stamp);
    page_max_.assign((size_t{count} + kPageSlots - 1) / kPageSlots, stamp);
  }

  /// Puts back an older stamp. The page's maximum stays, which costs a later scan but never an answer.
  void Restore(Slot slot, Stamp stamp) {
    if (slot < stamps_.size()) stamps_[slot] = stamp;
  }

  /// Asks memory for the stamp of a slot.
  void PrefetchStamp(Slot slot) const { Prefetch(stamps_.data() + slot); }

  void Reserve(size_t slots) {
    stamps_.reserve(slots);
    page_max_.reserve(slots / kPageSlots + 1);
  }

  /// Calls fn(slot) in ascending order for each slot of [begin, end) whose stamp is greater than `since`.
  template <typename Fn>
  void ForEachSince(Stamp since, Slot begin, Slot end, Fn fn) const {
    end = std::min<Slot>(end, stamps_.size());
    for (Slot slot = begin; slot < end;) {
      const Slot page_end = std::min<Slot>(end, (slot / kPageSlots + 1) * kPageSlots);
      if (page_max_[slot / kPageSlots] > since) {
        for (; slot < page_end; ++slot) {
          if (stamps_[slot] > since) fn(slot);
        }
      }
      slot = page_end;
    }
  }

  /// Whether all slots of [begin, end) have a stamp greater than `since`.
  bool AreAllSince(Stamp since, Slot begin, Slot end) const {
    if (begin < end && (end > stamps_.size() || page_max_[begin / kPageSlots] <= since)) return false;
    Stamp oldest = kMaxStamp;
    for (Slot slot = begin; slot < end; ++slot) oldest = std::min(oldest, stamps_[slot]);
    return oldest > since;
  }

  /// How many slots of [begin, end) have a stamp greater than `since`. Cost: as ForEachSince.
  size_t CountSince(Stamp since, Slot begin, Slot end) const {
    size_t count = 0;
    end = std::min<Slot>(end, stamps_.size());
    for (Slot slot = begin; slot < end;) {
      const Slot page_end = std::min<Slot>(end, (slot / kPageSlots + 1) * kPageSlots);
      if (page_max_[slot / kPageSlots] > since) {
        for (Slot s = slot; s < page_end; ++s) count += stamps_[s] > since;
      }
      slot = page_end;
    }
    return count;
  }

  /// No fewer than the slots whose stamp is greater than `since`: whole pages. Cost: O(pages).
  size_t BoundSince(Stamp since) const {
    const auto pages =
        std::count_if(page_max_.begin(), page_max_.end(), [&](Stamp max) { return max > since; });
    return std::min<size_t>(pages * kPageSlots, stamps_.size());
  }

  /// Whether no stamp is later than its page says.
  bool IsSound() const {
    for (Slot slot = 0; slot < stamps_.size(); ++slot) {
      if (stamps_[slot] > page_max_[slot / kPageSlots]) return false;
    }
    return true;
  }

  /// No slot from here on was ever touched.
  Slot size() const { return stamps_.size(); }
  size_t memory_bytes() const { return (stamps_.size() + page_max_.size()) * sizeof(Stamp); }

 private:
  /// Whole pages at once.
  [[gnu::noinline]] void Grow(size_t pages) {
    stamps_.resize(pages * kPageSlots);
    page_max_.resize(pages);
  }

  std::vector<Stamp> stamps_;
  std::vector<Stamp> page_max_;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_MESH_STAMPS_H_
