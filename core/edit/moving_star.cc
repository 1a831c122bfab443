#include "core/edit/moving_star.h"

#include <algorithm>

#include "core/edit/geometry.h"
#include "core/edit/star.h"
#include "core/mesh/vector.h"

namespace dynmesh {

MovingStar::MovingStar(const Mesh& mesh, VertexId v) {
  const Star star = StarOf(mesh, v);
  shapes_.reserve(star.cells.size() + star.faces.size());
  for (CellId c : star.cells) Gather(mesh, c, v);
  for (FaceId f : star.faces) Gather(mesh, f, v);
}

void MovingStar::Gather(const Mesh& mesh, EntityId element, VertexId v) {
  Shape shape{mesh.Type(element), 0, {}, 0, {0, 0, 0}};
  const auto vertices = mesh.VerticesOf(element);
  for (size_t k = 0; k < vertices.size(); ++k) {
    shape.points[k] = mesh.Position(vertices[k]);
    if (vertices[k] == v) shape.corner = static_cast<int>(k);
  }
  const auto points = absl::MakeConstSpan(shape.points.data(), vertices.size());
  if (element.kind == EntityKind::kCell) {
    shape.orientation = Orientation(shape.type, points);
  } else if (!IsFlatFace(shape.type, points)) {
    shape.normal = AreaVector(shape.type, points);
  }
  shapes_.push_back(shape);
}

bool MovingStar::TurnsOver(const Shape& before, absl::Span<const Point> after) {
  if (KindOf(before.type) == EntityKind::kCell) {
    return before.orientation != 0 && Orientation(before.type, after) != before.orientation;
  }
  if (before.normal == Point{0, 0, 0}) return false;
  return IsFlatFace(before.type, after) || !(Dot(before.normal, AreaVector(before.type, after)) > 0);
}

double MovingStar::LeastAt(const Point& position, ShapeMeasure measure, double enough) const {
  double least = 1;
  for (const Shape& shape : shapes_) {
    std::array<Point, kMaxElementVertices> moved = shape.points;
    moved[shape.corner] = position;
    const auto points = absl::MakeConstSpan(moved.data(), NumVertices(shape.type));
    if (TurnsOver(shape, points)) return kTurnedOver;
    least = std::min(least, measure(shape.type, points));
    if (least < enough) return least;
  }
  return least;
}

}  // namespace dynmesh
