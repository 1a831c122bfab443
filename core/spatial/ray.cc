#include "core/spatial/ray.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/mesh/vector.h"

namespace dynmesh {
namespace {

// Far above what rounding does to a place on the ray, far below the size of anything.
constexpr double kSlack = 0x1p-40;

double LargestOf(const Point& p) { return std::max({std::abs(p[0]), std::abs(p[1]), std::abs(p[2])}); }

}  // namespace

RayShear::RayShear(const Ray& ray) : origin_(ray.origin), direction_(ray.direction) {
  const auto largest = std::max_element(direction_.begin(), direction_.end(),
                                        [](double a, double b) { return std::abs(a) < std::abs(b); });
  const int z = largest - direction_.begin();
  exponent_ = std::ilogb(*largest);
  for (double& x : direction_) x = std::ldexp(x, -exponent_);
  axes_ = {(z + 1) % 3, (z + 2) % 3, z};
  if (direction_[z] < 0) std::swap(axes_[0], axes_[1]);
  shear_ = {direction_[axes_[0]] / direction_[z], direction_[axes_[1]] / direction_[z], 1 / direction_[z]};
}

absl::optional<double> RayShear::Hit(const std::array<Point, 3>& triangle) const {
  std::array<std::array<double, 2>, 3> corners;
  std::array<double, 3> depths;
  for (int i = 0; i < 3; ++i) {
    const Point off = triangle[i] - origin_;
    const double z = off[axes_[2]];
    corners[i] = {off[axes_[0]] - shear_[0] * z, off[axes_[1]] - shear_[1] * z};
    depths[i] = shear_[2] * z;
  }
  const auto& [a, b, c] = corners;
  const double u = c[0] * b[1] - c[1] * b[0], v = a[0] * c[1] - a[1] * c[0], w = b[0] * a[1] - b[1] * a[0];
  if ((u < 0 || v < 0 || w < 0) && (u > 0 || v > 0 || w > 0)) return absl::nullopt;
  const double sum = u + v + w;
  if (sum == 0) return absl::nullopt;
  // Divided before multiplied, or else products of small numbers vanish.
  const double t = depths[0] + v / sum * (depths[1] - depths[0]) + w / sum * (depths[2] - depths[0]);
  if (!(t >= 0)) return absl::nullopt;  // NaN too
  return t;
}

absl::optional<std::array<double, 2>> RayShear::Clip(const Box& box) const {
  const double slack = kSlack * (LargestOf(origin_) + std::max(LargestOf(box.low), LargestOf(box.high)));
  double first = 0, last = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    const double low = box.low[axis] - slack - origin_[axis], high = box.high[axis] + slack - origin_[axis];
    if (direction_[axis] == 0) {
      if (low > 0 || high < 0) return absl::nullopt;
      continue;
    }
    const double s = low / direction_[axis], t = high / direction_[axis];
    first = std::max(first, std::min(s, t));
    last = std::min(last, std::max(s, t));
  }
  if (!(first <= last) || !std::isfinite(last)) return absl::nullopt;
  return std::array<double, 2>{first, last};
}

Box RayShear::Cover(double first, double last) const {
  Box box{At(first), At(first)};
  Include(At(last), box);
  const double slack = kSlack * (LargestOf(origin_) + std::max(LargestOf(box.low), LargestOf(box.high)));
  for (int axis = 0; axis < 3; ++axis) {
    box.low[axis] -= slack;
    box.high[axis] += slack;
  }
  return box;
}

double RayShear::ToRay(double t) const { return std::ldexp(t, -exponent_); }

Point RayShear::At(double t) const { return origin_ + t * direction_; }

}  // namespace dynmesh
