#include "core/spatial/containment.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/mesh/vector.h"

namespace dynmesh {
namespace {

/// Sign of the volume of a, b, c, d; 0 when rounding leaves it in doubt (Shewchuk's bound for orient3d).
/// REQUIRES: coordinates of at most 1 in absolute value, so that nothing overflows.
int SignOfVolume(const Point& a, const Point& b, const Point& c, const Point& d) {
  constexpr double kErrorBound = 8 * std::numeric_limits<double>::epsilon() / 2;
  const Point u = a - d, v = b - d, w = c - d;
  double volume = 0, magnitude = 0;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    const double plus = v[j] * w[k], minus = v[k] * w[j];
    volume += u[i] * (plus - minus);
    magnitude += std::abs(u[i]) * (std::abs(plus) + std::abs(minus));
  }
  const double doubt = kErrorBound * magnitude;
  return volume > doubt ? 1 : volume < -doubt ? -1 : 0;
}

enum class Place { kOutside, kOnSide, kInside };

struct TetPlace {
  Place place;
  int sign;  ///< of the tetrahedron's volume
};

TetPlace PlaceIn(const std::array<Point, 4>& tet, const Point& p) {
  const int sign = SignOfVolume(tet[0], tet[1], tet[2], tet[3]);
  if (sign == 0) return {Place::kOutside, 0};
  Place place = Place::kInside;
  for (int i = 0; i < 4; ++i) {
    std::array<Point, 4> corners = tet;
    corners[i] = p;
    const int side = SignOfVolume(corners[0], corners[1], corners[2], corners[3]);
    if (side == -sign) return {Place::kOutside, sign};
    if (side == 0) place = Place::kOnSide;
  }
  return {place, sign};
}

double LargestOf(const Point& p) { return std::max({std::abs(p[0]), std::abs(p[1]), std::abs(p[2])}); }

void Scale(int exponent, Point& p) {
  for (double& x : p) x = std::ldexp(x, -exponent);
}

/// A cell's corners and the point, scaled by a power of two.
struct LocalCell {
  std::array<Point, kMaxElementVertices> corners;
  int size = 0;
  Point point;

  LocalCell(const Mesh& mesh, CellId c, const Point& p) : point(p) {
    for (VertexId v : mesh.Vertices(c)) corners[size++] = mesh.Position(v);
    double largest = LargestOf(point);
    for (int i = 0; i < size; ++i) largest = std::max(largest, LargestOf(corners[i]));
    if (largest == 0) return;
    const int exponent = std::ilogb(largest) + 1;
    Scale(exponent, point);
    for (int i = 0; i < size; ++i) Scale(exponent, corners[i]);
  }

  Point Centroid() const {
    Point sum = {};
    for (int i = 0; i < size; ++i) sum = sum + corners[i];
    return (1.0 / size) * sum;
  }
};

/// Which corner of a face in template order the mesh's face begins with.
int FirstCorner(const Mesh& mesh, CellId c, int local_face) {
  const LocalFace& face = TemplateOf(mesh.Type(c)).faces[local_face];
  const VertexId first = mesh.Vertices(mesh.Faces(c)[local_face].face())[0];
  for (int k = 0; k < face.size; ++k) {
    if (mesh.Vertices(c)[face.vertices[k]] == first) return k;
  }
  return 0;
}

bool IsEnclosed(const Mesh& mesh, CellId c, const LocalCell& cell) {
  const ElementTemplate& shape = TemplateOf(mesh.Type(c));
  const Point apex = cell.Centroid();
  int winding = 0;
  for (int i = 0; i < shape.num_faces; ++i) {
    const LocalFace& face = shape.faces[i];
    const int first = face.size == 3 ? 0 : FirstCorner(mesh, c, i);
    const auto corner = [&](int k) { return cell.corners[face.vertices[(first + k) % face.size]]; };
    for (int k = 2; k < face.size; ++k) {
      const TetPlace found = PlaceIn({corner(0), corner(k - 1), corner(k), apex}, cell.point);
      if (found.place == Place::kOnSide) return true;
      if (found.place == Place::kInside) winding += found.sign;
    }
  }
  return winding != 0;
}

/// A face's corners and the point, scaled by a power of two where their fourth powers might overflow or
/// vanish.
struct LocalFacePoints {
  std::array<Point, 4> corners;
  size_t size = 0;
  Point point;
  int exponent = 0;

  LocalFacePoints(const Mesh& mesh, FaceId f, const Point& p) : point(p) {
    double largest = LargestOf(p);
    for (VertexId v : mesh.Vertices(f)) {
      corners[size] = mesh.Position(v);
      largest = std::max(largest, LargestOf(corners[size++]));
    }
    if (largest == 0 || std::abs(std::ilogb(largest)) <= kHarmless) return;
    exponent = std::ilogb(largest) + 1;
    Scale(exponent, point);
    for (size_t i = 0; i < size; ++i) Scale(exponent, corners[i]);
  }

 private:
  static constexpr int kHarmless = 100;
};

double DistanceToSegment(const Point& a, const Point& b, const Point& p) {
  const Point along = b - a;
  const double length2 = Dot(along, along);
  const double t = length2 > 0 ? std::clamp(Dot(p - a, along) / length2, 0.0, 1.0) : 0;
  const Point off = p - (a + t * along);
  return std::sqrt(Dot(off, off));
}

double DistanceToTriangle(const std::array<Point, 3>& corners, const Point& p) {
  const Point normal = Cross(corners[1] - corners[0], corners[2] - corners[0]);
  const double length = std::hypot(normal[0], normal[1], normal[2]);
  bool above = length > 0;
  double distance = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 3; ++i) {
    const Point &a = corners[i], &b = corners[(i + 1) % 3];
    above = above && Dot(Cross(b - a, p - a), normal) >= 0;
    distance = std::min(distance, DistanceToSegment(a, b, p));
  }
  return above ? std::min(distance, std::abs(Dot(p - corners[0], normal)) / length) : distance;
}

}  // namespace

bool ContainsPoint(const Mesh& mesh, CellId c, const Point& p) {
  const LocalCell cell(mesh, c, p);
  if (mesh.Type(c) != ElementType::kTetrahedron) return IsEnclosed(mesh, c, cell);
  return PlaceIn({cell.corners[0], cell.corners[1], cell.corners[2], cell.corners[3]}, cell.point).place !=
         Place::kOutside;
}

double DistanceTo(const Mesh& mesh, FaceId f, const Point& p) {
  const LocalFacePoints face(mesh, f, p);
  double distance = std::numeric_limits<double>::infinity();
  for (size_t k = 2; k < face.size; ++k) {
    distance = std::min(
        distance, DistanceToTriangle({face.corners[0], face.corners[k - 1], face.corners[k]}, face.point));
  }
  return std::ldexp(distance, face.exponent);
}

}  // namespace dynmesh
