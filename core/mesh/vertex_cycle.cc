#include "core/mesh/vertex_cycle.h"

#include <algorithm>

namespace dynmesh {

absl::optional<FaceCode> MatchCycle(absl::Span<const VertexId> stored, absl::Span<const VertexId> key) {
  const int n = stored.size();
  for (const int flipped : {0, 4}) {
    const int second = flipped ? n - 1 : 1;  // step from one vertex of the key to the next
    for (int rotation = 0; rotation < n; ++rotation) {
      if (stored[rotation] != key[0]) continue;
      int k = 1, at = rotation;
      while (k < n && stored[at = at + second < n ? at + second : at + second - n] == key[k]) ++k;
      if (k == n) return FaceCode{static_cast<uint8_t>(rotation | flipped)};
    }
  }
  return absl::nullopt;
}

/// The smallest of all rotations and reflections, by trying them.
static CycleKey SmallestCycle(absl::Span<const VertexId> cycle) {
  const int n = cycle.size();
  CycleKey best;
  best.fill(VertexId());
  for (int value = 0; value < 8; ++value) {
    const FaceCode code{static_cast<uint8_t>(value)};
    if (code.rotation() >= n || cycle[code.rotation()] > best[0]) continue;
    CycleKey candidate;
    candidate.fill(VertexId());
    for (int k = 0; k < n; ++k) candidate[k] = cycle[code.StoredVertex(k, n)];
    best = std::min(best, candidate);
  }
  return best;
}

CycleKey CanonicalCycle(absl::Span<const VertexId> cycle) {
  const int n = cycle.size();
  const int low = std::min_element(cycle.begin(), cycle.end()) - cycle.begin();
  if (std::count(cycle.begin(), cycle.end(), cycle[low]) > 1) return SmallestCycle(cycle);
  const VertexId next = cycle[low + 1 == n ? 0 : low + 1];
  const VertexId previous = cycle[low == 0 ? n - 1 : low - 1];
  CycleKey key;
  key.fill(VertexId());
  for (int k = 0; k < n; ++k) key[k] = cycle[(low + (next <= previous ? k : n - k)) % n];
  return key;
}

}  // namespace dynmesh
