#ifndef DYNMESH_CORE_EDIT_GEOMETRY_H_
#define DYNMESH_CORE_EDIT_GEOMETRY_H_

#include "absl/types/span.h"
#include "core/mesh/checksum.h"
#include "core/mesh/element_type.h"

/// Measures of single elements, from their points in template order.
namespace dynmesh {

/// Length, area or volume, in the units of the positions; the volume of a cell is negative where it lies
/// against the orientation of its template. Quads and faces of cells are cut along their first diagonal.
double Measure(ElementType type, absl::Span<const Point> points);

/// Twice the area vector of a triangle or quad. REQUIRES: type is one of these.
Point AreaVector(ElementType type, absl::Span<const Point> points);

/// Shapes count as flat below this scaled Jacobian, or area vector over the square of the longest edge:
/// rounding makes such of flat ones.
inline constexpr double kFlat = 1e-9;

/// Of a cell: 1 if all its corners have the orientation of the template, -1 if all have the other, 0 else:
/// the cell is flat or folded somewhere. A corner is the tetrahedron of a vertex and the ends of its three
/// edges.
int Orientation(ElementType type, absl::Span<const Point> points);

/// Of the corners of a cell, by the orientation of its template: from 1 (three right angles) to -1; less than
/// 0 where a corner lies the other way. REQUIRES: type is a cell's.
double SmallestScaledJacobian(ElementType type, absl::Span<const Point> points);

/// Whether a triangle or quad has no side that it faces. REQUIRES: type is one of these.
bool IsFlatFace(ElementType type, absl::Span<const Point> points);

/// How good the shape is, from 1 (regular) to 0 (flat, or folded); no unit, and the same for either
/// orientation.
///
/// Triangle: 4 sqrt(3) A / sum of squared edge lengths; tetrahedron: 12 (3 |V|)^(2/3) / sum of squared edge
/// lengths (mean ratio; Liu and Joe, "Relationship between tetrahedron shape measures", BIT 34, 1994).
/// Others: the smallest scaled Jacobian of a corner, which is |det(e1, e2, e3)| / (|e1| |e2| |e3|), over that
/// of the regular shape. Wire edges: 1.
double Quality(ElementType type, absl::Span<const Point> points);

/// The smallest angle between two faces of a tetrahedron, inside of it, in radians.
double SmallestDihedralAngle(absl::Span<const Point> points);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_EDIT_GEOMETRY_H_
