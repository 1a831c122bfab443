#include "core/edit/geometry.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "absl/types/optional.h"
#include "core/edit/corners.h"
#include "core/mesh/vector.h"

namespace dynmesh {
namespace {

/// The scaled Jacobian at a corner of the regular shape.
double RegularCorner(ElementType type) {
  switch (type) {
    case ElementType::kPyramid:
      return std::sqrt(0.5);  // all edges of one length
    case ElementType::kPrism:
      return std::sqrt(0.75);
    default:
      return 1;
  }
}

double Length(const Point& p) { return std::sqrt(Dot(p, p)); }

double CornerVolume(const Corner& corner, absl::Span<const Point> p) {
  const Point& o = p[corner.at];
  return Dot(Cross(p[corner.ends[0]] - o, p[corner.ends[1]] - o), p[corner.ends[2]] - o);
}

double ScaledJacobian(const Corner& corner, absl::Span<const Point> p) {
  double lengths = 1;
  for (uint8_t end : corner.ends) lengths *= Length(p[end] - p[corner.at]);
  return lengths > 0 ? CornerVolume(corner, p) / lengths : 0;
}

double ScaledJacobianOfQuad(absl::Span<const Point> p) {
  const Point normal = AreaVector(ElementType::kQuad, p);
  const double size = Length(normal);
  double worst = 1;
  for (int k = 0; k < 4; ++k) {
    const Point next = p[(k + 1) % 4] - p[k], before = p[(k + 3) % 4] - p[k];
    const double lengths = Length(next) * Length(before) * size;
    worst = std::min(worst, lengths > 0 ? Dot(Cross(next, before), normal) / lengths : 0);
  }
  return std::max(worst, 0.0);
}

double SumOfSquaredEdges(ElementType type, absl::Span<const Point> p) {
  const ElementTemplate& shape = TemplateOf(type);
  double sum = 0;
  for (int e = 0; e < shape.num_edges; ++e) {
    const Point edge = p[shape.edges[e].vertices[1]] - p[shape.edges[e].vertices[0]];
    sum += Dot(edge, edge);
  }
  return sum;
}

double SixVolumes(const Point& a, const Point& b, const Point& c, const Point& d) {
  return Dot(Cross(b - a, c - a), d - a);
}

/// From the first vertex to all faces, which are oriented outwards.
double SixVolumes(ElementType type, absl::Span<const Point> p) {
  if (type == ElementType::kTetrahedron) return SixVolumes(p[0], p[1], p[2], p[3]);
  const ElementTemplate& shape = TemplateOf(type);
  double sum = 0;
  for (int i = 0; i < shape.num_faces; ++i) {
    const auto& v = shape.faces[i].vertices;
    for (int k = 2; k < shape.faces[i].size; ++k) sum -= SixVolumes(p[v[0]], p[v[k - 1]], p[v[k]], p[0]);
  }
  return sum;
}

double MeanRatioOfTetrahedron(absl::Span<const Point> p) {
  const double squares = SumOfSquaredEdges(ElementType::kTetrahedron, p);
  if (!(squares > 0)) return 0;
  const double root = std::cbrt(std::abs(SixVolumes(ElementType::kTetrahedron, p)) / 2);
  return 12 * root * root / squares;
}

double MeanRatioOfTriangle(absl::Span<const Point> p) {
  const double squares = SumOfSquaredEdges(ElementType::kTriangle, p);
  return squares > 0 ? 2 * std::sqrt(3.0) * Length(AreaVector(ElementType::kTriangle, p)) / squares : 0;
}

double WorstCorner(ElementType type, absl::Span<const Point> p) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const Corner& corner : CornersOf(type)) {
    const double jacobian = ScaledJacobian(corner, p);
    low = std::min(low, jacobian);
    high = std::max(high, jacobian);
  }
  const double worst = low > 0 ? low : high < 0 ? -high : 0;
  return std::min(1.0, worst / RegularCorner(type));
}

/// All corners of a tetrahedron have the same volume, so no root need be drawn; nullopt where squares of
/// lengths would leave the range of numbers.
absl::optional<int> OrientationOfTetrahedron(absl::Span<const Point> p) {
  constexpr double kSmallest = 1e-280, kLargest = 1e280;
  const auto square = [&](int i, int j) { return Dot(p[j] - p[i], p[j] - p[i]); };
  const double s01 = square(0, 1), s02 = square(0, 2), s03 = square(0, 3);
  const double s12 = square(1, 2), s13 = square(1, 3), s23 = square(2, 3);
  const double longest = std::max({s01 * s02 * s03, s01 * s12 * s13, s02 * s12 * s23, s03 * s13 * s23});
  if (!(longest > kSmallest && longest < kLargest)) return absl::nullopt;
  const double volume = SixVolumes(p[0], p[1], p[2], p[3]);
  if (volume * volume <= kFlat * kFlat * longest) return 0;
  return volume > 0 ? 1 : -1;
}

}  // namespace

Point AreaVector(ElementType type, absl::Span<const Point> p) {
  const Point first = Cross(p[1] - p[0], p[2] - p[0]);
  return type == ElementType::kTriangle ? first : first + Cross(p[2] - p[0], p[3] - p[0]);
}

double Measure(ElementType type, absl::Span<const Point> p) {
  switch (KindOf(type)) {
    case EntityKind::kEdge:
      return Length(p[1] - p[0]);
    case EntityKind::kFace: {
      const double first = Length(Cross(p[1] - p[0], p[2] - p[0])) / 2;
      return type == ElementType::kTriangle ? first : first + Length(Cross(p[2] - p[0], p[3] - p[0])) / 2;
    }
    default:
      return SixVolumes(type, p) / 6;
  }
}

int Orientation(ElementType type, absl::Span<const Point> p) {
  if (KindOf(type) != EntityKind::kCell) return 0;
  if (type == ElementType::kTetrahedron) {
    if (const auto orientation = OrientationOfTetrahedron(p)) return *orientation;
  }
  bool positive = true, negative = true;
  for (const Corner& corner : CornersOf(type)) {
    const double jacobian = ScaledJacobian(corner, p);
    positive &= jacobian > kFlat;
    negative &= jacobian < -kFlat;
  }
  return positive ? 1 : negative ? -1 : 0;
}

bool IsFlatFace(ElementType type, absl::Span<const Point> p) {
  double longest = 0;
  const int n = NumVertices(type);
  for (int k = 0; k < n; ++k) longest = std::max(longest, Length(p[(k + 1) % n] - p[k]));
  return !(Length(AreaVector(type, p)) > kFlat * longest * longest);
}

double SmallestScaledJacobian(ElementType type, absl::Span<const Point> p) {
  double low = 1;
  for (const Corner& corner : CornersOf(type)) low = std::min(low, ScaledJacobian(corner, p));
  return low;
}

double Quality(ElementType type, absl::Span<const Point> p) {
  switch (type) {
    case ElementType::kTriangle:
      return MeanRatioOfTriangle(p);
    case ElementType::kQuad:
      return ScaledJacobianOfQuad(p);
    case ElementType::kTetrahedron:
      return MeanRatioOfTetrahedron(p);
    case ElementType::kWireEdge:
      return 1;
    default:
      return WorstCorner(type, p);
  }
}

double SmallestDihedralAngle(absl::Span<const Point> p) {
  const ElementTemplate& shape = TemplateOf(ElementType::kTetrahedron);
  std::array<Point, 4> normals;
  std::array<double, 4> lengths;
  for (int i = 0; i < 4; ++i) {
    const auto& v = shape.faces[i].vertices;
    normals[i] = Cross(p[v[1]] - p[v[0]], p[v[2]] - p[v[0]]);
    lengths[i] = Length(normals[i]);
  }
  // Which angle is smallest the cosines tell, which are cheap; how small, only the arc tangent tells exactly.
  double largest = -std::numeric_limits<double>::infinity();
  int first = 0, second = 1;
  for (int i = 0; i < 4; ++i) {
    for (int j = i + 1; j < 4; ++j) {
      const double product = lengths[i] * lengths[j];
      const double cosine = product > 0 ? -Dot(normals[i], normals[j]) / product : 1;
      if (cosine <= largest) continue;
      largest = cosine;
      first = i;
      second = j;
    }
  }
  return std::atan2(Length(Cross(normals[first], normals[second])), -Dot(normals[first], normals[second]));
}

}  // namespace dynmesh
