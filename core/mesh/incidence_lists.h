#ifndef DYNMESH_CORE_MESH_INCIDENCE_LISTS_H_
#define DYNMESH_CORE_MESH_INCIDENCE_LISTS_H_

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/container/inlined_vector.h"
#include "absl/types/span.h"
#include "core/mesh/ids.h"

namespace dynmesh {

/// For each lower entity the entities of the next dimension that use it: many small multisets in one pool.
///
/// An entry stands once for each use, so a degenerate face that uses an edge twice is listed twice. The
/// order within a list is arbitrary. Lists are contiguous; a list that outgrows its room moves to a
/// larger one, and rooms are recycled by size class, so no list has a heap block of its own.
///
/// Cost: Add amortised O(1). Remove O(length) up to kIndexedLength entries; beyond that positions are
/// kept in a hash table and it is O(1), so that a hub of a million faces is torn down in linear time.
/// Invalidates: Add and Remove invalidate all spans.
template <typename UpperId>
class IncidenceLists {
 public:
  static constexpr uint32_t kMaxLength = 50'000'000;
  static constexpr uint32_t kIndexedLength = 512;
  /// Of all lists together, with a margin for the room that size classes leave.
  static constexpr uint64_t kMaxEntries = 0xc0000000u;

  absl::Span<const UpperId> Of(Slot lower) const {
    if (lower >= lists_.size()) return {};
    const List& list = lists_[lower];
    return absl::MakeConstSpan(pool_.data() + list.offset, list.length);
  }

  uint32_t Length(Slot lower) const { return lower < lists_.size() ? lists_[lower].length : 0; }

  /// Whether `count` entries more have room within the 32-bit limits, whatever list they go to.
  bool HasRoom(uint32_t count) const { return longest_ + count <= kMaxLength && pool_.size() < kMaxPool; }

  /// `first_room`: room that an empty list is given, 1-8; what most lists will need saves them moves.
  void Add(Slot lower, UpperId upper, uint32_t first_room = 2) {
    if (lower >= lists_.size()) lists_.resize(lower + 1);
    const uint32_t size_class = lists_[lower].size_class;
    if (lists_[lower].length == Capacity(size_class)) Move(lower, size_class == 0 ? first_room : NextClass(size_class));
    List& list = lists_[lower];
    pool_[list.offset + list.length++] = upper;
    longest_ = std::max<uint32_t>(longest_, list.length);
    if (list.length > kIndexedLength) IndexAdded(lower);
  }

  /// Removes one entry. REQUIRES: it is there.
  void Remove(Slot lower, UpperId upper) {
    List& list = lists_[lower];
    UpperId* entries = pool_.data() + list.offset;
    const uint32_t position = Position(lower, upper);
    const uint32_t last = --list.length;
    if (list.length >= kIndexedLength) IndexRemoved(lower, position, last);
    entries[position] = entries[last];
    if (list.length < Capacity(list.size_class) / 2 && list.size_class > kSmallClasses) {
      Move(lower, ClassFor(list.length + list.length / 4));
    } else if (list.length == 0) {
      Move(lower, 0);
    }
  }

  /// Makes empty lists 0, 1, ... with room for `lengths` entries. REQUIRES: no list yet; fewer than kMaxEntries in all.
  void Layout(absl::Span<const uint32_t> lengths) {
    lists_.resize(lengths.size());
    uint64_t offset = 0;
    for (size_t i = 0; i < lengths.size(); ++i) {
      lists_[i].size_class = ClassFor(lengths[i]);
      lists_[i].offset = offset;
      offset += Capacity(lists_[i].size_class);
    }
    pool_.reserve(offset + offset / 16);
    pool_.resize(offset);
  }

  /// Add() into a room made by Layout(), but IndexLongLists() must follow the last one.
  void Append(Slot lower, UpperId upper) {
    List& list = lists_[lower];
    pool_[list.offset + list.length++] = upper;
  }

  void IndexLongLists() {
    for (Slot lower = 0; lower < lists_.size(); ++lower) {
      longest_ = std::max<uint32_t>(longest_, lists_[lower].length);
      if (lists_[lower].length > kIndexedLength) IndexFrom(lower, 0);
    }
  }

  void Reserve(size_t lists, size_t entries) {
    lists_.reserve(lists);
    pool_.reserve(entries);
  }

  size_t memory_bytes() const {
    size_t bytes = lists_.size() * sizeof(List) + pool_.size() * sizeof(UpperId) +
                   positions_.size() * (sizeof(uint64_t) + sizeof(Positions) + 1);
    for (const auto& rooms : free_rooms_) bytes += rooms.size() * sizeof(uint32_t);
    return bytes;
  }

 private:
  // Size classes: 0 has no room; 1..8 hold 1..8; then four a doubling up to 256 (class 28), then two.
  static constexpr uint32_t kSmallClasses = 8;
  static constexpr int kNumClasses = 64;
  static constexpr uint64_t kMaxPool = 0xf0000000u;

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
  static_assert(kCapacities[kNumClasses - 1] >= kMaxLength);

  struct List {
    uint32_t offset = 0;
    uint32_t length : 26 = 0;
    uint32_t size_class : 6 = 0;
  };

  static uint32_t Capacity(uint32_t size_class) { return kCapacities[size_class]; }

  /// Small lists grow by two: each room that is left behind waits for another list to need its size.
  static uint32_t NextClass(uint32_t size_class) {
    return size_class < kSmallClasses ? size_class + 2 - size_class % 2 : size_class + 1;
  }

  static uint32_t ClassFor(uint32_t length) {
    return std::lower_bound(kCapacities.begin(), kCapacities.end(), length) - kCapacities.begin();
  }

  /// Gives the list a room of another size class and recycles the old one.
  void Move(Slot lower, uint32_t new_class) {
    const uint32_t old_class = lists_[lower].size_class;
    if (new_class == old_class) return;
    const uint32_t old_offset = lists_[lower].offset;
    const uint32_t new_offset = new_class == 0 ? 0 : TakeRoom(new_class);
    std::copy_n(pool_.data() + old_offset, lists_[lower].length, pool_.data() + new_offset);
    if (old_class != 0) free_rooms_[old_class].push_back(old_offset);
    lists_[lower].offset = new_offset;
    lists_[lower].size_class = new_class;
  }

  uint32_t TakeRoom(uint32_t size_class) {
    auto& rooms = free_rooms_[size_class];
    if (!rooms.empty()) {
      const uint32_t offset = rooms.back();
      rooms.pop_back();
      return offset;
    }
    const uint32_t offset = pool_.size();
    pool_.resize(pool_.size() + Capacity(size_class));
    return offset;
  }

  static uint64_t Key(Slot lower, UpperId upper) { return uint64_t{lower} << 32 | upper.slot(); }

  uint32_t Position(Slot lower, UpperId upper) const {
    const auto entries = Of(lower);
    if (entries.size() > kIndexedLength) return positions_.find(Key(lower, upper))->second.back();
    return std::find(entries.begin(), entries.end(), upper) - entries.begin();
  }

  /// The last entry was appended to a list that is now long: index it, or all when it just became long.
  void IndexAdded(Slot lower) {
    const uint32_t length = Length(lower);
    IndexFrom(lower, length == kIndexedLength + 1 ? 0 : length - 1);
  }

  void IndexFrom(Slot lower, uint32_t first) {
    const auto entries = Of(lower);
    for (uint32_t i = first; i < entries.size(); ++i) positions_[Key(lower, entries[i])].push_back(i);
  }

  /// The entry at `position` goes and the one at `last` takes its place, in a list that was long.
  void IndexRemoved(Slot lower, uint32_t position, uint32_t last) {
    const List& list = lists_[lower];
    const UpperId* entries = pool_.data() + list.offset;
    if (list.length == kIndexedLength) {  // no longer long: forget all
      for (uint32_t i = 0; i <= last; ++i) positions_.erase(Key(lower, entries[i]));
      return;
    }
    const auto moved = positions_.find(Key(lower, entries[last]));
    *std::find(moved->second.begin(), moved->second.end(), last) = position;
    const auto removed = positions_.find(Key(lower, entries[position]));
    removed->second.erase(std::find(removed->second.begin(), removed->second.end(), position));
    if (removed->second.empty()) positions_.erase(removed);
  }

  /// Where an upper entity stands in a long list: once for each use, at most twelve times.
  using Positions = absl::InlinedVector<uint32_t, 2>;

  std::vector<List> lists_;
  std::vector<UpperId> pool_;
  uint32_t longest_ = 0;  ///< length of the longest list so far
  std::array<std::vector<uint32_t>, kNumClasses> free_rooms_;
  absl::flat_hash_map<uint64_t, Positions> positions_;  ///< of the entries of long lists
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_MESH_INCIDENCE_LISTS_H_
