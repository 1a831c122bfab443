#ifndef DYNMESH_CORE_MESH_SPATIAL_ORDER_H_
#define DYNMESH_CORE_MESH_SPATIAL_ORDER_H_

#include <cstdint>
#include <vector>

#include "absl/types/span.h"
#include "core/mesh/checksum.h"
#include "core/mesh/ids.h"

/// Orders in which things that are near in space are near in memory: slot order decides cache hits and the
/// size of deltas more than anything else does.
namespace dynmesh {

/// order[k] = index of the k-th item.
using Permutation = std::vector<uint32_t>;

/// ranks[order[k]] = k.
Permutation Inverse(const Permutation& order);

/// Points along a Hilbert curve through their bounding cube; points of the same grid cell keep their order.
/// REQUIRES: coordinates are finite, fewer than 2^32 points.
/// Cost: O(n log n) bit operations and a radix sort; 16 bytes a point while it runs.
/// Source: Skilling, "Programming the Hilbert curve", AIP Conf. Proc. 707 (2004).
Permutation HilbertOrder(absl::Span<const Point> points);

/// Items by ascending key, stable: a counting sort. REQUIRES: keys[i] < num_keys.
Permutation CountingOrder(absl::Span<const uint32_t> keys, size_t num_keys);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_MESH_SPATIAL_ORDER_H_
