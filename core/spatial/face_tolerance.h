#ifndef DYNMESH_CORE_SPATIAL_FACE_TOLERANCE_H_
#define DYNMESH_CORE_SPATIAL_FACE_TOLERANCE_H_

#include <algorithm>
#include <cmath>

#include "core/mesh/box.h"

namespace dynmesh {

/// How far from a face a point may lie to lie on it: a billionth of the diagonal of the face's bounding box.
/// Finite for every box.
inline double FaceTolerance(const Box& box) {
  const auto quarter = [&box](int axis) { return box.high[axis] / 4 - box.low[axis] / 4; };
  return 4e-9 * std::hypot(quarter(0), quarter(1), quarter(2));
}

/// A box that contains all points which are found to lie on a face, given the one round its corners: wider
/// than the tolerance by what rounding may do to a distance.
inline Box WidenByTolerance(Box box) {
  const double tolerance = FaceTolerance(box) * 1.001;
  for (int axis = 0; axis < 3; ++axis) {
    const double by = tolerance + 0x1p-50 * std::max(std::abs(box.low[axis]), std::abs(box.high[axis]));
    box.low[axis] = std::nextafter(box.low[axis] - by, -HUGE_VAL);
    box.high[axis] = std::nextafter(box.high[axis] + by, HUGE_VAL);
  }
  return box;
}

}  // namespace dynmesh

#endif  // DYNMESH_CORE_SPATIAL_FACE_TOLERANCE_H_
