#include "core/edit/operator_runner.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/edit/bad_argument.h"
#include "core/edit/collapse.h"
#include "core/edit/merge.h"
#include "core/edit/remove_vertex.h"
#include "core/edit/run_batch.h"
#include "core/edit/smooth.h"
#include "core/edit/split.h"
#include "core/edit/star.h"
#include "core/edit/swap.h"
#include "core/mesh/vector.h"

namespace dynmesh {
namespace {

/// Of an operator, whatever it looks at.
constexpr uint64_t kWorkOfItem = 10;

/// Of each element that it removes or adds: checking it, linking it, and perhaps putting it back.
constexpr uint64_t kWorkToReplace = 10;

/// Whether the state of the mesh speaks against an item, and not what the caller wrote.
bool IsRefusal(const absl::Status& status) {
  return absl::IsFailedPrecondition(status) || absl::IsNotFound(status) || absl::IsAborted(status);
}

absl::Status CheckLimits(const PatchLimits& limits) {
  if (limits.min_quality >= 0 && limits.min_quality <= 1) return absl::OkStatus();
  return InvalidArgument(reason::kBadArgument,
                         absl::StrCat("a quality is from 0 to 1, not ", limits.min_quality),
                         {{"field", "min_quality"}});
}

absl::Status CheckNames(const EdgeNames& edges) {
  if (!edges.ids.empty() && !edges.ends.empty()) {
    return InvalidArgument(reason::kBadArgument, "edges are named by ids or by their ends, not both",
                           {{"field", "edges"}});
  }
  return edges.ends.size() % 2 == 0 ? absl::OkStatus()
                                    : BadLength("ends of edges", edges.ends.size() + 1, edges.ends.size());
}

absl::Status CheckPositions(absl::Span<const Point> positions, size_t count) {
  if (!positions.empty() && positions.size() != count) return BadLength("positions", count, positions.size());
  for (size_t i = 0; i < positions.size(); ++i) {
    if (IsFinite(positions[i])) continue;
    return InvalidArgument(reason::kNonFinite, "a coordinate is NaN or infinite",
                           {{"field", "positions"}, {"index", absl::StrCat(i)}});
  }
  return absl::OkStatus();
}

/// Of SplitEdges and CollapseEdges. All items are checked before the first one is carried out.
template <typename EdgesEdit>
absl::Status CheckPlaces(const EdgesEdit& edit, absl::FunctionRef<bool(double)> is_parameter) {
  DYNMESH_RETURN_IF_ERROR(CheckNames(edit.edges));
  const size_t count = edit.edges.size();
  if (!edit.parameters.empty() && edit.parameters.size() != count) {
    return BadLength("parameters", count, edit.parameters.size());
  }
  for (size_t i = 0; i < edit.parameters.size(); ++i) {
    if (is_parameter(edit.parameters[i])) continue;
    return InvalidArgument(reason::kBadArgument,
                           absl::StrCat("parameter ", edit.parameters[i], " is not on the edge"),
                           {{"field", "parameters"}, {"index", absl::StrCat(i)}});
  }
  return CheckPositions(edit.positions, count);
}

absl::Status CheckSmoothing(const SmoothVerticesEdit& edit) {
  if (!(edit.rule.factor > 0 && edit.rule.factor <= 1)) {
    return InvalidArgument(reason::kBadArgument,
                           absl::StrCat("a factor is above 0 and at most 1, not ", edit.rule.factor),
                           {{"field", "factor"}});
  }
  if (edit.iterations >= 1 && edit.iterations <= kMaxSmoothIterations) return absl::OkStatus();
  return InvalidArgument(
      reason::kBadArgument,
      absl::StrCat("there are 1 to ", kMaxSmoothIterations, " iterations, not ", edit.iterations),
      {{"field", "iterations"}});
}

absl::optional<Point> PositionAt(absl::Span<const Point> positions, size_t i) {
  return positions.empty() ? absl::nullopt : absl::optional<Point>(positions[i]);
}

}  // namespace

absl::Status OperatorRunner::Run(const SplitEdgesEdit& edit) {
  DYNMESH_RETURN_IF_ERROR(CheckPlaces(edit, [](double t) { return t > 0 && t < 1; }));
  return RunAll(
      {edit.edges.size(), 1}, edit.limits,
      [&](size_t i) -> absl::Status {
        DYNMESH_ASSIGN_OR_RETURN(const EdgeId e, names_.Edge(edit.edges, i));
        SplitPlace place;
        if (!edit.parameters.empty()) place.parameter = edit.parameters[i];
        place.position = PositionAt(edit.positions, i);
        place.origin = names_.OriginOf(edit.edges, i);
        return PlanSplitEdge(mesh_, e, place, patch_);
      },
      [&](size_t i, int stage) {
        if (!edit.edges.ids.empty()) mesh_.PrefetchStar(EdgeId(edit.edges.ids[i]), stage);
      });
}

absl::Status OperatorRunner::Run(const CollapseEdgesEdit& edit) {
  DYNMESH_RETURN_IF_ERROR(CheckPlaces(edit, [](double t) { return t >= 0 && t <= 1; }));
  return RunAll(
      {edit.edges.size(), 0}, edit.limits,
      [&](size_t i) -> absl::Status {
        DYNMESH_ASSIGN_OR_RETURN(const EdgeId e, names_.Edge(edit.edges, i));
        CollapsePlace place;
        place.origin = names_.OriginOf(edit.edges, i);
        place.parameter = edit.parameters.empty() ? DefaultParameter(e, place.origin) : edit.parameters[i];
        place.position = PositionAt(edit.positions, i);
        return PlanCollapseEdge(mesh_, e, place, patch_);
      },
      [&](size_t i, int stage) {
        if (!edit.edges.ids.empty()) PrefetchEnd(EdgeId(edit.edges.ids[i]), stage);
      });
}

absl::Status OperatorRunner::Run(const SwapEdgesEdit& edit) {
  DYNMESH_RETURN_IF_ERROR(CheckNames(edit.edges));
  return RunAll(
      {edit.edges.size(), 0}, edit.limits,
      [&](size_t i) -> absl::Status {
        DYNMESH_ASSIGN_OR_RETURN(const EdgeId e, names_.Edge(edit.edges, i));
        return PlanSwapEdge(mesh_, e, patch_);
      },
      [&](size_t i, int stage) {
        if (!edit.edges.ids.empty()) mesh_.PrefetchStar(EdgeId(edit.edges.ids[i]), stage);
      });
}

absl::Status OperatorRunner::Run(const SwapFacesEdit& edit) {
  return RunAll(
      {edit.faces.size(), 0}, edit.limits,
      [&](size_t i) -> absl::Status {
        DYNMESH_ASSIGN_OR_RETURN(const FaceId f, names_.Face(edit.faces[i]));
        return PlanSwapFace(mesh_, f, patch_);
      },
      [&](size_t i, int stage) { mesh_.PrefetchStar(FaceId(edit.faces[i]), stage); });
}

absl::Status OperatorRunner::Run(const SplitElementsEdit& edit) {
  if (!IsEntityKind(edit.kind)) return BadKind(edit.kind);
  if (edit.kind == EntityKind::kVertex) {
    return InvalidArgument(reason::kBadEntityKind, "vertices are no elements", {{"field", "kind"}});
  }
  DYNMESH_RETURN_IF_ERROR(CheckPositions(edit.positions, edit.elements.size()));
  return RunAll({edit.elements.size(), 1}, edit.limits, [&](size_t i) -> absl::Status {
    const EntityId id(edit.kind, edit.elements[i]);
    DYNMESH_RETURN_IF_ERROR(names_.CheckElement(id));
    return PlanSplitElement(mesh_, id, PositionAt(edit.positions, i), patch_);
  });
}

absl::Status OperatorRunner::Run(const MergeVerticesEdit& edit) {
  const size_t count = edit.pairs.size() / 2;
  if (edit.pairs.size() % 2 != 0) return BadLength("vertices of pairs", 2 * count + 2, edit.pairs.size());
  DYNMESH_RETURN_IF_ERROR(CheckPositions(edit.positions, count));
  return RunAll({count, 0}, edit.limits, [&](size_t i) -> absl::Status {
    DYNMESH_ASSIGN_OR_RETURN(const VertexId kept, names_.LiveVertex(edit.pairs[2 * i]));
    DYNMESH_ASSIGN_OR_RETURN(const VertexId gone, names_.LiveVertex(edit.pairs[2 * i + 1]));
    return PlanMergeVertices(mesh_, kept, gone, PositionAt(edit.positions, i), patch_);
  });
}

absl::Status OperatorRunner::Run(const DissolveVerticesEdit& edit) {
  return RunAll({edit.vertices.size(), 0}, edit.limits, [&](size_t i) -> absl::Status {
    DYNMESH_ASSIGN_OR_RETURN(const VertexId v, names_.LiveVertex(edit.vertices[i]));
    return PlanRemoveVertex(mesh_, v, patch_);
  });
}

absl::Status OperatorRunner::Run(const SmoothVerticesEdit& edit) {
  DYNMESH_RETURN_IF_ERROR(CheckSmoothing(edit));
  std::vector<bool> moved(edit.vertices.size()), skipped(edit.vertices.size());
  for (uint32_t iteration = 0; iteration < edit.iterations; ++iteration) {
    std::vector<bool> planned(edit.vertices.size());
    const auto plan = [&](size_t i) -> absl::Status {
      if (skipped[i]) return absl::OkStatus();
      const absl::StatusOr<VertexId> v = names_.LiveVertex(edit.vertices[i]);
      if (!v.ok()) return iteration == 0 ? v.status() : absl::OkStatus();
      const absl::Status found = PlanSmoothVertex(mesh_, *v, edit.rule, edit.limits, patch_);
      if (!found.ok()) return iteration == 0 ? found : absl::OkStatus();
      planned[i] = !patch_.moves.empty();
      return absl::OkStatus();
    };
    DYNMESH_RETURN_IF_ERROR(RunAll({edit.vertices.size(), 0}, edit.limits, plan));
    for (uint32_t i : result_.results.back().skipped) skipped[i] = true;
    for (size_t i = 0; i < moved.size(); ++i) moved[i] = moved[i] || (planned[i] && !skipped[i]);
  }
  result_.results.back().num_moved = std::count(moved.begin(), moved.end(), true);
  return absl::OkStatus();
}

/// A collapse needs the star of the vertex that goes, most often the second one, and the edges of the other.
void OperatorRunner::PrefetchEnd(EdgeId e, int stage) const {
  constexpr int kStagesOfEdges = 4;
  if (stage == 0) return mesh_.PrefetchStar(e, 0);
  if (!mesh_.IsLive(e)) return;
  const auto ends = mesh_.Vertices(e);
  mesh_.PrefetchStar(ends[1], stage - 1);
  if (stage <= kStagesOfEdges) mesh_.PrefetchStar(ends[0], stage - 1);
}

absl::Status OperatorRunner::RunAll(const Items& items, const PatchLimits& limits, Plan plan) {
  return RunAll(items, limits, plan, [](size_t, int) {});
}

absl::Status OperatorRunner::RunAll(const Items& items, const PatchLimits& limits, Plan plan,
                                    Prefetch prefetch) {
  constexpr int kStages = Mesh::kPrefetchStages + 1;  // a collapse looks for the end first
  constexpr int kItemsBetween = 2;                    // stages: an item takes far longer than memory
  DYNMESH_RETURN_IF_ERROR(CheckLimits(limits));
  for (size_t i = 0; i < items.count; ++i) {
    for (int stage = 0; stage < kStages; ++stage) {
      const size_t ahead = i + (kStages - stage) * kItemsBetween;
      if (ahead < items.count) prefetch(ahead, stage);
    }
    absl::Status status = conflicts_.Explain(RunOne(i, limits, plan));
    if (status.ok()) {
      DYNMESH_RETURN_IF_ERROR(Report(items));
    } else if (options_.skip_refused && IsRefusal(status)) {
      Skip(items, i, std::move(status));
    } else {
      return WithMetadata(status, "index", absl::StrCat(i));
    }
  }
  return absl::OkStatus();
}

absl::Status OperatorRunner::RunOne(size_t item, const PatchLimits& limits, Plan plan) {
  patch_.Clear();
  const absl::Status planned = plan(item);
  DYNMESH_RETURN_IF_ERROR(ChargePlanned());
  DYNMESH_RETURN_IF_ERROR(planned);
  DYNMESH_RETURN_IF_ERROR(CheckPatch(mesh_, patch_, limits));
  const uint64_t room = options_.max_attribute_bytes - attribute_bytes_;
  DYNMESH_RETURN_IF_ERROR(ApplyPlanned(room));
  attribute_bytes_ += applied_.attribute_bytes;
  return absl::OkStatus();
}

absl::Status OperatorRunner::ApplyPlanned(uint64_t max_attribute_bytes) {
  const Mesh::Savepoint before = mesh_.MakeSavepoint();
  DYNMESH_RETURN_IF_ERROR(ApplyPatch(mesh_, patch_, applied_, max_attribute_bytes));
  absl::Status conflict = conflicts_.CheckSince(before);
  if (!conflict.ok()) PutBackTo(mesh_, before);
  return conflict;
}

/// Counts what was planned, so that few items cannot take long or fill the memory.
absl::Status OperatorRunner::ChargePlanned() {
  work_ += kWorkOfItem + patch_.work + kWorkToReplace * (patch_.removed.size() + patch_.added.size());
  result_.num_made += patch_.added.size();
  if (work_ > options_.max_work) return LimitExceeded("max_batch_work", options_.max_work, work_);
  if (result_.num_made <= options_.max_made) return absl::OkStatus();
  return LimitExceeded("max_batch_items", options_.max_made, result_.num_made);
}

/// Vertices that were not made keep their places, so that later ones can be counted on.
void OperatorRunner::Skip(const Items& items, uint32_t index, absl::Status status) {
  EditResult& result = result_.results.back();
  for (size_t k = 0; k < items.new_vertices; ++k) names_.AddNewVertex(VertexId());
  result.new_slots.insert(result.new_slots.end(), items.new_vertices, kNoSlot);
  result.skipped.push_back(index);
  if (num_refusals_++ < kMaxRefusals) result.refusals.push_back({index, std::move(status)});
}

absl::Status OperatorRunner::Report(const Items& items) {
  EditResult& result = result_.results.back();
  for (VertexId v : applied_.new_vertices) result.new_slots.push_back(v.slot());
  for (size_t k = 0; k < items.new_vertices; ++k) names_.AddNewVertex(applied_.new_vertices[k]);
  if (options_.max_lineage == 0) return absl::OkStatus();
  num_lineage_ += applied_.added.size();
  if (num_lineage_ > options_.max_lineage) {
    return LimitExceeded("max_lineage", options_.max_lineage, num_lineage_);
  }
  for (size_t k = 0; k < applied_.added.size(); ++k) {
    result.lineage.push_back({applied_.added[k], patch_.removed[patch_.parents[k]]});
  }
  return absl::OkStatus();
}

/// The middle, but where just one end is on the boundary that end, so that the boundary stays.
double OperatorRunner::DefaultParameter(EdgeId e, VertexId origin) const {
  const auto ends = EndsFrom(mesh_, e, origin);
  const bool first = mesh_.IsOnBoundary(ends[0]), second = mesh_.IsOnBoundary(ends[1]);
  return first == second ? 0.5 : first ? 0 : 1;
}

}  // namespace dynmesh
