#ifndef DYNMESH_CORE_SPATIAL_FRAME_H_
#define DYNMESH_CORE_SPATIAL_FRAME_H_

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/mesh/box.h"
#include "core/spatial/box_tree.h"

namespace dynmesh {

/// Boxes in single precision that never miss: where two boxes in double precision meet, their images meet.
///
/// For the image of a coordinate, (x - origin) * 2^k rounded to a float, never falls when x grows, so what is
/// no higher stays no higher. Origin and k are chosen so that a given box becomes about [-1, 1]: thus meshes
/// that lie far from the origin, and very large or small ones, lose little to the few bits. Other places are
/// mapped as well, with as many bits of their distance from that box; what overflows is put to the largest
/// float.
class Frame {
 public:
  Frame() = default;
  explicit Frame(const Box& box) : Frame(box, box) {}
  /// One for `box`, where `bounds` is not to overflow, nor the squares of its places.
  Frame(const Box& box, const Box& bounds) {
    for (int axis = 0; axis < 3; ++axis) origin_[axis] = box.low[axis] / 2 + box.high[axis] / 2;
    const double radius = std::max(RadiusOf(box), 0x1p-60 * RadiusOf(bounds));
    if (radius > 0) scale_ = std::ldexp(1.0, -std::max(std::ilogb(radius), kMinExponent));
  }

  FloatBox Round(const Box& box) const { return {Round(box.low), Round(box.high)}; }

  std::array<float, 3> Round(const Point& point) const {
    return {Round(point[0], 0), Round(point[1], 1), Round(point[2], 2)};
  }

 private:
  static constexpr float kMax = std::numeric_limits<float>::max();
  static constexpr int kMinExponent = -1000;

  static double RadiusOf(const Box& box) {
    double radius = 0;
    for (int axis = 0; axis < 3; ++axis) radius = std::max(radius, box.high[axis] / 2 - box.low[axis] / 2);
    return radius;
  }

  float Round(double x, int axis) const {
    return static_cast<float>(std::clamp((x - origin_[axis]) * scale_, -double{kMax}, double{kMax}));
  }

  Point origin_ = {};
  double scale_ = 1;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_SPATIAL_FRAME_H_
