#ifndef DYNMESH_CORE_SPATIAL_BOX_TREE_H_
#define DYNMESH_CORE_SPATIAL_BOX_TREE_H_

#include <array>
#include <cstddef>
#include <memory>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "core/mesh/ids.h"
#include "core/mesh/work_meter.h"

namespace dynmesh {

/// A closed box in single precision.
struct FloatBox {
  std::array<float, 3> low;
  std::array<float, 3> high;
};

inline bool Meet(const FloatBox& a, const FloatBox& b) {
  for (int axis = 0; axis < 3; ++axis) {
    if (a.low[axis] > b.high[axis] || b.low[axis] > a.high[axis]) return false;
  }
  return true;
}

/// An R-tree of boxes that carry a slot: Boost.Geometry's, which this keeps to one translation unit.
///
/// Entries are never removed; whoever owns the tree builds it anew when it holds too many that are void. So
/// an update costs no search among boxes that overlap. Cost: Build O(n log n), Insert O(log n), searches
/// O(log n + what is met) unless boxes overlap much. Thread safety: that of std::vector.
class BoxTree {
 public:
  struct Entry {
    FloatBox box;
    Slot slot;
  };

  BoxTree();
  BoxTree(BoxTree&&) noexcept;
  BoxTree& operator=(BoxTree&&) noexcept;
  ~BoxTree();

  /// Replaces the content, packed.
  void Build(const std::vector<Entry>& entries);
  void Insert(const Entry& entry);

  size_t size() const;
  size_t memory_bytes() const;

  /// Calls visit for each entry whose box meets `box`, in no order, until it fails. Each entry that is looked
  /// at is a step. Errors: those of `visit` and of the meter.
  absl::Status ForEachMeeting(const FloatBox& box, WorkMeter& meter,
                              absl::FunctionRef<absl::Status(const Entry&)> visit) const;

  /// The slots of `count` entries nearest to a point among those that `accept` lets pass, in no order; all of
  /// them if there are fewer. Errors: the meter's.
  struct NearestQuery {
    std::array<float, 3> point;
    size_t count;
    absl::FunctionRef<bool(const Entry&)> accept;
  };
  absl::Status FindNearest(const NearestQuery& query, WorkMeter& meter, std::vector<Slot>& slots) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_SPATIAL_BOX_TREE_H_
