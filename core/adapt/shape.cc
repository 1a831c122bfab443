#include "core/adapt/shape.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/edit/geometry.h"
#include "core/mesh/vector.h"

namespace dynmesh {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kLeastInBand = 0.7, kMostInBand = 1.4;

double Length(const Point& p) { return std::sqrt(Dot(p, p)); }

double SmallestCorner(absl::Span<const Point> p) {
  double smallest = kInfinity;
  for (int k = 0; k < 3; ++k) {
    const Point next = p[(k + 1) % 3] - p[k], before = p[(k + 2) % 3] - p[k];
    smallest = std::min(smallest, std::atan2(Length(Cross(next, before)), Dot(next, before)));
  }
  return smallest;
}

/// Of the regular tetrahedron and triangle.
double RegularAngle(ElementType type) {
  static const double kTetrahedron = std::acos(1.0 / 3), kTriangle = std::acos(0.5);
  return type == ElementType::kTetrahedron ? kTetrahedron : kTriangle;
}

}  // namespace

double SmallestAngle(ElementType type, absl::Span<const Point> points) {
  return type == ElementType::kTetrahedron ? SmallestDihedralAngle(points) : SmallestCorner(points);
}

double Goodness::operator()(ElementType type, absl::Span<const Point> points) const {
  const double angle = SmallestAngle(type, points);
  if (angle < floor_) return kBelowFloor * (angle / floor_);
  return std::min(Quality(type, points), angle / RegularAngle(type));
}

double Goodness::Of(const Mesh& mesh, EntityId element) const { return WithPoints(mesh, element, *this); }

double SmallestAngleOf(const Mesh& mesh) {
  double smallest = kInfinity;
  ForEachAdaptable(mesh, [&](EntityId element) {
    smallest = std::min(smallest, WithPoints(mesh, element, SmallestAngle));
  });
  return smallest < kInfinity ? smallest : 0;
}

MeshShape MeasureShape(const Mesh& mesh, const Sizing& sizing) {
  MeshShape shape;
  shape.min_length = kInfinity;
  uint64_t in_band = 0;
  double sum = 0;
  mesh.slots(EntityKind::kEdge).live().ForEach([&](Slot slot) {
    const EdgeId e(slot);
    const double length = WithPoints(mesh, e, Measure), ratio = sizing.RatioOf(mesh, e);
    ++shape.num_edges;
    sum += length;
    shape.min_length = std::min(shape.min_length, length);
    shape.max_length = std::max(shape.max_length, length);
    in_band += ratio >= kLeastInBand && ratio <= kMostInBand;
  });
  shape.least_quality = kInfinity;
  ForEachAdaptable(mesh, [&](EntityId element) {
    ++shape.num_elements;
    shape.least_quality = std::min(shape.least_quality, WithPoints(mesh, element, Quality));
  });
  shape.smallest_angle = SmallestAngleOf(mesh);
  if (shape.num_elements == 0) shape.least_quality = 0;
  if (shape.num_edges == 0) shape.min_length = 0;
  if (shape.num_edges == 0) return shape;
  shape.mean_length = sum / static_cast<double>(shape.num_edges);
  shape.share_in_band = static_cast<double>(in_band) / static_cast<double>(shape.num_edges);
  return shape;
}

}  // namespace dynmesh
