#ifndef DYNMESH_CORE_MESH_SORT_UNIQUE_H_
#define DYNMESH_CORE_MESH_SORT_UNIQUE_H_

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <utility>

#include "core/mesh/ids.h"

/// Sorting the short lists that rows of neighbours are. Slots below 2^31 are what all of it REQUIRES.
namespace dynmesh {
namespace internal {

/// Rows of neighbours are mostly this short.
inline constexpr size_t kRankSorted = 64;

/// Four values in a register.
using Lanes = int32_t __attribute__((vector_size(16)));

inline Lanes Load(const Slot* values) {
  Lanes lanes;
  std::memcpy(&lanes, values, sizeof(lanes));
  return lanes;
}

inline void Store(Lanes lanes, Slot* values) { std::memcpy(values, &lanes, sizeof(lanes)); }

/// sorted[k] = the value that k others are smaller than, kNoSlot where there is none: equal values fall on
/// one place. No branch depends on a value, so nothing is mispredicted. REQUIRES: 1 <= count <= kRankSorted.
inline void RankSort(const Slot* values, size_t count, Slot* sorted) {
  Slot ranks[kRankSorted];
  for (size_t at = 0; at < count; at += 8) {  // two registers share each value that is spread over lanes
    const Lanes low = Load(values + at), high = Load(values + at + 4);
    Lanes low_rank = {0, 0, 0, 0}, high_rank = {0, 0, 0, 0};
    for (size_t i = 0; i < count; ++i) {
      const int32_t value = static_cast<int32_t>(values[i]);
      const Lanes other = {value, value, value, value};
      low_rank -= other < low;  // -1 where true
      high_rank -= other < high;
    }
    Store(low_rank, ranks + at);
    Store(high_rank, ranks + at + 4);
    Store(Lanes{-1, -1, -1, -1}, sorted + at);
    Store(Lanes{-1, -1, -1, -1}, sorted + at + 4);
  }
  for (size_t i = 0; i < count; ++i) sorted[ranks[i]] = values[i];
}

#ifdef __x86_64__
/// Whether this machine has registers of eight values.
inline const bool kHasAvx2 = __builtin_cpu_supports("avx2");

/// RankSort for a machine that has.
void RankSortWide(const Slot* values, size_t count, Slot* sorted);
#endif

/// RankSort in the widest registers that there are.
inline void RankSortBest(const Slot* values, size_t count, Slot* sorted) {
#ifdef __x86_64__
  if (kHasAvx2) return RankSortWide(values, count, sorted);
#endif
  RankSort(values, count, sorted);
}

/// Whether each value is smaller than the next. REQUIRES: count >= 2.
inline bool IsAscending(const Slot* values, size_t count) {
  size_t i = 1;
  while (i < count && values[i - 1] < values[i]) ++i;
  return i == count;
}

inline void Exchange(Slot& a, Slot& b) {
  const Slot low = std::min(a, b), high = std::max(a, b);
  a = low;
  b = high;
}

/// Copies what is neither kNoSlot nor `self`; returns how many that are.
inline size_t CopyPresent(const Slot* sorted, size_t count, Slot* values, Slot self) {
  size_t kept = 0;
  for (size_t i = 0; i < count; ++i) {
    values[kept] = sorted[i];
    kept += sorted[i] != kNoSlot && sorted[i] != self;
  }
  return kept;
}

inline void SortFour(Slot* v) {
  Exchange(v[0], v[1]);
  Exchange(v[2], v[3]);
  Exchange(v[0], v[2]);
  Exchange(v[1], v[3]);
  Exchange(v[1], v[2]);
}

}  // namespace internal

/// Sorts values that are all different. REQUIRES: seven more slots can be read and written behind them.
/// Cost: O(n log n); some ns for each eight pairs of a short list.
inline void SortDistinct(Slot* values, size_t count) {
  if (count < 2 || internal::IsAscending(values, count)) return;
  if (count == 2) return std::swap(values[0], values[1]);
  if (count > internal::kRankSorted) return std::sort(values, values + count);
  Slot sorted[internal::kRankSorted];
  internal::RankSortBest(values, count, sorted);
  for (size_t at = 0; at < count; at += 4) internal::Store(internal::Load(sorted + at), values + at);
}

/// Sorts, and drops repeats and every `self`; returns how many values are left. REQUIRES and Cost: as
/// SortDistinct; kNoSlot for `self` drops nothing.
inline size_t SortUnique(Slot* values, size_t count, Slot self = kNoSlot) {
  if (count > internal::kRankSorted) {
    Slot* const end = std::remove(values, values + count, self);
    std::sort(values, end);
    return std::unique(values, end) - values;
  }
  Slot sorted[internal::kRankSorted];
  if (count > 4) {
    internal::RankSortBest(values, count, sorted);
  } else {
    std::fill_n(std::copy_n(values, count, sorted), 4 - count, kNoSlot);
    internal::SortFour(sorted);
    for (int i = 3; i > 0; --i) sorted[i] = sorted[i] == sorted[i - 1] ? kNoSlot : sorted[i];
  }
  return internal::CopyPresent(sorted, count, values, self);
}

/// SortUnique where `self` stands just `times` times. Quicker where no other value is repeated.
inline size_t SortUniqueWithout(Slot* values, size_t count, Slot self, size_t times) {
  if (count > internal::kRankSorted || count <= 4) return SortUnique(values, count, self);
  // All of them get one place, the last that is taken: the others stand before it without a gap.
  constexpr Slot kLast = kNoSlot >> 1;
  for (size_t i = 0; i < count; ++i) values[i] = values[i] == self ? kLast : values[i];
  Slot sorted[internal::kRankSorted + 4];
  internal::RankSortBest(values, count, sorted);
  const size_t left = count - times;
  std::fill_n(sorted + left, 4, 0);
  internal::Lanes gaps = {0, 0, 0, 0};
  for (size_t at = 0; at < left; at += 4) {
    const internal::Lanes four = internal::Load(sorted + at);
    internal::Store(four, values + at);
    gaps |= four;  // only kNoSlot is negative
  }
  const bool repeats = (gaps[0] | gaps[1] | gaps[2] | gaps[3]) < 0;
  return repeats ? internal::CopyPresent(sorted, left, values, kNoSlot) : left;
}

}  // namespace dynmesh

#endif  // DYNMESH_CORE_MESH_SORT_UNIQUE_H_
