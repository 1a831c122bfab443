#include "core/check/shape.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/edit/corners.h"
#include "core/edit/geometry.h"
#include "core/mesh/vector.h"

namespace dynmesh {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kDegrees = 180 / 3.14159265358979323846;

double Length(const Point& p) { return std::sqrt(Dot(p, p)); }

struct EdgeLengths {
  double shortest = kInfinity;
  double longest = 0;
  double sum = 0;
};

EdgeLengths LengthsOf(ElementType type, absl::Span<const Point> p) {
  const ElementTemplate& shape = TemplateOf(type);
  EdgeLengths lengths;
  for (int e = 0; e < shape.num_edges; ++e) {
    const double length = Length(p[shape.edges[e].vertices[1]] - p[shape.edges[e].vertices[0]]);
    lengths.shortest = std::min(lengths.shortest, length);
    lengths.longest = std::max(lengths.longest, length);
    lengths.sum += length;
  }
  return lengths;
}

double Ratio(double above, double below) { return below > 0 ? above / below : kInfinity; }

/// From 0 to 360: `cross` is the cross product of two directions, and tells by its side whether the angle
/// between them is less than 180.
double AngleOf(const Point& cross, double dot, double side) {
  const double angle = std::atan2(Length(cross), dot + 0.0) * kDegrees;  // -0.0 would be 180 degrees
  return side < 0 ? 360 - angle : angle;
}

void Add(double angle, AngleRange& range) {
  range.smallest = std::min(range.smallest, angle);
  range.largest = std::max(range.largest, angle);
}

/// Points of one face of a cell, and its area vector.
struct CellFace {
  CellFace(const LocalFace& face, absl::Span<const Point> p) {
    for (int k = 0; k < face.size; ++k) points[k] = p[face.vertices[k]];
    const auto type = face.size == 3 ? ElementType::kTriangle : ElementType::kQuad;
    normal = AreaVector(type, absl::MakeConstSpan(points.data(), face.size));
  }

  std::array<Point, kMaxFaceVertices> points;
  Point normal;
};

double RadiusOfInscribedSphere(absl::Span<const Point> p) {
  double area = 0;
  for (const LocalFace& face : absl::MakeConstSpan(TemplateOf(ElementType::kTetrahedron).faces, 4)) {
    area += Length(CellFace(face, p).normal) / 2;
  }
  return area > 0 ? 3 * std::abs(Measure(ElementType::kTetrahedron, p)) / area : 0;
}

/// The edges of a regular corner are the columns of {{1, a, b}, {0, c, d}, {0, 0, e}}.
struct RegularCorner {
  double a, b, c, d, e;
};

RegularCorner RegularCornerOf(ElementType type) {
  const double h = std::sqrt(0.75);
  switch (type) {
    case ElementType::kTriangle:
      return {0.5, 0, h, 0, 1};
    case ElementType::kTetrahedron:
      return {0.5, 0.5, h, h / 3, std::sqrt(2.0 / 3)};
    case ElementType::kPyramid:
      return {0, 0.5, 1, 0.5, std::sqrt(0.5)};
    case ElementType::kPrism:
      return {0.5, 0, h, 0, 1};
    default:
      return {0, 0, 1, 0, 1};
  }
}

double ConditionOfCorner(const RegularCorner& regular, const Point& u, const Point& v, const Point& w) {
  const Point second = (1 / regular.c) * (v - regular.a * u);
  const Point third = (1 / regular.e) * (w - regular.b * u - regular.d * second);
  const Point x = Cross(second, third), y = Cross(third, u), z = Cross(u, second);
  const double norm = std::sqrt(Dot(u, u) + Dot(second, second) + Dot(third, third));
  return Ratio(norm * std::sqrt(Dot(x, x) + Dot(y, y) + Dot(z, z)), 3 * std::abs(Dot(u, x)));
}

double ConditionOfCell(ElementType type, absl::Span<const Point> p) {
  const RegularCorner regular = RegularCornerOf(type);
  auto corners = CornersOf(type);
  if (type == ElementType::kTetrahedron) corners = corners.first(1);  // all are worth the same
  double worst = 0;
  for (const Corner& corner : corners) {
    const Point& o = p[corner.at];
    const Point u = p[corner.ends[0]] - o, v = p[corner.ends[1]] - o, w = p[corner.ends[2]] - o;
    worst = std::max(worst, ConditionOfCorner(regular, u, v, w));
  }
  return worst;
}

double ConditionOfFace(ElementType type, absl::Span<const Point> p) {
  const RegularCorner regular = RegularCornerOf(type);
  const int n = NumVertices(type);
  double worst = 0;
  for (int k = 0; k < (n == 3 ? 1 : n); ++k) {  // all corners of a triangle are worth the same
    const Point u = p[(k + 1) % n] - p[k], v = p[(k + n - 1) % n] - p[k];
    const Point second = (1 / regular.c) * (v - regular.a * u);
    worst = std::max(worst, Ratio(Dot(u, u) + Dot(second, second), 2 * Length(Cross(u, second))));
  }
  return worst;
}

}  // namespace

double RelativeMeasure(ElementType type, absl::Span<const Point> p) {
  const double longest = LengthsOf(type, p).longest;
  return longest > 0 ? std::abs(Measure(type, p)) / std::pow(longest, Dimension(KindOf(type))) : 0;
}

AngleRange FaceAngles(ElementType type, absl::Span<const Point> p) {
  const Point normal = AreaVector(type, p);
  const int n = NumVertices(type);
  AngleRange range;
  for (int k = 0; k < n; ++k) {
    const Point next = p[(k + 1) % n] - p[k], before = p[(k + n - 1) % n] - p[k];
    const Point cross = Cross(next, before);
    Add(AngleOf(cross, Dot(next, before), Dot(cross, normal)), range);
  }
  return range;
}

AngleRange DihedralAngles(ElementType type, absl::Span<const Point> p) {
  const ElementTemplate& shape = TemplateOf(type);
  const double side = Measure(type, p) < 0 ? -1 : 1;
  std::array<int, kMaxElementEdges> first;  // the face that was met first at each edge
  first.fill(-1);
  AngleRange range;
  for (int i = 0; i < shape.num_faces; ++i) {
    const CellFace face(shape.faces[i], p);
    for (int k = 0; k < shape.faces[i].size; ++k) {
      int& other = first[shape.faces[i].edges[k]];
      if (other < 0) {
        other = i;
        continue;
      }
      // Where the cell is convex, the two normals and the edge as it runs in face i turn right-handed.
      const Point along = face.points[(k + 1) % shape.faces[i].size] - face.points[k];
      const Point normal = CellFace(shape.faces[other], p).normal;
      const Point cross = Cross(face.normal, normal);
      Add(AngleOf(cross, -Dot(face.normal, normal), side * Dot(cross, along)), range);
    }
  }
  return range;
}

double AspectRatio(ElementType type, absl::Span<const Point> p) {
  const EdgeLengths lengths = LengthsOf(type, p);
  switch (type) {
    case ElementType::kTriangle:
      return Ratio(lengths.longest * lengths.sum, 4 * std::sqrt(3.0) * Measure(type, p));
    case ElementType::kTetrahedron:
      return Ratio(lengths.longest, 2 * std::sqrt(6.0) * RadiusOfInscribedSphere(p));
    default:
      return Ratio(lengths.longest, lengths.shortest);
  }
}

double ConditionNumber(ElementType type, absl::Span<const Point> p) {
  return KindOf(type) == EntityKind::kFace ? ConditionOfFace(type, p) : ConditionOfCell(type, p);
}

}  // namespace dynmesh
