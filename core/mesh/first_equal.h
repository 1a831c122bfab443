#ifndef DYNMESH_CORE_MESH_FIRST_EQUAL_H_
#define DYNMESH_CORE_MESH_FIRST_EQUAL_H_

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <tuple>
#include <vector>

#include "core/mesh/ids.h"

namespace dynmesh {

/// What two edges or faces must share to be the same: the lowest vertex, and the `Words` others in a
/// canonical order.
template <int Words>
struct VertexKey {
  Slot lowest;
  std::array<Slot, Words> others;
};

/// For each of many keyed items the first (lowest index) item of the same key: how a bulk build finds shared
/// edges and faces.
///
/// Items are sorted into a bucket for each lowest vertex by counting, and compared within their bucket: a few
/// dozen neighbours each, all in cache when items come in spatial order. Cost: O(items + buckets) while
/// buckets are small, O(m log m) for a bucket of m items.
template <int Words>
class FirstEqual {
 public:
  FirstEqual(size_t num_items, size_t num_buckets)
      : items_(num_items), begin_(num_buckets + 1), first_(num_items) {}

  /// First pass, once for each item.
  void Count(Slot lowest) { ++begin_[lowest + 1]; }
  void EndCount() {
    for (size_t bucket = 1; bucket < begin_.size(); ++bucket) begin_[bucket] += begin_[bucket - 1];
  }

  /// Second pass, once for each item, in any order.
  void Put(uint32_t index, const VertexKey<Words>& key) {
    items_[begin_[key.lowest]++] = {index, key.others};
  }

  /// first[i] = lowest index with the key of item i. Frees what only the passes needed.
  std::vector<uint32_t> Take() && {
    uint32_t begin = 0;
    for (size_t bucket = 0; bucket + 1 < begin_.size();
         ++bucket) {  // Put moved each begin to its bucket's end
      const uint32_t end = begin_[bucket];
      end - begin <= kSmall ? CompareAll(begin, end) : SortAndCompare(begin, end);
      begin = end;
    }
    return std::move(first_);
  }

 private:
  static constexpr uint32_t kSmall = 64;

  struct Item {
    uint32_t index;
    std::array<Slot, Words> others;
  };

  void CompareAll(uint32_t begin, uint32_t end) {
    std::array<uint32_t, kSmall> group;
    std::array<Item, kSmall> groups;  // one item of each group, with the lowest index
    uint32_t num_groups = 0;
    for (uint32_t i = begin; i < end; ++i) {
      const Item& item = items_[i];
      uint32_t g = 0;
      while (g < num_groups && groups[g].others != item.others) ++g;
      if (g == num_groups) groups[num_groups++] = item;
      groups[g].index = std::min(groups[g].index, item.index);
      group[i - begin] = g;
    }
    for (uint32_t i = begin; i < end; ++i) first_[items_[i].index] = groups[group[i - begin]].index;
  }

  void SortAndCompare(uint32_t begin, uint32_t end) {
    const auto first = items_.begin() + begin;
    std::sort(first, items_.begin() + end, [](const Item& a, const Item& b) {
      return std::tie(a.others, a.index) < std::tie(b.others, b.index);
    });
    uint32_t leader = begin;
    for (uint32_t i = begin; i < end; ++i) {
      if (items_[i].others != items_[leader].others) leader = i;
      first_[items_[i].index] = items_[leader].index;
    }
  }

  std::vector<Item> items_;
  std::vector<uint32_t> begin_;
  std::vector<uint32_t> first_;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_MESH_FIRST_EQUAL_H_
