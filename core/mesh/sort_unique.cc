#include "core/mesh/sort_unique.h"

#ifdef __x86_64__

namespace dynmesh::internal {

#define DYNMESH_TARGET_AVX2 __attribute__((target("avx2")))

namespace {

/// Eight values in a register.
using WideLanes = int32_t __attribute__((vector_size(32)));

/// Two registers share each value that is spread over lanes.
DYNMESH_TARGET_AVX2 inline void RankSixteen(const Slot* values, size_t count, const Slot* from, Slot* ranks) {
  WideLanes low, high;
  std::memcpy(&low, from, sizeof(low));
  std::memcpy(&high, from + 8, sizeof(high));
  WideLanes low_rank = {}, high_rank = {};
  for (size_t i = 0; i < count; ++i) {
    const WideLanes other = WideLanes{} + static_cast<int32_t>(values[i]);
    low_rank -= other < low;  // -1 where true
    high_rank -= other < high;
  }
  std::memcpy(ranks, &low_rank, sizeof(low_rank));
  std::memcpy(ranks + 8, &high_rank, sizeof(high_rank));
}

DYNMESH_TARGET_AVX2 inline void RankEight(const Slot* values, size_t count, const Slot* from, Slot* ranks) {
  WideLanes lanes;
  std::memcpy(&lanes, from, sizeof(lanes));
  WideLanes rank = {};
  for (size_t i = 0; i < count; ++i) rank -= (WideLanes{} + static_cast<int32_t>(values[i])) < lanes;
  std::memcpy(ranks, &rank, sizeof(rank));
}

}  // namespace

DYNMESH_TARGET_AVX2 void RankSortWide(const Slot* values, size_t count, Slot* sorted) {
  Slot ranks[kRankSorted];
  size_t at = 0;
  for (; at + 8 < count; at += 16) RankSixteen(values, count, values + at, ranks + at);
  if (at < count) RankEight(values, count, values + at, ranks + at);
  for (at = 0; at < count; at += 8) std::memset(sorted + at, 0xff, 8 * sizeof(Slot));
  for (size_t i = 0; i < count; ++i) sorted[ranks[i]] = values[i];
}

}  // namespace dynmesh::internal

#endif  // __x86_64__
