#ifndef DYNMESH_CORE_ADAPT_WORK_LIST_H_
#define DYNMESH_CORE_ADAPT_WORK_LIST_H_

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/mesh/bit_set.h"
#include "core/mesh/ids.h"

namespace dynmesh {

/// Slots that wait for one phase of an adaptation, the most urgent first; equally urgent ones by slot, so
/// that the same mesh always gives the same result.
///
/// A slot waits once: while it does, adding it again changes nothing, so that there are never more than
/// slots. An entity may be gone, or another one, when its turn comes: who takes a slot looks again at what it
/// is. Cost: to add and take, O(log n). Thread safety: that of std::vector.
class WorkList {
 public:
  void Add(double urgency, Slot slot) {
    if (waiting_.Test(slot)) return;
    waiting_.Set(slot);
    items_.push_back({urgency, slot});
    std::push_heap(items_.begin(), items_.end(), IsLater);
    ++num_added_;
  }

  /// REQUIRES: not empty().
  Slot Take() {
    std::pop_heap(items_.begin(), items_.end(), IsLater);
    const Slot slot = items_.back().second;
    items_.pop_back();
    waiting_.Clear(slot);
    return slot;
  }

  void Clear() {
    items_.clear();
    waiting_ = BitSet();
    num_added_ = 0;
  }

  bool empty() const { return items_.empty(); }
  /// Since Clear(): those that were taken, and all.
  uint64_t num_taken() const { return num_added_ - items_.size(); }
  uint64_t num_added() const { return num_added_; }

 private:
  using Item = std::pair<double, Slot>;

  static bool IsLater(const Item& a, const Item& b) {
    return a.first != b.first ? a.first < b.first : a.second > b.second;
  }

  std::vector<Item> items_;  ///< a heap
  BitSet waiting_;           ///< their slots
  uint64_t num_added_ = 0;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_ADAPT_WORK_LIST_H_
