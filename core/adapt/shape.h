#ifndef DYNMESH_CORE_ADAPT_SHAPE_H_
#define DYNMESH_CORE_ADAPT_SHAPE_H_

#include "absl/types/span.h"
#include "core/adapt/adapt.h"
#include "core/adapt/sizing.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

/// Of a tetrahedron the smallest dihedral angle, of a triangle the smallest of its corners; radians.
/// REQUIRES: type is one of these.
double SmallestAngle(ElementType type, absl::Span<const Point> points);

/// How good triangles and tetrahedra are, for comparing what was with what would be: the smaller of Quality
/// and SmallestAngle over that of the regular shape, from 0 to 1.
///
/// Elements whose angle is below `floor` are all worse than others, so that who never accepts a worse shape
/// never lets one in: then their number is below kBelowFloor.
class Goodness {
 public:
  static constexpr double kBelowFloor = 1e-3;

  explicit Goodness(double floor) : floor_(floor) {}

  double operator()(ElementType type, absl::Span<const Point> points) const;
  double Of(const Mesh& mesh, EntityId element) const;

 private:
  double floor_;
};

/// Calls fn(type, points) with the points of an edge, face or cell, and returns what it returns.
template <typename Fn>
auto WithPoints(const Mesh& mesh, EntityId element, Fn fn) {
  std::array<Point, kMaxElementVertices> points;
  const auto vertices = mesh.VerticesOf(element);
  for (size_t k = 0; k < vertices.size(); ++k) points[k] = mesh.Position(vertices[k]);
  return fn(mesh.Type(element), absl::MakeConstSpan(points.data(), vertices.size()));
}

/// The kind of the elements of a mesh that can be adapted: cells if there are any, else faces.
inline EntityKind ElementKindOf(const Mesh& mesh) {
  return mesh.NumElements(EntityKind::kCell) > 0 ? EntityKind::kCell : EntityKind::kFace;
}

/// Calls fn(element) for each element of that kind.
template <typename Fn>
void ForEachAdaptable(const Mesh& mesh, Fn fn) {
  const EntityKind kind = ElementKindOf(mesh);
  mesh.slots(kind).live().ForEach([&](Slot slot) {
    if (mesh.IsElement(EntityId(kind, slot))) fn(EntityId(kind, slot));
  });
}

/// The smallest SmallestAngle; 0 without elements. REQUIRES: all are triangles or tetrahedra.
double SmallestAngleOf(const Mesh& mesh);

/// Cost: edges and elements. REQUIRES: all are triangles or tetrahedra.
MeshShape MeasureShape(const Mesh& mesh, const Sizing& sizing);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_ADAPT_SHAPE_H_
