#include "core/mesh/spatial_order.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <utility>

namespace dynmesh {
namespace {

constexpr int kMaxBits = 21;     // for each axis: the key has 63
constexpr int kSortBits = 11;    // of one pass of the radix sort
constexpr int kGradingBits = 5;  // finer than a uniform mesh needs: graded meshes crowd into few grid cells

/// Grid coordinates of four points at a time, along three axes.
constexpr size_t kNumLanes = 4;
using Lanes = uint32_t __attribute__((vector_size(kNumLanes * sizeof(uint32_t))));
using Axes = std::array<Lanes, 3>;

struct KeyedIndex {
  uint64_t key;
  uint32_t index;
};

/// Enough for about one point in a grid cell.
int BitsFor(size_t num_points) {
  return std::min<int>(kMaxBits, std::bit_width(num_points) / 3 + 1 + kGradingBits);
}

/// Skilling's transform: grid coordinates into the transposed Hilbert index.
Axes Transpose(Axes x, int bits) {
  // All ones where a bit is set.
  const auto bit = [](const Lanes& v, int b) { return Lanes{} - ((v >> b) & 1); };
  for (int b = bits - 1; b > 0; --b) {
    const uint32_t p = (uint32_t{1} << b) - 1;
    for (int axis = 0; axis < 3; ++axis) {
      // Bit set: invert the low bits of x[0]. Clear: swap them with those of x[axis].
      const Lanes set = bit(x[axis], b);
      const Lanes swap = (x[0] ^ x[axis]) & p & ~set;
      x[0] ^= swap | (p & set);
      x[axis] ^= swap;
    }
  }
  x[1] ^= x[0];
  x[2] ^= x[1];
  Lanes gray = {};
  for (int b = bits - 1; b > 0; --b) gray ^= bit(x[2], b) & ((uint32_t{1} << b) - 1);
  for (Lanes& axis : x) axis ^= gray;
  return x;
}

/// Spreads the low 21 bits so that each is followed by two zeros.
uint64_t Spread(uint64_t x) {
  x = (x | x << 32) & 0x001f00000000ffff;
  x = (x | x << 16) & 0x001f0000ff0000ff;
  x = (x | x << 8) & 0x100f00f00f00f00f;
  x = (x | x << 4) & 0x10c30c30c30c30c3;
  x = (x | x << 2) & 0x1249249249249249;
  return x;
}

uint64_t Interleave(const Axes& x, size_t lane) {
  return Spread(x[0][lane]) << 2 | Spread(x[1][lane]) << 1 | Spread(x[2][lane]);
}

/// Maps the bounding cube of points to grid coordinates. Halves first, so that no difference overflows.
class Grid {
 public:
  Grid(absl::Span<const Point> points, int bits) : top_(static_cast<double>((uint32_t{1} << bits) - 1)) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    Point high = {-kInfinity, -kInfinity, -kInfinity};
    low_ = {kInfinity, kInfinity, kInfinity};
    for (const Point& p : points) {
      for (int axis = 0; axis < 3; ++axis) {
        low_[axis] = std::min(low_[axis], p[axis]);
        high[axis] = std::max(high[axis], p[axis]);
      }
    }
    for (int axis = 0; axis < 3; ++axis)
      half_extent_ = std::max(half_extent_, high[axis] / 2 - low_[axis] / 2);
  }

  /// Of at most kNumLanes points.
  Axes Of(absl::Span<const Point> points) const {
    Axes grid = {};
    if (!(half_extent_ > 0)) return grid;
    for (size_t lane = 0; lane < points.size(); ++lane) {
      for (int axis = 0; axis < 3; ++axis) {
        const double place = (points[lane][axis] / 2 - low_[axis] / 2) / half_extent_;
        grid[axis][lane] = static_cast<uint32_t>(std::clamp(place, 0.0, 1.0) * top_);
      }
    }
    return grid;
  }

 private:
  const double top_;
  Point low_ = {};
  double half_extent_ = 0;
};

/// One stable pass of a radix sort by the bits from `shift` on.
void RadixPass(const std::vector<KeyedIndex>& in, int shift, std::vector<KeyedIndex>& out) {
  std::array<uint32_t, (1 << kSortBits) + 1> begin = {};
  constexpr uint64_t kMask = (1 << kSortBits) - 1;
  for (const KeyedIndex& item : in) ++begin[(item.key >> shift & kMask) + 1];
  for (size_t digit = 1; digit < begin.size(); ++digit) begin[digit] += begin[digit - 1];
  for (const KeyedIndex& item : in) out[begin[item.key >> shift & kMask]++] = item;
}

}  // namespace

Permutation Inverse(const Permutation& order) {
  Permutation ranks(order.size());
  for (uint32_t k = 0; k < order.size(); ++k) ranks[order[k]] = k;
  return ranks;
}

Permutation HilbertOrder(absl::Span<const Point> points) {
  const int bits = BitsFor(points.size());
  const Grid grid(points, bits);
  std::vector<KeyedIndex> items(points.size()), sorted(points.size());
  for (size_t i = 0; i < points.size(); i += kNumLanes) {
    const auto few = points.subspan(i, kNumLanes);
    const Axes x = Transpose(grid.Of(few), bits);
    for (size_t lane = 0; lane < few.size(); ++lane)
      items[i + lane] = {Interleave(x, lane), static_cast<uint32_t>(i + lane)};
  }
  for (int shift = 0; shift < 3 * bits; shift += kSortBits) {
    RadixPass(items, shift, sorted);
    items.swap(sorted);
  }
  Permutation order(points.size());
  for (size_t k = 0; k < order.size(); ++k) order[k] = items[k].index;
  return order;
}

Permutation CountingOrder(absl::Span<const uint32_t> keys, size_t num_keys) {
  std::vector<uint32_t> begin(num_keys + 1);
  for (uint32_t key : keys) ++begin[key + 1];
  for (size_t key = 1; key < begin.size(); ++key) begin[key] += begin[key - 1];
  Permutation order(keys.size());
  for (uint32_t i = 0; i < keys.size(); ++i) order[begin[keys[i]]++] = i;
  return order;
}

}  // namespace dynmesh
