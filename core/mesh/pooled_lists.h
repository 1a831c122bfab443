#ifndef DYNMESH_CORE_MESH_POOLED_LISTS_H_
#define DYNMESH_CORE_MESH_POOLED_LISTS_H_

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/types/span.h"
#include "core/mesh/erase_ascending.h"
#include "core/mesh/ids.h"
#include "core/mesh/pipeline.h"

namespace dynmesh {

/// Many small lists in one pool, a list for each slot. Lists are contiguous; a list that outgrows its room
/// moves to a larger one, and rooms are recycled by size class, so no list has a heap block of its own.
///
/// Cost: PushBack and PopBack amortised O(1). Invalidates: both invalidate all spans.
/// Thread safety: that of std::vector.
template <typename T>
class PooledLists {
 public:
  static constexpr uint32_t kMaxLength = 50'000'000;
  /// Of all lists together, with a margin for the room that size classes leave.
  static constexpr uint64_t kMaxEntries = 0xc0000000u;

  /// So many entries can be read from the begin of each list, however short it is; behind a longer list
  /// kListMargin.
  static constexpr size_t kReadable = 8;

  absl::Span<const T> Of(Slot slot) const {
    const List& list = slot < lists_.size() ? lists_[slot] : kNoList;
    return absl::MakeConstSpan(pool_.data() + list.offset, list.length);
  }
  absl::Span<T> MutableOf(Slot slot) {
    const List& list = lists_[slot];
    return absl::MakeSpan(pool_.data() + list.offset, list.length);
  }

  /// Ask memory for where a list stands, and for what it holds.
  void PrefetchList(Slot slot) const { Prefetch(lists_.data() + slot); }
  void PrefetchEntries(Slot slot) const { Prefetch(Of(slot).data()); }

  Slot size() const { return lists_.size(); }
  uint32_t Length(Slot slot) const { return slot < lists_.size() ? lists_[slot].length : 0; }

  /// Whether `count` entries more have room within the 32-bit limits, whatever list they go to.
  bool HasRoom(uint32_t count) const { return longest_ + count <= kMaxLength && end_ < kMaxPool; }

  /// `first_room`: room that an empty list is given, 1-8; what most lists will need saves them moves.
  void PushBack(Slot slot, T value, uint32_t first_room = 2) {
    if (slot >= lists_.size()) lists_.resize(slot + 1);
    const uint32_t size_class = lists_[slot].size_class;
    if (lists_[slot].length == Capacity(size_class))
      Move(slot, size_class == 0 ? first_room : NextClass(size_class));
    List& list = lists_[slot];
    pool_[list.offset + list.length++] = value;
    longest_ = std::max<uint32_t>(longest_, list.length);
  }

  /// REQUIRES: the list is not empty.
  void PopBack(Slot slot) {
    List& list = lists_[slot];
    --list.length;
    if (list.length < Capacity(list.size_class) / 2 && list.size_class > kSmallClasses) {
      Move(slot, ClassFor(list.length + list.length / 4), 0);
    } else if (list.length == 0) {
      Move(slot, 0);
    }
  }

  /// Empties a list and recycles its room.
  void Clear(Slot slot) {
    if (slot >= lists_.size()) return;
    lists_[slot].length = 0;
    Move(slot, 0);
  }

  /// Makes empty lists 0, 1, ... with room for `lengths` entries. REQUIRES: no list yet; fewer than
  /// kMaxEntries in all.
  void Layout(absl::Span<const uint32_t> lengths) {
    lists_.reserve(lengths.size() + lengths.size() / 16);
    lists_.resize(lengths.size());
    uint64_t offset = 0;
    for (size_t i = 0; i < lengths.size(); ++i) {
      lists_[i].size_class = ClassFor(lengths[i]);
      lists_[i].offset = offset;
      offset += Capacity(lists_[i].size_class);
      longest_ = std::max(longest_, lengths[i]);
    }
    end_ = offset;
    pool_.reserve(offset + offset / 16 + kReadable);
    pool_.resize(offset + kReadable);
  }

  /// PushBack into a room made by Layout().
  void Append(Slot slot, T value) {
    List& list = lists_[slot];
    pool_[list.offset + list.length++] = value;
  }

  void Reserve(size_t lists, size_t entries) {
    lists_.reserve(lists);
    pool_.reserve(entries);
  }

  size_t memory_bytes() const {
    size_t bytes = lists_.size() * sizeof(List) + pool_.size() * sizeof(T);
    for (const auto& rooms : free_rooms_) bytes += rooms.size() * sizeof(uint32_t);
    return bytes;
  }

 private:
  // Size classes: 0 has no room; 1..8 hold 1..8; then four a doubling up to 256 (class 28), then two.
  static constexpr uint32_t kSmallClasses = 8;
  static constexpr int kNumClasses = 64;
  static constexpr uint32_t kSpareClasses = 3;  ///< so much larger may a recycled room be
  static constexpr uint64_t kMaxPool = 0xf0000000u;
  static constexpr size_t kGrowth = 1024;  ///< entries: rooms are many and small
  static_assert(kGrowth >= kReadable);

  static constexpr std::array<uint32_t, kNumClasses> MakeCapacities() {
    std::array<uint32_t, kNumClasses> capacities{};
    uint32_t base = 8;
    int c = 0;
    for (; c <= 8; ++c) capacities[c] = c;
    for (; base < 256; base *= 2) {
      for (int quarter = 1; quarter <= 4; ++quarter) capacities[c++] = base + base / 4 * quarter;
    }
    for (; c < kNumClasses; base *= 2) {
      for (int half = 1; half <= 2 && c < kNumClasses; ++half) capacities[c++] = base + base / 2 * half;
    }
    return capacities;
  }
  static constexpr std::array<uint32_t, kNumClasses> kCapacities = MakeCapacities();
  static_assert(kReadable >= kListMargin);
  static_assert(kCapacities[kNumClasses - 1] >= kMaxLength);

  struct List {
    uint32_t offset = 0;
    uint32_t length : 26 = 0;
    uint32_t size_class : 6 = 0;
  };

  static constexpr List kNoList = {};

  static uint32_t Capacity(uint32_t size_class) { return kCapacities[size_class]; }

  /// Small lists grow by two: each room that is left behind waits for another list to need its size.
  static uint32_t NextClass(uint32_t size_class) {
    return size_class < kSmallClasses ? size_class + 2 - size_class % 2 : size_class + 1;
  }

  static uint32_t ClassFor(uint32_t length) {
    if (length <= kSmallClasses) return length;
    return std::lower_bound(kCapacities.begin(), kCapacities.end(), length) - kCapacities.begin();
  }

  /// Gives the list a room of another size class, or up to `spare` classes larger, and recycles the old one.
  void Move(Slot slot, uint32_t new_class, uint32_t spare = kSpareClasses) {
    const List old = lists_[slot];
    if (new_class == old.size_class) return;
    List& list = lists_[slot];
    new_class == 0 ? LeaveRoom(list) : TakeRoom(new_class, spare, list);
    CopyEntries(pool_.data() + old.offset, old.length, pool_.data() + list.offset);
    if (old.size_class != 0) free_rooms_[old.size_class].push_back(old.offset);
  }

  static void LeaveRoom(List& list) {
    list.offset = 0;
    list.size_class = 0;
  }

  /// A free room of the size class or of the next `spare` ones, or a new one.
  void TakeRoom(uint32_t size_class, uint32_t spare, List& list) {
    const uint32_t largest = std::min<uint32_t>(size_class + spare, kNumClasses - 1);
    for (uint32_t c = size_class; c <= largest; ++c) {
      auto& rooms = free_rooms_[c];
      if (rooms.empty()) continue;
      list.offset = rooms.back();
      list.size_class = c;
      return rooms.pop_back();
    }
    const uint64_t end = end_ + Capacity(size_class);
    if (end + kReadable > pool_.size()) pool_.resize(end + kGrowth);
    list.offset = end_;
    list.size_class = size_class;
    end_ = end;
  }

  /// Rooms do not overlap. Short lists without a call: the first and the last entries, which may be the same.
  static void CopyEntries(const T* from, size_t length, T* to) {
    if (length > kSmallClasses) {
      std::copy_n(from, length, to);
    } else if (length >= 4) {
      std::copy_n(from, 4, to);
      std::copy_n(from + length - 4, 4, to + length - 4);
    } else if (length >= 2) {
      std::copy_n(from, 2, to);
      std::copy_n(from + length - 2, 2, to + length - 2);
    } else if (length == 1) {
      *to = *from;
    }
  }

  std::vector<List> lists_;
  std::vector<T> pool_ = std::vector<T>(kReadable);  ///< rooms, then at least kReadable entries of none
  uint64_t end_ = 0;                                 ///< of all rooms
  uint32_t longest_ = 0;                             ///< length of the longest list so far
  std::array<std::vector<uint32_t>, kNumClasses> free_rooms_;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_MESH_POOLED_LISTS_H_
