#include "core/edit/triangle_fan.h"

#include <algorithm>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/edit/star.h"

namespace dynmesh {
namespace {

/// One triangle of the fan, seen from its vertex.
struct Step {
  VertexId from, to;
  FaceId face;
};

Step StepOf(absl::Span<const VertexId> triangle, VertexId v, FaceId f) {
  const size_t k = std::find(triangle.begin(), triangle.end(), v) - triangle.begin();
  return {triangle[(k + 1) % 3], triangle[(k + 2) % 3], f};
}

absl::Status CheckEdges(const Mesh& mesh, VertexId v) {
  for (EdgeId e : mesh.IncidentEdges(v)) {
    if (mesh.IncidentFaces(e).size() <= 2) continue;
    return Refuse(reason::kNonManifoldEdge, absl::StrCat("edge ", e.slot(), " has more than two faces"),
                  EntityKind::kEdge, {e.slot()});
  }
  return absl::OkStatus();
}

/// Sorts triangles by one of their ring vertices, which must be another one for each.
absl::Status SortBy(VertexId Step::*end, std::vector<Step>& steps) {
  std::sort(steps.begin(), steps.end(), [end](const Step& a, const Step& b) { return a.*end < b.*end; });
  const auto twice = std::adjacent_find(steps.begin(), steps.end(),
                                        [end](const Step& a, const Step& b) { return a.*end == b.*end; });
  if (twice == steps.end()) return absl::OkStatus();
  return Refuse(reason::kInconsistentOrientation, "two triangles turn differently", EntityKind::kFace,
                {twice[0].face.slot(), twice[1].face.slot()});
}

/// The triangles, by the ring vertex from which they go on.
absl::StatusOr<std::vector<Step>> StepsFrom(const Mesh& mesh, VertexId v, absl::Span<const FaceId> faces) {
  std::vector<Step> steps;
  for (FaceId f : faces) {
    if (mesh.Type(f) != ElementType::kTriangle) {
      return Refuse(reason::kNotSimplex, absl::StrCat("face ", f.slot(), " is no triangle"),
                    EntityKind::kFace, {f.slot()});
    }
    steps.push_back(StepOf(mesh.Vertices(f), v, f));
  }
  DYNMESH_RETURN_IF_ERROR(SortBy(&Step::to, steps));
  DYNMESH_RETURN_IF_ERROR(SortBy(&Step::from, steps));
  return steps;
}

/// Where an open fan begins, or just anywhere.
VertexId FirstOf(absl::Span<const Step> steps) {
  std::vector<VertexId> targets;
  for (const Step& step : steps) targets.push_back(step.to);
  std::sort(targets.begin(), targets.end());
  for (const Step& step : steps) {
    if (!std::binary_search(targets.begin(), targets.end(), step.from)) return step.from;
  }
  return steps[0].from;
}

}  // namespace

absl::StatusOr<TriangleFan> FanRound(const Mesh& mesh, VertexId v, absl::Span<const FaceId> faces) {
  DYNMESH_RETURN_IF_ERROR(CheckEdges(mesh, v));
  DYNMESH_ASSIGN_OR_RETURN(const std::vector<Step> steps, StepsFrom(mesh, v, faces));
  TriangleFan fan;
  VertexId at = FirstOf(steps);
  fan.ring.push_back(at);
  while (fan.faces.size() < steps.size()) {
    const auto next = std::lower_bound(steps.begin(), steps.end(), at,
                                       [](const Step& step, VertexId from) { return step.from < from; });
    if (next == steps.end() || next->from != at) break;
    fan.faces.push_back(next->face);
    at = next->to;
    if (at == fan.ring[0]) break;
    fan.ring.push_back(at);
  }
  if (fan.faces.size() == steps.size()) return fan;
  return Refuse(reason::kNonManifoldVertex,
                absl::StrCat("vertex ", v.slot(), " has more than one fan of triangles"), EntityKind::kVertex,
                {v.slot()});
}

}  // namespace dynmesh
