#include "core/repair/fill_holes.h"

#include <algorithm>
#include <array>

#include "core/edit/geometry.h"
#include "core/edit/ring_triangulation.h"
#include "core/mesh/error.h"
#include "core/mesh/vector.h"
#include "core/repair/holes.h"

namespace dynmesh {
namespace {

/// How much a bad shape counts against area: just enough to choose among triangulations of one area.
constexpr double kWeightOfShape = 1e-6;

/// Fills one hole after the other.
class HoleFiller {
 public:
  HoleFiller(RepairWork& work, RepairReport& report) : work_(work), mesh_(work.mesh()), report_(report) {}

  absl::Status Fill(const Hole& hole) {
    if (hole.problem) {
      report_.Add(*hole.problem, hole.lowest);
    } else if (mesh_.FindFace(hole.loop).valid()) {
      report_.Add(RepairFinding::kHoleFaceExists, hole.lowest);
    } else {
      DYNMESH_RETURN_IF_ERROR(FillLoop(hole.loop));
      report_.Add(RepairFinding::kFilled, hole.lowest);
    }
    return absl::OkStatus();
  }

 private:
  absl::Status FillLoop(absl::Span<const VertexId> loop) {
    const uint64_t n = loop.size();
    if (n > kMaxFlatHole) return FillRoundMiddle(loop);
    DYNMESH_RETURN_IF_ERROR(work_.Charge(n * n * n / 6));
    RingTriangulation triangulation(n, RingTriangulation::Aim::kBestSum);
    const bool found =
        triangulation.Find([&](size_t i, size_t j) { return !mesh_.FindEdge(loop[i], loop[j]).valid(); },
                           [&](const RingTriangulation::Triangle& t) {
                             return -CostOf({loop[t.i], loop[t.k], loop[t.j]});
                           });
    if (!found) return FillRoundMiddle(loop);
    absl::Status status;
    triangulation.ForEach([&](const RingTriangulation::Triangle& t) {
      if (status.ok()) status = AddTriangle({loop[t.i], loop[t.k], loop[t.j]});
    });
    return status;
  }

  static double SquareOfLongestEdge(const std::array<Point, 3>& points) {
    double longest = 0;
    for (int k = 0; k < 3; ++k) {
      const Point edge = points[(k + 1) % 3] - points[k];
      longest = std::max(longest, Dot(edge, edge));
    }
    return longest;
  }

  double CostOf(const std::array<VertexId, 3>& triangle) const {
    std::array<Point, 3> points;
    for (int k = 0; k < 3; ++k) points[k] = mesh_.Position(triangle[k]);
    if (IsFlatFace(ElementType::kTriangle, points))
      return SquareOfLongestEdge(points);  // if nothing else will do
    const double bad = 1 - Quality(ElementType::kTriangle, points);
    return Measure(ElementType::kTriangle, points) * (1 + kWeightOfShape * bad);
  }

  absl::Status FillRoundMiddle(absl::Span<const VertexId> loop) {
    Patch patch;
    patch.new_vertices.push_back(MiddleOf(mesh_, patch, loop));
    DYNMESH_RETURN_IF_ERROR(work_.Apply(patch));
    const VertexId middle = work_.applied().new_vertices[0];
    report_.Add(RepairFinding::kAdded, middle);
    for (size_t k = 0; k < loop.size(); ++k) {
      DYNMESH_RETURN_IF_ERROR(AddTriangle({loop[k], loop[(k + 1) % loop.size()], middle}));
    }
    return absl::OkStatus();
  }

  absl::Status AddTriangle(const std::array<VertexId, 3>& triangle) {
    DYNMESH_RETURN_IF_ERROR(work_.ChargeNewElements(1));
    DYNMESH_ASSIGN_OR_RETURN(const EntityId face, mesh_.AddElement(ElementType::kTriangle, triangle));
    report_.Add(RepairFinding::kAdded, face);
    return absl::OkStatus();
  }

  RepairWork& work_;
  Mesh& mesh_;
  RepairReport& report_;
};

}  // namespace

absl::StatusOr<RepairReport> FillHoles(RepairWork& work, size_t max_edges) {
  DYNMESH_ASSIGN_OR_RETURN(const std::vector<Hole> holes, FindHoles(work, max_edges));
  RepairReport report;
  HoleFiller filler(work, report);
  for (const Hole& hole : holes) DYNMESH_RETURN_IF_ERROR(filler.Fill(hole));
  return report;
}

}  // namespace dynmesh
