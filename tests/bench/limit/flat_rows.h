#ifndef DYNMESH_TESTS_BENCH_LIMIT_FLAT_ROWS_H_
#define DYNMESH_TESTS_BENCH_LIMIT_FLAT_ROWS_H_

#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/types/span.h"

namespace dynmesh::bench {

/// A relation as nothing but an array: rows of `stride` ids, or of ids[offsets[i] .. offsets[i + 1]) if it is
/// 0.
struct FlatRows {
  uint32_t stride = 0;
  std::vector<uint32_t> offsets;
  std::vector<uint32_t> ids;

  size_t size() const {
    if (stride != 0) return ids.size() / stride;
    return offsets.empty() ? 0 : offsets.size() - 1;
  }
  absl::Span<const uint32_t> Row(size_t i) const {
    const size_t begin = stride != 0 ? i * stride : offsets[i];
    return absl::MakeConstSpan(&ids[begin], stride != 0 ? stride : offsets[i + 1] - begin);
  }
  size_t memory_bytes() const { return (offsets.size() + ids.size()) * sizeof(uint32_t); }
};

/// Rows by target: row t holds every i whose row holds t, ascending. A counting sort.
inline FlatRows Invert(const FlatRows& rows, size_t num_targets) {
  FlatRows inverse;
  inverse.offsets.resize(num_targets + 2);
  for (uint32_t id : rows.ids) ++inverse.offsets[id + 2];
  for (size_t t = 2; t < inverse.offsets.size(); ++t) inverse.offsets[t] += inverse.offsets[t - 1];
  inverse.ids.resize(rows.ids.size());
  for (uint32_t i = 0; i < rows.size(); ++i) {
    for (uint32_t id : rows.Row(i)) inverse.ids[inverse.offsets[id + 1]++] = i;
  }
  inverse.offsets.pop_back();
  return inverse;
}

namespace internal {

template <int kStride, typename Fn>
void ForEachFixedRow(const FlatRows& rows, Fn& fn) {
  const uint32_t count = rows.ids.size() / kStride;
  const uint32_t* ids = rows.ids.data();
  for (uint32_t i = 0; i < count; ++i, ids += kStride) fn(i, absl::Span<const uint32_t>(ids, kStride));
}

template <typename Fn>
void ForEachCsrRow(const FlatRows& rows, Fn& fn) {
  const uint32_t count = rows.size();
  for (uint32_t i = 0; i < count; ++i) {
    const uint32_t begin = rows.offsets[i];
    fn(i, absl::Span<const uint32_t>(&rows.ids[begin], rows.offsets[i + 1] - begin));
  }
}

}  // namespace internal

/// Calls fn(i, row) for each row: the loop that nothing can beat, with the length of fixed rows known to the
/// compiler.
template <typename Fn>
void ForEachFlatRow(const FlatRows& rows, Fn& fn) {
  switch (rows.stride) {
    case 2:
      return internal::ForEachFixedRow<2>(rows, fn);
    case 3:
      return internal::ForEachFixedRow<3>(rows, fn);
    case 4:
      return internal::ForEachFixedRow<4>(rows, fn);
    case 6:
      return internal::ForEachFixedRow<6>(rows, fn);
    case 8:
      return internal::ForEachFixedRow<8>(rows, fn);
    case 12:
      return internal::ForEachFixedRow<12>(rows, fn);
    default:
      return internal::ForEachCsrRow(rows, fn);
  }
}

}  // namespace dynmesh::bench

#endif  // DYNMESH_TESTS_BENCH_LIMIT_FLAT_ROWS_H_
