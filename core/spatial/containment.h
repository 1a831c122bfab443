#ifndef DYNMESH_CORE_SPATIAL_CONTAINMENT_H_
#define DYNMESH_CORE_SPATIAL_CONTAINMENT_H_

#include <cstdint>

#include "core/mesh/mesh.h"

namespace dynmesh {

/// Steps of a WorkMeter that ContainsPoint takes in a cell of a type, and DistanceTo in a face.
constexpr uint64_t StepsToContain(ElementType type) {
  return type == ElementType::kTetrahedron ? 10 : type == ElementType::kHexahedron ? 100 : 60;
}
inline constexpr uint64_t kStepsToMeasure = 10;

/// Whether a cell contains a point; its faces belong to it.
///
/// A cell is the solid between its faces; a quad face is two triangles, cut along the diagonal of the first
/// vertex of the mesh's face, so that cells which share it agree where it lies: in a conforming mesh no point
/// is lost between cells, and none lies inside of two. The cell is cut into tetrahedra from its centroid to
/// those triangles; each that holds the point counts once, with the sign of its volume, and the point is
/// inside where the sum is not zero. So warped, inverted and non-convex cells have the inside that their
/// faces enclose; cells without volume have none. Signs of volumes are taken for zero where rounding leaves
/// them in doubt, and zero counts as inside: a point that is inside in exact arithmetic always is here, and
/// one outside may be taken in at distances of some 1e-15 of the coordinates. (In a cell that is not
/// star-shaped from its centroid, such a point may also lie at the extension of an inner wall.) REQUIRES: `c`
/// is live. Cost: O(1), at most 60 determinants.
bool ContainsPoint(const Mesh& mesh, CellId c, const Point& p);

/// Distance from a point to a face, whose quads are cut as above. Infinite where that exceeds double
/// precision; however large or small the face is, no product within overflows or vanishes.
/// REQUIRES: `f` is live.
double DistanceTo(const Mesh& mesh, FaceId f, const Point& p);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_SPATIAL_CONTAINMENT_H_
