#ifndef DYNMESH_CORE_SPATIAL_RAY_H_
#define DYNMESH_CORE_SPATIAL_RAY_H_

#include <array>

#include "absl/types/optional.h"
#include "core/mesh/box.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

/// The points origin + t * direction for t >= 0. The direction need not be of unit length.
struct Ray {
  Point origin;
  Point direction;
};

/// Where a ray meets triangles, without gaps: a ray that passes between two triangles which share an edge, by
/// however little, hits at least one of them. (S. Woop, C. Benthin, I. Wald, "Watertight Ray/Triangle
/// Intersection", JCGT 2(1), 2013.)
///
/// Thread safety: that of std::vector.
class RayShear {
 public:
  /// REQUIRES: finite, and the direction is not zero.
  explicit RayShear(const Ray& ray);

  /// The t of the hit; nullopt without one, and when the ray lies in the triangle's plane.
  absl::optional<double> Hit(const std::array<Point, 3>& triangle) const;

  /// The part of the ray inside of a box, as [first, last]; nullopt when it misses. Somewhat more than the
  /// part, never less. REQUIRES: the box is finite.
  absl::optional<std::array<double, 2>> Clip(const Box& box) const;

  /// A box round the points of parameters first and last.
  Box Cover(double first, double last) const;

  /// Parameters of Hit() in terms of the ray's own direction.
  double ToRay(double t) const;

 private:
  Point At(double t) const;

  Point origin_;
  Point direction_;  ///< scaled by a power of two, so that its largest component lies in [1, 2)
  int exponent_;
  std::array<int, 3> axes_;  ///< the last is that of the largest component
  Point shear_;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_SPATIAL_RAY_H_
