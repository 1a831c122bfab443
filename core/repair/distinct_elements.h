#ifndef DYNMESH_CORE_REPAIR_DISTINCT_ELEMENTS_H_
#define DYNMESH_CORE_REPAIR_DISTINCT_ELEMENTS_H_

#include <array>
#include <cstddef>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

/// Whether two elements of the same vertices are one: the same wire, cycle, or faces. REQUIRES: none names a
/// vertex twice.
bool AreEqual(const NewElement& a, const NewElement& b);

/// A set of elements that tells whether an equal one is in it. Cost: O(1) each, as a set of vertices has few
/// arrangements. Thread safety: that of std::vector.
class DistinctElements {
 public:
  /// What each takes.
  static constexpr size_t kBytesOfElement = 128;

  /// False when an equal element is in already. REQUIRES: it names no vertex twice.
  bool Insert(const NewElement& element);

 private:
  /// The type, and the vertices in ascending order.
  using Key = std::array<Slot, kMaxElementVertices + 1>;

  /// What was inserted with the same key; empty where all such are equal.
  absl::flat_hash_map<Key, std::vector<NewElement>> arrangements_;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_REPAIR_DISTINCT_ELEMENTS_H_
