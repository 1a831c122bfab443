#include "core/edit/smooth.h"

#include <array>
#include <cmath>

#include "core/edit/geometry.h"
#include "core/edit/star.h"
#include "core/mesh/vector.h"

namespace dynmesh {
namespace {

/// Steps of one climb: each judges the star up to seven times.
constexpr int kMaxSteps = 24;

double Norm(const Point& p) { return std::sqrt(Dot(p, p)); }

VertexId OtherEnd(const Mesh& mesh, EdgeId e, VertexId v) {
  const auto ends = mesh.Vertices(e);
  return ends[0] == v ? ends[1] : ends[0];
}

/// Calls fn(area vector) for the faces that make up the surface at a vertex: those on the boundary of cells,
/// or else elements. For each twice.
template <typename Fn>
void ForEachSurfaceFace(const Mesh& mesh, VertexId v, Fn fn) {
  for (EdgeId e : mesh.IncidentEdges(v)) {
    for (FaceId f : mesh.IncidentFaces(e)) {
      const bool of_surface = mesh.IncidentCells(f).empty() || mesh.IsOnBoundary(f);
      if (!of_surface) continue;
      std::array<Point, kMaxFaceVertices> points;
      const auto vertices = mesh.Vertices(f);
      for (size_t k = 0; k < vertices.size(); ++k) points[k] = mesh.Position(vertices[k]);
      fn(AreaVector(mesh.Type(f), absl::MakeConstSpan(points.data(), vertices.size())));
    }
  }
}

/// The sum of their area vectors, each turned to the side of the first, as their own orders need not agree.
Point NormalAt(const Mesh& mesh, VertexId v) {
  Point sum = {0, 0, 0};
  ForEachSurfaceFace(mesh, v, [&](const Point& area) { sum = Dot(sum, area) < 0 ? sum - area : sum + area; });
  return sum;
}

/// Whether a face at a vertex leans away from the mean normal by more than 40 degrees: there is a sharp edge
/// or a corner then.
bool IsSharp(const Mesh& mesh, VertexId v, const Point& normal) {
  constexpr double kCosine = 0.766;
  bool sharp = false;
  ForEachSurfaceFace(mesh, v, [&](const Point& area) {
    sharp = sharp || std::abs(Dot(normal, area)) < kCosine * Norm(normal) * Norm(area);
  });
  return sharp;
}

/// From one neighbour along the boundary of a surface to the other; zero where there are not two.
Point DirectionOfBoundary(const Mesh& mesh, VertexId v) {
  std::array<Point, 2> neighbours;
  size_t count = 0;
  for (EdgeId e : mesh.IncidentEdges(v)) {
    if (!mesh.IsOnBoundary(e)) continue;
    if (count == 2) return {0, 0, 0};
    neighbours[count++] = mesh.Position(OtherEnd(mesh, e, v));
  }
  return count == 2 ? neighbours[1] - neighbours[0] : Point{0, 0, 0};
}

bool HasCells(const Mesh& mesh, VertexId v) {
  for (EdgeId e : mesh.IncidentEdges(v)) {
    for (FaceId f : mesh.IncidentFaces(e)) {
      if (!mesh.IncidentCells(f).empty()) return true;
    }
  }
  return false;
}

/// Looks for a place for one vertex.
class Smoother {
 public:
  Smoother(const Mesh& mesh, VertexId v, const SmoothRule& rule, const PatchLimits& limits)
      : mesh_(mesh), v_(v), rule_(rule), limits_(limits), from_(mesh.Position(v)) {
    if (rule.tangential) freedom_ = Freedom::Along(mesh, v);
  }

  void Plan(Patch& patch) const {
    const absl::optional<Point> step = FirstStep();
    if (!step) return;
    double share = 1;
    for (int halvings = 0; halvings <= kMaxHalvings; ++halvings, share /= 2) {
      const Point place = from_ + share * *step;
      if (place == from_) return;
      patch.moves.assign(1, {v_, place});
      if (Permits(patch, place)) return;
    }
    patch.moves.clear();
  }

 private:
  absl::optional<Point> FirstStep() const {
    if (rule_.method == SmoothMethod::kOptimizing) {
      const MovingStar star(mesh_, v_);
      const double length = rule_.factor * MeanLengthOfEdges(mesh_, v_) / 4;
      return Climb(star, from_, length, freedom_, Quality) - from_;
    }
    const absl::optional<Point> mean = MeanOfNeighbours(mesh_, v_);
    if (!mean) return absl::nullopt;
    return freedom_.Restrict(rule_.factor * (*mean - from_));
  }

  bool Permits(const Patch& patch, const Point& place) const {
    if (!IsFinite(place) || !CheckPatch(mesh_, patch, limits_).ok()) return false;
    if (rule_.method == SmoothMethod::kLaplacian) return true;
    const MovingStar star(mesh_, v_);
    const double now = star.LeastAt(from_, Quality);
    return star.LeastAt(place, Quality, now) >= now;
  }

  const Mesh& mesh_;
  const VertexId v_;
  const SmoothRule& rule_;
  const PatchLimits& limits_;
  const Point from_;
  Freedom freedom_;
};

}  // namespace

absl::Status PlanSmoothVertex(const Mesh& mesh, VertexId v, const SmoothRule& rule, const PatchLimits& limits,
                              Patch& patch) {
  if (!rule.move_boundary && mesh.IsOnBoundary(v)) return absl::OkStatus();
  const uint64_t work = WorkOfStar(mesh, v);
  patch.work += work * (rule.method == SmoothMethod::kOptimizing ? kMaxSteps : 2 * kMaxHalvings);
  if (work > kMaxStarWork) return TooManyElements(v);
  Smoother(mesh, v, rule, limits).Plan(patch);
  return absl::OkStatus();
}

absl::optional<Point> MeanOfNeighbours(const Mesh& mesh, VertexId v) {
  const bool on_boundary = mesh.IsOnBoundary(v);
  Point sum = {0, 0, 0};
  size_t count = 0;
  for (EdgeId e : mesh.IncidentEdges(v)) {
    if (on_boundary && !mesh.IsOnBoundary(e)) continue;
    sum = sum + mesh.Position(OtherEnd(mesh, e, v));
    ++count;
  }
  if (count == 0) return absl::nullopt;
  return (1.0 / static_cast<double>(count)) * sum;
}

double MeanLengthOfEdges(const Mesh& mesh, VertexId v) {
  const auto edges = mesh.IncidentEdges(v);
  double sum = 0;
  for (EdgeId e : edges) sum += Norm(mesh.Position(OtherEnd(mesh, e, v)) - mesh.Position(v));
  return edges.empty() ? 0 : sum / static_cast<double>(edges.size());
}

Freedom Freedom::Along(const Mesh& mesh, VertexId v) {
  const bool solid = HasCells(mesh, v);
  const bool inside = !mesh.IsOnBoundary(v);
  if (solid && inside) return Freedom();
  const Kind kind = solid || inside ? Kind::kPlane : Kind::kLine;
  const Point along = kind == Kind::kPlane ? NormalAt(mesh, v) : DirectionOfBoundary(mesh, v);
  if (kind == Kind::kPlane && IsSharp(mesh, v, along)) return Freedom(Kind::kNone, {0, 0, 0});
  const double length = Norm(along);
  return length > 0 ? Freedom(kind, (1 / length) * along) : Freedom();
}

Point Freedom::Restrict(const Point& step) const {
  if (kind_ == Kind::kAll) return step;
  if (kind_ == Kind::kNone) return {0, 0, 0};
  const Point part = Dot(step, unit_) * unit_;
  return kind_ == Kind::kLine ? part : step - part;
}

Point Climb(const MovingStar& star, const Point& from, double step, const Freedom& freedom,
            ShapeMeasure measure) {
  constexpr Point kAxes[] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-1, 0, 0}, {0, -1, 0}, {0, 0, -1}};
  Point at = from;
  double best = star.LeastAt(from, measure);
  const double least_step = step / 16;
  int steps = 0;
  while (step >= least_step && step > 0 && steps < kMaxSteps) {
    ++steps;
    const Point start = at;
    for (const Point& axis : kAxes) {
      const Point place = start + step * freedom.Restrict(axis);
      const double least = star.LeastAt(place, measure, best);
      if (least <= best) continue;
      best = least;
      at = place;
    }
    if (at == start) step /= 2;
  }
  return at;
}

}  // namespace dynmesh
