#include "core/adapt/operations.h"

#include <algorithm>
#include <cmath>

#include "core/adapt/surface_star.h"
#include "core/edit/check_patch.h"
#include "core/edit/collapse.h"
#include "core/edit/geometry.h"
#include "core/edit/smooth.h"
#include "core/edit/split.h"
#include "core/edit/star.h"
#include "core/edit/swap.h"
#include "core/mesh/vector.h"

namespace dynmesh {
namespace {

/// What counts as better: so that neither rounding nor flat elements keep operations going.
constexpr double kGain = 1 + 1e-6;
constexpr double kLeastGain = 1e-9;

/// Of the mean length of a vertex's edges: steps that are not worth a change.
constexpr double kLeastStep = 0.01;

/// Halves of a shape are worse than it; this much of min_quality is enough for them.
constexpr double kShareForSplits = 0.5;

/// A refusal that nobody reads but who counts it: they are many, and messages take long to write.
absl::Status Refused(const char* reason) { return absl::FailedPreconditionError(reason); }

std::string ReasonOf(const absl::Status& refusal) {
  const std::string reason = ErrorReason(refusal);
  return reason.empty() ? std::string(refusal.message()) : reason;
}

bool IsAdaptable(ElementType type) {
  return type == ElementType::kTriangle || type == ElementType::kTetrahedron;
}

/// The least goodness of what a patch removes.
double LeastBefore(const Mesh& mesh, const Patch& patch, const Goodness& goodness) {
  double least = 1;
  for (EntityId element : patch.removed) {
    if (IsAdaptable(mesh.Type(element))) least = std::min(least, goodness.Of(mesh, element));
  }
  return least;
}

/// The same of what it adds; or some number below `enough`.
double LeastAfter(const Mesh& mesh, const Patch& patch, const Goodness& goodness, double enough) {
  double least = 1;
  for (const NewElement& element : patch.added) {
    if (!IsAdaptable(element.type)) continue;
    std::array<Point, 4> points;
    const auto vertices = element.vertices();
    for (size_t k = 0; k < vertices.size(); ++k) points[k] = PositionAfter(mesh, patch, vertices[k]);
    least = std::min(least, goodness(element.type, absl::MakeConstSpan(points.data(), vertices.size())));
    if (least < enough) return least;
  }
  return least;
}

/// Whether the worst shape gets better. before(): the least goodness; after(enough): the same of what would
/// be, or some number below `enough`.
template <typename Before, typename After>
bool IsBetter(Before before, After after) {
  const double needed = kGain * before() + kLeastGain;
  return after(needed) >= needed;
}

/// Whether the worst shape is good enough, or does not get worse.
template <typename Before, typename After>
bool IsGoodEnough(double enough, Before before, After after) {
  if (after(enough) >= enough) return true;
  const double now = before();
  return now < enough && after(now) >= now;
}

Point NormalOf(const Mesh& mesh, absl::Span<const VertexId> triangle) {
  return AreaVector(ElementType::kTriangle,
                    {mesh.Position(triangle[0]), mesh.Position(triangle[1]), mesh.Position(triangle[2])});
}

}  // namespace

double Operations::cos_turn() const { return std::cos(state_.options.feature_angle / 2); }

absl::StatusOr<bool> Operations::Count(const absl::Status& outcome, uint64_t& counter) {
  constexpr uint64_t kWorkToReplace = 10;  // an element: checking it, linking it, and its images
  work_ += patch_.work + kWorkToReplace * (patch_.removed.size() + patch_.added.size());
  if (outcome.ok()) {
    ++counter;
    Touch();
    return true;
  }
  // An invalid argument: the session refuses duplicates, or a coordinate would overflow.
  if (!absl::IsFailedPrecondition(outcome) && !absl::IsInvalidArgument(outcome)) return outcome;
  ++state_.result.refusals[ReasonOf(outcome)];
  return false;
}

void Operations::Touch() {
  for (EntityId element : applied_.added) {
    for (VertexId v : mesh_.VerticesOf(element)) state_.changes.Touch(v);
  }
}

/// The worst of the new shapes must be better than the worst of the old ones.
absl::Status Operations::CheckGrows() const {
  const auto before = [this] { return LeastBefore(mesh_, patch_, state_.goodness); };
  const auto after = [this](double enough) { return LeastAfter(mesh_, patch_, state_.goodness, enough); };
  return IsBetter(before, after) ? CheckPatch(mesh_, patch_) : Refused(reason::kWouldDegrade);
}

absl::Status Operations::CheckPermitted(double enough) const {
  const auto before = [this] { return LeastBefore(mesh_, patch_, state_.goodness); };
  const auto after = [this](double least) { return LeastAfter(mesh_, patch_, state_.goodness, least); };
  return IsGoodEnough(enough, before, after) ? CheckPatch(mesh_, patch_) : Refused(reason::kWouldDegrade);
}

/// Looked at before a collapse is planned, as that takes longer.
absl::Status Operations::CheckCollapsed(VertexId gone, VertexId kept, Aim aim) {
  const Star star = StarOf(mesh_, gone);
  work_ += star.work;
  const auto before = [&] {
    double least = 1;
    ForEachElement(star, [&](EntityId element) { least = std::min(least, GoodnessOf(element)); });
    return least;
  };
  const auto after = [&](double enough) {
    double least = 1;
    ForEachElement(star, [&](EntityId element) {
      if (least < enough || Contains(mesh_.VerticesOf(element), kept)) return;
      least = std::min(least, GoodnessWith(element, gone, kept));
    });
    return least;
  };
  const bool good =
      aim == Aim::kShape ? IsBetter(before, after) : IsGoodEnough(state_.options.min_quality, before, after);
  return good ? absl::OkStatus() : Refused(reason::kWouldDegrade);
}

double Operations::GoodnessOf(EntityId element) const {
  return IsAdaptable(mesh_.Type(element)) ? state_.goodness.Of(mesh_, element) : 1;
}

double Operations::GoodnessWith(EntityId element, VertexId gone, VertexId kept) const {
  if (!IsAdaptable(mesh_.Type(element))) return 1;
  std::array<Point, 4> points;
  const auto vertices = mesh_.VerticesOf(element);
  for (size_t k = 0; k < vertices.size(); ++k) {
    points[k] = mesh_.Position(vertices[k] == gone ? kept : vertices[k]);
  }
  return state_.goodness(mesh_.Type(element), absl::MakeConstSpan(points.data(), vertices.size()));
}

absl::StatusOr<bool> Operations::Split(EdgeId e) {
  patch_.Clear();
  const auto ends = EndsFrom(mesh_, e, VertexId());
  absl::Status outcome = PlanSplitEdge(mesh_, e, {}, patch_);
  const double enough = std::max(kShareForSplits * state_.options.min_quality, Goodness::kBelowFloor);
  if (outcome.ok()) outcome = CheckPermitted(enough);
  if (outcome.ok()) outcome = ApplyPatch(mesh_, patch_, applied_);
  if (outcome.ok()) state_.features.Split(mesh_, e, ends, applied_.new_vertices[0]);
  return Count(outcome, state_.result.counts.splits);
}

absl::Status Operations::CheckLengths(EdgeId e, VertexId gone, VertexId kept, double longest) const {
  for (EdgeId other : mesh_.IncidentEdges(gone)) {
    if (other == e) continue;
    const VertexId end = EndsFrom(mesh_, other, gone)[1];
    if (state_.sizing.RatioBetween(mesh_, kept, end) > longest) return Refused(reason::kEdgeTooLong);
  }
  return absl::OkStatus();
}

/// Whether an edge lies within what its end `gone` lies on.
bool Operations::RunsAlong(EdgeId e, Stratum stratum) const {
  switch (stratum) {
    case Stratum::kVolume:
      return true;
    case Stratum::kSurface:
      return ElementKindOf(mesh_) == EntityKind::kFace || mesh_.IsOnBoundary(e);
    case Stratum::kLine:
      return state_.features.Has(e);
    default:
      return false;
  }
}

absl::Status Operations::CheckForm(EdgeId e, VertexId gone, VertexId kept) const {
  const Stratum stratum = state_.features.StratumOf(mesh_, gone);
  if (!RunsAlong(e, stratum)) return Refused(reason::kWouldChangeForm);
  if (stratum == Stratum::kVolume) return absl::OkStatus();
  const Point place = mesh_.Position(kept);
  if (!SurfaceStar(mesh_, gone).TurnsAtMost(cos_turn(), place, kept))
    return Refused(reason::kWouldChangeForm);
  if (stratum != Stratum::kLine) return absl::OkStatus();
  const VertexId next = state_.features.NextOnLine(mesh_, gone, kept);
  if (!next.valid()) return Refused(reason::kWouldChangeForm);
  const Point before = mesh_.Position(gone) - mesh_.Position(next), after = place - mesh_.Position(gone);
  const bool straight = Dot(before, after) >= cos_turn() * std::sqrt(Dot(before, before) * Dot(after, after));
  return straight ? absl::OkStatus() : Refused(reason::kWouldChangeForm);
}

absl::StatusOr<bool> Operations::Collapse(EdgeId e, VertexId kept, Aim aim, double longest) {
  patch_.Clear();
  const VertexId gone = EndsFrom(mesh_, e, kept)[1];
  work_ += mesh_.IncidentEdges(gone).size();
  absl::Status outcome = CheckLengths(e, gone, kept, longest);
  if (outcome.ok()) outcome = CheckForm(e, gone, kept);
  if (outcome.ok()) outcome = CheckCollapsed(gone, kept, aim);
  if (outcome.ok()) outcome = PlanCollapseEdge(mesh_, e, {.parameter = 0, .origin = kept}, patch_);
  if (outcome.ok()) outcome = CheckPatch(mesh_, patch_);
  if (!outcome.ok()) return Count(outcome, state_.result.counts.collapses);
  const std::vector<VertexId> on_line = state_.features.TakeFrom(mesh_, gone);
  outcome = ApplyPatch(mesh_, patch_, applied_);
  state_.features.Mark(mesh_, outcome.ok() ? kept : gone, on_line);
  return Count(outcome, state_.result.counts.collapses);
}

/// Two triangles are flipped only where the surface is about as flat after as before.
absl::Status Operations::CheckFlip() const {
  if (patch_.removed.front().kind != EntityKind::kFace) return absl::OkStatus();
  for (const NewElement& element : patch_.added) {
    const Point after = NormalOf(mesh_, element.vertices());
    for (EntityId removed : patch_.removed) {
      const Point before = NormalOf(mesh_, mesh_.VerticesOf(removed));
      if (Dot(before, after) >= cos_turn() * std::sqrt(Dot(before, before) * Dot(after, after))) continue;
      return Refused(reason::kWouldChangeForm);
    }
  }
  return absl::OkStatus();
}

absl::StatusOr<bool> Operations::Finish(const absl::Status& planned) {
  absl::Status outcome = planned;
  if (outcome.ok()) outcome = CheckGrows();
  if (outcome.ok()) outcome = CheckFlip();
  if (outcome.ok()) outcome = ApplyPatch(mesh_, patch_, applied_);
  return Count(outcome, state_.result.counts.swaps);
}

absl::StatusOr<bool> Operations::SwapEdge(EdgeId e) {
  patch_.Clear();
  return Finish(state_.features.Has(e) ? Refused(reason::kWouldChangeForm) : PlanSwapEdge(mesh_, e, patch_));
}

absl::StatusOr<bool> Operations::SwapFace(FaceId f) {
  patch_.Clear();
  return Finish(PlanSwapFace(mesh_, f, patch_));
}

bool Operations::MayMove(VertexId v) {
  const uint64_t work = WorkOfStar(mesh_, v);
  work_ += work;
  return work <= kMaxStarWork && state_.features.StratumOf(mesh_, v) >= Stratum::kSurface;
}

bool Operations::MoveTo(VertexId v, const Point& place) {
  if (!mesh_.MoveVertex(v, place).ok()) return false;
  state_.changes.Touch(v);
  ++state_.result.counts.moves;
  return true;
}

bool Operations::Relax(VertexId v) {
  const absl::optional<Point> mean = MeanOfNeighbours(mesh_, v);
  if (!mean || !MayMove(v)) return false;
  const bool on_surface = state_.features.StratumOf(mesh_, v) == Stratum::kSurface;
  const absl::optional<SurfaceStar> surface =
      on_surface ? absl::make_optional<SurfaceStar>(mesh_, v) : absl::nullopt;
  const MovingStar star(mesh_, v);
  const Point from = mesh_.Position(v), step = *mean - from;
  const double least_step = kLeastStep * MeanLengthOfEdges(mesh_, v);
  const double now = star.LeastAt(from, state_.goodness);
  double share = 1;
  for (int halvings = 0; halvings < kMaxHalvings; ++halvings, share /= 2) {
    absl::optional<Point> place = from + share * step;
    if (on_surface) place = surface->Project(*place);
    if (place && Dot(*place - from, *place - from) <= least_step * least_step) return false;
    if (!place || (on_surface && !surface->TurnsAtMost(cos_turn(), *place))) continue;
    if (star.LeastAt(*place, state_.goodness, now) >= now) return MoveTo(v, *place);
  }
  return false;
}

bool Operations::Climb(VertexId v) {
  if (!MayMove(v)) return false;
  const MovingStar star(mesh_, v);
  const Point from = mesh_.Position(v);
  const Freedom freedom = Freedom::Along(mesh_, v);
  absl::optional<Point> place =
      dynmesh::Climb(star, from, MeanLengthOfEdges(mesh_, v) / 4, freedom, state_.goodness);
  if (state_.features.StratumOf(mesh_, v) == Stratum::kSurface) {
    const SurfaceStar surface(mesh_, v);
    place = surface.Project(*place);
    if (!place || !surface.TurnsAtMost(cos_turn(), *place)) return false;
  }
  const double now = star.LeastAt(from, state_.goodness);
  return star.LeastAt(*place, state_.goodness) > kGain * now + kLeastGain && MoveTo(v, *place);
}

}  // namespace dynmesh
