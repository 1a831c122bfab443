#ifndef DYNMESH_CORE_MESH_INCIDENCE_LISTS_H_
#define DYNMESH_CORE_MESH_INCIDENCE_LISTS_H_

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "absl/container/flat_hash_map.h"
#include "absl/container/inlined_vector.h"
#include "absl/types/span.h"
#include "core/mesh/erase_ascending.h"
#include "core/mesh/ids.h"
#include "core/mesh/pooled_lists.h"

namespace dynmesh {

/// For each lower entity the entities of the next dimension that use it: many small multisets in one pool.
///
/// An entry stands once for each use, so a degenerate face that uses an edge twice is listed twice. Lists of
/// up to kIndexedLength entries ascend; longer ones are in no order.
///
/// Cost: Add and Remove O(length) up to kIndexedLength entries; beyond that positions are kept in a hash
/// table and both are O(1), so that a hub of a million faces is torn down in linear time.
/// Invalidates: Add and Remove invalidate all spans.
template <typename UpperId>
class IncidenceLists {
 public:
  static constexpr uint32_t kMaxLength = PooledLists<UpperId>::kMaxLength;
  static constexpr uint64_t kMaxEntries = PooledLists<UpperId>::kMaxEntries;
  static constexpr uint32_t kIndexedLength = 512;

  absl::Span<const UpperId> Of(Slot lower) const { return lists_.Of(lower); }
  uint32_t Length(Slot lower) const { return lists_.Length(lower); }
  bool HasRoom(uint32_t count) const { return lists_.HasRoom(count); }
  void PrefetchList(Slot lower) const { lists_.PrefetchList(lower); }
  void PrefetchEntries(Slot lower) const { lists_.PrefetchEntries(lower); }

  /// `first_room`: as PooledLists::PushBack.
  void Add(Slot lower, UpperId upper, uint32_t first_room = 2) {
    lists_.PushBack(lower, upper, first_room);
    const uint32_t length = lists_.Length(lower);
    if (length > kIndexedLength) return IndexFrom(lower, length == kIndexedLength + 1 ? 0 : length - 1);
    const auto entries = lists_.MutableOf(lower);
    uint32_t place = length - 1;  // mostly the last: new slots ascend
    for (; place > 0 && upper < entries[place - 1]; --place) entries[place] = entries[place - 1];
    entries[place] = upper;
  }

  /// Removes one entry. REQUIRES: it is there.
  void Remove(Slot lower, UpperId upper) {
    const uint32_t last = lists_.Length(lower) - 1;
    const auto entries = lists_.MutableOf(lower);
    if (last >= kIndexedLength) {
      const uint32_t position = positions_.find(Key(lower, upper))->second.back();
      IndexRemoved(lower, position, last);
      entries[position] = entries[last];
      if (last == kIndexedLength) std::sort(entries.begin(), entries.end() - 1);
    } else {
      EraseAscending(SlotsOf(lower), last + 1, upper.slot());
    }
    lists_.PopBack(lower);
  }

  /// As PooledLists, entries ascending; IndexLongLists() must follow the last Append().
  void Layout(absl::Span<const uint32_t> lengths) { lists_.Layout(lengths); }
  void Append(Slot lower, UpperId upper) { lists_.Append(lower, upper); }
  void IndexLongLists() {
    for (Slot lower = 0; lower < lists_.size(); ++lower) {
      if (lists_.Length(lower) > kIndexedLength) IndexFrom(lower, 0);
    }
  }

  void Reserve(size_t lists, size_t entries) { lists_.Reserve(lists, entries); }

  size_t memory_bytes() const {
    return lists_.memory_bytes() + positions_.capacity() * (sizeof(uint64_t) + sizeof(Positions) + 1);
  }

 private:
  static uint64_t Key(Slot lower, UpperId upper) { return uint64_t{lower} << 32 | upper.slot(); }

  /// An id is its slot.
  Slot* SlotsOf(Slot lower) { return reinterpret_cast<Slot*>(lists_.MutableOf(lower).data()); }

  /// Indexes the entries of a long list from `first` on.
  void IndexFrom(Slot lower, uint32_t first) {
    const auto entries = Of(lower);
    for (uint32_t i = first; i < entries.size(); ++i) positions_[Key(lower, entries[i])].push_back(i);
  }

  /// The entry at `position` is about to go and the one at `last` to take its place, in a long list.
  void IndexRemoved(Slot lower, uint32_t position, uint32_t last) {
    const auto entries = Of(lower);
    if (last == kIndexedLength) {  // no longer long: forget all
      for (UpperId upper : entries) positions_.erase(Key(lower, upper));
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

  PooledLists<UpperId> lists_;
  absl::flat_hash_map<uint64_t, Positions> positions_;  ///< of the entries of long lists
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_MESH_INCIDENCE_LISTS_H_
