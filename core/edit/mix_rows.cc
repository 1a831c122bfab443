#include "core/edit/mix_rows.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <type_traits>

namespace dynmesh {
namespace {

using Parents = absl::Span<const RowShare>;

template <typename Scalar>
Scalar ScalarAt(absl::Span<const uint8_t> row, size_t component) {
  Scalar value;
  std::memcpy(&value, row.data() + component * sizeof(value), sizeof(value));
  return value;
}

template <typename Scalar>
struct Range {
  Scalar low, high;
};

template <typename Scalar>
Range<Scalar> RangeOf(Parents parents, size_t component) {
  const Scalar first = ScalarAt<Scalar>(parents[0].row, component);
  Range<Scalar> range = {first, first};
  for (const RowShare& parent : parents) {
    const Scalar value = ScalarAt<Scalar>(parent.row, component);
    range = {std::min(range.low, value), std::max(range.high, value)};
  }
  return range;
}

template <typename Scalar>
Scalar Interpolate(Parents parents, size_t component) {
  const auto [low, high] = RangeOf<Scalar>(parents, component);
  double sum = 0;
  if constexpr (std::is_floating_point_v<Scalar>) {
    for (const RowShare& parent : parents) sum += parent.weight * ScalarAt<Scalar>(parent.row, component);
    return static_cast<Scalar>(std::clamp<double>(sum, low, high));
  } else {
    // Differences to the least, as unsigned numbers: those of equal parents are exactly 0, and none
    // overflows.
    const auto base = static_cast<uint64_t>(low);
    for (const RowShare& parent : parents) {
      sum += parent.weight *
             static_cast<double>(static_cast<uint64_t>(ScalarAt<Scalar>(parent.row, component)) - base);
    }
    const uint64_t width = static_cast<uint64_t>(high) - base;
    const double step = std::round(sum);
    const bool inside = step < static_cast<double>(width);
    return static_cast<Scalar>(base + (inside ? static_cast<uint64_t>(step) : width));
  }
}

/// Fills a row with component(k) for each component.
template <typename Scalar, typename Component>
void FillRow(std::vector<uint8_t>& row, Component component) {
  for (size_t k = 0; k < row.size() / sizeof(Scalar); ++k) {
    const Scalar value = component(k);
    std::memcpy(&row[k * sizeof(value)], &value, sizeof(value));
  }
}

}  // namespace

std::vector<uint8_t> MixRows(const AttributeColumn& column, absl::Span<const RowShare> parents) {
  const AttributePolicy policy = column.spec().effective_policy();
  const auto defaults = column.default_row();
  if (policy == AttributePolicy::kDrop) return {defaults.begin(), defaults.end()};
  const auto heaviest =
      std::max_element(parents.begin(), parents.end(),
                       [](const RowShare& a, const RowShare& b) { return a.weight < b.weight; });
  std::vector<uint8_t> row(heaviest->row.begin(), heaviest->row.end());
  WithScalar(column.spec().type, [&](auto scalar) {
    using Scalar = decltype(scalar);
    if (policy == AttributePolicy::kMax) {
      FillRow<Scalar>(row, [&](size_t k) { return RangeOf<Scalar>(parents, k).high; });
    } else if (policy == AttributePolicy::kInterpolate && heaviest->weight < 1) {
      FillRow<Scalar>(row, [&](size_t k) { return Interpolate<Scalar>(parents, k); });
    }
  });
  return row;
}

}  // namespace dynmesh
