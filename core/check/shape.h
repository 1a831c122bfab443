#ifndef DYNMESH_CORE_CHECK_SHAPE_H_
#define DYNMESH_CORE_CHECK_SHAPE_H_

#include "absl/types/span.h"
#include "core/mesh/checksum.h"
#include "core/mesh/element_type.h"

/// Measures of single shapes that checks need besides those of core/edit/geometry.h, from points in template
/// order. None depends on the size of the shape. Flat and collapsed shapes have angles of 0 and ratios that
/// are infinite.
namespace dynmesh {

/// Smallest and largest of some angles, in degrees.
struct AngleRange {
  double smallest = 360;
  double largest = 0;
};

/// |Measure()| over the power of the longest edge that it has; 0 where all points are one.
double RelativeMeasure(ElementType type, absl::Span<const Point> points);

/// Of the corners of a triangle or quad, inside of it: more than 180 where a quad turns inwards, as seen
/// along its area vector. REQUIRES: type is one of these.
AngleRange FaceAngles(ElementType type, absl::Span<const Point> points);

/// Between the faces of a cell that share an edge, inside of the cell: more than 180 where it turns inwards.
/// Quads have the direction of their area vector. The same for either orientation. REQUIRES: type is a
/// cell's.
AngleRange DihedralAngles(ElementType type, absl::Span<const Point> points);

/// Of a triangle or tetrahedron the longest edge over the radius of the inscribed circle or sphere, of others
/// over the shortest edge, and all of that over what the regular shape has. From 1.
double AspectRatio(ElementType type, absl::Span<const Point> points);

/// The largest condition number of a corner: of the map from the regular corner to it, in the Frobenius norm,
/// over that of the identity (Knupp, "Algebraic mesh quality metrics", SIAM J. Sci. Comput. 23, 2001).
/// From 1. REQUIRES: type is a face's or a cell's.
double ConditionNumber(ElementType type, absl::Span<const Point> points);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_CHECK_SHAPE_H_
