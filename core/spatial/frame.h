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
/// The image of a coordinate is (x - origin) * 2^k, which grows with x after rounding too; boxes are then
/// rounded outwards. Origin and k are chosen so that a given box becomes about [-1, 1]: thus meshes that lie
/// far from the origin, and very large or small ones, lose nothing to the few bits. Other places may be
/// mapped as well; what overflows is put to the largest float.
class Frame {
 public:
  Frame() = default;
  explicit Frame(const Box& box) {
    double radius = 0;
    for (int axis = 0; axis < 3; ++axis) {
      origin_[axis] = box.low[axis] / 2 + box.high[axis] / 2;
      radius = std::max(radius, box.high[axis] / 2 - box.low[axis] / 2);
    }
    if (radius > 0) scale_ = std::ldexp(1.0, -std::max(std::ilogb(radius), kMinExponent));
  }

  FloatBox Round(const Box& box) const {
    FloatBox image;
    for (int axis = 0; axis < 3; ++axis) {
      image.low[axis] = RoundDown(Map(box.low[axis], axis));
      image.high[axis] = RoundUp(Map(box.high[axis], axis));
    }
    return image;
  }

  std::array<float, 3> Nearest(const Point& point) const {
    std::array<float, 3> image;
    for (int axis = 0; axis < 3; ++axis) image[axis] = static_cast<float>(Map(point[axis], axis));
    return image;
  }

 private:
  static constexpr float kMax = std::numeric_limits<float>::max();
  static constexpr int kMinExponent = -1000;

  double Map(double x, int axis) const {
    return std::clamp((x - origin_[axis]) * scale_, -double{kMax}, double{kMax});
  }
  static float RoundDown(double x) {
    const float rounded = static_cast<float>(x);
    return rounded > x ? std::nextafter(rounded, -kMax) : rounded;
  }
  static float RoundUp(double x) {
    const float rounded = static_cast<float>(x);
    return rounded < x ? std::nextafter(rounded, kMax) : rounded;
  }

  Point origin_ = {};
  double scale_ = 1;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_SPATIAL_FRAME_H_
