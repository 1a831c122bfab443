#include "core/edit/remove_vertex.h"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/edit/collapse.h"
#include "core/edit/geometry.h"
#include "core/edit/ring_triangulation.h"
#include "core/edit/star.h"
#include "core/edit/triangle_fan.h"
#include "core/mesh/vector.h"

namespace dynmesh {
namespace {

absl::Status RefuseVertex(absl::string_view reason, absl::string_view why, VertexId v) {
  return Refuse(reason, absl::StrCat("vertex ", v.slot(), " ", why), EntityKind::kVertex, {v.slot()});
}

absl::Status RefuseJoined(const Mesh& mesh, VertexId a, VertexId b) {
  const EdgeId e = mesh.FindEdge(a, b);
  return Refuse(reason::kEdgeExists,
                absl::StrCat("edge ", e.slot(), " joins vertices ", a.slot(), " and ", b.slot(), " already"),
                EntityKind::kEdge, {e.slot()});
}

// ---- Wires ----

absl::Status PlanJoinWires(const Mesh& mesh, VertexId v, absl::Span<const EdgeId> wires, Patch& patch) {
  if (wires.size() == 1) return RefuseVertex(reason::kBoundary, "is the end of a wire", v);
  if (wires.size() > 2) return RefuseVertex(reason::kNonManifoldVertex, "has more than two wires", v);
  const auto first = EndsFrom(mesh, wires[0], v), second = EndsFrom(mesh, wires[1], v);
  if (first[1] == second[1] || mesh.FindEdge(first[1], second[1]).valid()) {
    return Refuse(reason::kEdgeExists,
                  absl::StrCat("the neighbours of vertex ", v.slot(), " are joined already"),
                  EntityKind::kEdge, {wires[0].slot(), wires[1].slot()});
  }
  const bool leaves = mesh.Vertices(wires[0])[0] == v;  // the first one says where the wire leads
  patch.Remove(wires[0]);
  patch.Remove(wires[1]);
  patch.AddChildOf(0, ElementType::kWireEdge, {leaves ? second[1] : first[1], leaves ? first[1] : second[1]});
  return absl::OkStatus();
}

// ---- Triangles ----

/// The triangles that fill the ring round a vertex.
class FanFiller {
 public:
  FanFiller(const Mesh& mesh, const TriangleFan& fan) : mesh_(mesh), fan_(fan), side_{0, 0, 0} {
    for (FaceId f : fan.faces) {
      const auto v = mesh.Vertices(f);
      side_ = side_ + AreaVector(ElementType::kTriangle,
                                 {mesh.Position(v[0]), mesh.Position(v[1]), mesh.Position(v[2])});
    }
  }

  absl::Status Fill(Patch& patch) const {
    const auto& ring = fan_.ring;
    for (FaceId f : fan_.faces) patch.Remove(f);
    if (ring.size() == 2 && !fan_.closed()) return absl::OkStatus();  // an ear
    if (!fan_.closed() && mesh_.FindEdge(ring.front(), ring.back()).valid()) {
      return RefuseJoined(mesh_, ring.front(), ring.back());
    }
    if (const FaceId f = mesh_.FindFace(ring); f.valid()) {
      return Refuse(reason::kFaceExists, absl::StrCat("face ", f.slot(), " fills the gap already"),
                    EntityKind::kFace, {f.slot()});
    }
    RingTriangulation triangulation(ring.size(), RingTriangulation::Aim::kBestWorst);
    const bool found = triangulation.Find(
        [&](size_t i, size_t j) { return !mesh_.FindEdge(ring[i], ring[j]).valid(); },
        [this](const RingTriangulation::Triangle& triangle) { return SignedQuality(triangle); });
    if (!found) return RefuseRing();
    triangulation.ForEach([&](const RingTriangulation::Triangle& t) {
      patch.AddChildOf(t.i, ElementType::kTriangle, {ring[t.i], ring[t.k], ring[t.j]});
    });
    return absl::OkStatus();
  }

 private:
  double SignedQuality(const RingTriangulation::Triangle& t) const {
    const std::array<Point, 3> points = {mesh_.Position(fan_.ring[t.i]), mesh_.Position(fan_.ring[t.k]),
                                         mesh_.Position(fan_.ring[t.j])};
    const double quality = Quality(ElementType::kTriangle, points);
    return Dot(side_, AreaVector(ElementType::kTriangle, points)) > 0 ? quality : -quality;
  }

  absl::Status RefuseRing() const {
    std::vector<Slot> ring;
    for (VertexId v : fan_.ring) ring.push_back(v.slot());
    return Refuse(reason::kEdgeExists, "the vertices round the vertex are joined already",
                  EntityKind::kVertex, ring);
  }

  const Mesh& mesh_;
  const TriangleFan& fan_;
  Point side_;  ///< that the triangles face together
};

absl::Status PlanFillRing(const Mesh& mesh, VertexId v, absl::Span<const FaceId> faces, Patch& patch) {
  if (faces.size() > kMaxRing) return TooManyElements(v);
  DYNMESH_ASSIGN_OR_RETURN(const TriangleFan fan, FanRound(mesh, v, faces));
  const size_t n = fan.ring.size();
  if (fan.closed() && n < 3) {
    return RefuseVertex(reason::kNonManifoldVertex, "has two triangles that share two edges", v);
  }
  patch.work += n * n * n;
  patch.check_euler = true;
  return FanFiller(mesh, fan).Fill(patch);
}

// ---- Tetrahedra ----

/// The smallest quality of what a patch adds, negative where it is turned over.
double WorstQuality(const Mesh& mesh, const Patch& patch) {
  const auto quality_and_side = [&](ElementType type, absl::Span<const VertexId> vertices) {
    std::array<Point, kMaxElementVertices> points;
    for (size_t k = 0; k < vertices.size(); ++k) points[k] = PositionAfter(mesh, patch, vertices[k]);
    return std::pair(Quality(type, points), Orientation(type, points));
  };
  double worst = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < patch.added.size(); ++i) {
    const EntityId parent = patch.removed[patch.parents[i]];
    const auto before = quality_and_side(mesh.Type(parent), mesh.VerticesOf(parent));
    const auto after = quality_and_side(patch.added[i].type, patch.added[i].vertices());
    worst = std::min(worst, after.second == before.second ? after.first : -after.first);
  }
  return worst;
}

absl::Status PlanBestCollapse(const Mesh& mesh, VertexId v, Patch& patch) {
  Patch best, candidate;
  absl::Status refused = RefuseVertex(reason::kBoundary, "has no edge along the boundary", v);
  double best_quality = 0;
  bool found = false, tried = false;
  uint64_t work = patch.work;
  for (EdgeId e : mesh.IncidentEdges(v)) {
    if (mesh.IsOnBoundary(v) && !mesh.IsOnBoundary(e)) continue;
    candidate.Clear();
    const absl::Status planned = PlanCollapseEdge(mesh, e, {0, {}, EndsFrom(mesh, e, v)[1]}, candidate);
    work += candidate.work + candidate.added.size();
    if (work > kMaxPatchWork) return TooManyElements(v);
    if (!std::exchange(tried, true)) refused = planned;
    if (!planned.ok()) continue;
    const double quality = WorstQuality(mesh, candidate);
    if (found && quality <= best_quality) continue;
    std::swap(best, candidate);
    best_quality = quality;
    found = true;
  }
  if (found) patch = std::move(best);
  patch.work = work;
  return found ? absl::OkStatus() : refused;
}

}  // namespace

absl::Status PlanRemoveVertex(const Mesh& mesh, VertexId v, Patch& patch) {
  const Star star = StarOf(mesh, v);
  patch.work += star.work;
  DYNMESH_RETURN_IF_ERROR(CheckNotDegenerate(mesh, star));
  const int kinds = !star.cells.empty() + !star.faces.empty() + !star.wires.empty();
  if (kinds > 1) return RefuseVertex(reason::kElementInTheWay, "has elements of several kinds", v);
  if (!star.cells.empty()) {
    DYNMESH_RETURN_IF_ERROR(CheckTetrahedra(mesh, star.cells));
    return PlanBestCollapse(mesh, v, patch);
  }
  if (!star.faces.empty()) DYNMESH_RETURN_IF_ERROR(PlanFillRing(mesh, v, star.faces, patch));
  if (!star.wires.empty()) DYNMESH_RETURN_IF_ERROR(PlanJoinWires(mesh, v, star.wires, patch));
  patch.removed_vertices.push_back(v);
  return absl::OkStatus();
}

}  // namespace dynmesh
