#include "core/adapt/surface_star.h"

#include <algorithm>
#include <cmath>

#include "core/adapt/features.h"
#include "core/edit/star.h"
#include "core/mesh/vector.h"

namespace dynmesh {
namespace {

/// How far a place may lie outside of a triangle, as a share of its area: rounding puts such on an edge.
constexpr double kSlack = 1e-9;

}  // namespace

SurfaceStar::SurfaceStar(const Mesh& mesh, VertexId v) : at_(mesh.Position(v)) {
  std::vector<FaceId> faces;
  for (EdgeId e : mesh.IncidentEdges(v)) {
    for (FaceId f : mesh.IncidentFaces(e)) {
      if (IsOfSurface(mesh, f)) faces.push_back(f);
    }
  }
  std::sort(faces.begin(), faces.end());
  faces.erase(std::unique(faces.begin(), faces.end()), faces.end());
  for (FaceId f : faces) Gather(mesh, f, v);
}

void SurfaceStar::Gather(const Mesh& mesh, FaceId f, VertexId v) {
  const auto vertices = mesh.Vertices(f);
  if (vertices.size() != 3) return;
  const size_t corner = std::find(vertices.begin(), vertices.end(), v) - vertices.begin();
  const VertexId a = vertices[(corner + 1) % 3], b = vertices[(corner + 2) % 3];
  const Point pa = mesh.Position(a), pb = mesh.Position(b);
  triangles_.push_back({{a, b}, {pa, pb}, Cross(pa - at_, pb - at_)});
}

bool SurfaceStar::TurnsAtMost(double cos_angle, const Point& place, VertexId collapsed) const {
  return std::all_of(triangles_.begin(), triangles_.end(), [&](const Triangle& triangle) {
    if (Contains(triangle.vertices, collapsed)) return true;
    const Point after = Cross(triangle.points[0] - place, triangle.points[1] - place);
    const double lengths = std::sqrt(Dot(after, after) * Dot(triangle.normal, triangle.normal));
    return Dot(after, triangle.normal) >= cos_angle * lengths;
  });
}

Point SurfaceStar::MeanNormal() const {
  Point sum = {0, 0, 0};
  for (const Triangle& triangle : triangles_) {
    sum = Dot(sum, triangle.normal) < 0 ? sum - triangle.normal : sum + triangle.normal;
  }
  return sum;
}

absl::optional<Point> SurfaceStar::Project(const Point& place) const {
  const Point normal = MeanNormal();
  for (const Triangle& triangle : triangles_) {
    const Point a = triangle.points[0] - at_, b = triangle.points[1] - at_, to = place - at_;
    // to = x a + y b - z normal, by Cramer's rule.
    const double volume = Dot(Cross(a, b), normal);
    if (volume == 0) continue;
    const double x = Dot(Cross(to, b), normal) / volume, y = Dot(Cross(a, to), normal) / volume;
    if (x >= -kSlack && y >= -kSlack && x + y <= 1 + kSlack) return at_ + (x * a + y * b);
  }
  return absl::nullopt;
}

}  // namespace dynmesh
