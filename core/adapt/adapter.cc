#include "core/adapt/adapter.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/edit/star.h"

namespace dynmesh {
namespace {

constexpr size_t kMaxIds = 16;  ///< in an error

/// A pass that resizes fewer edges than one in so many is the last one.
constexpr uint64_t kFewOf = 500;

/// Entities that one step may look at before it ends, as max_attempts is meant for vertices of few elements:
/// a second's work or two.
constexpr uint64_t kMaxStepWork = 20'000'000;

/// A phase ends when so many turns for each edge, and some more, have not brought it to an end: something
/// goes in circles then.
constexpr uint64_t kMostTurns = 20;
constexpr uint64_t kMoreTurns = 20'000;

/// Rounds over the worst elements at the end, as long as each finds something.
constexpr int kMaxRounds = 4;

absl::Status CheckRange(absl::string_view field, double value, double most) {
  if (value >= 0 && value <= most) return absl::OkStatus();
  return InvalidArgument(reason::kBadArgument, absl::StrCat(field, " is from 0 to ", most, ", not ", value),
                         {{"field", std::string(field)}});
}

absl::Status CheckOptions(const AdaptOptions& options) {
  DYNMESH_RETURN_IF_ERROR(CheckRange("min_quality", options.min_quality, 1));
  DYNMESH_RETURN_IF_ERROR(CheckRange("feature_angle", options.feature_angle, std::numbers::pi));
  if (options.max_passes >= 1 && options.max_attempts >= 1) return absl::OkStatus();
  return InvalidArgument(reason::kBadArgument, "there is at least one pass", {{"field", "max_passes"}});
}

/// The first elements of a kind that are none of those that can be adapted.
std::vector<Slot> Others(const Mesh& mesh, EntityKind kind) {
  const bool fits = kind == ElementKindOf(mesh);
  std::vector<Slot> others;
  if (mesh.NumElements(kind) == 0) return others;
  if (kind == EntityKind::kCell && mesh.IsTetrahedral()) return others;
  mesh.slots(kind).live().ForEach([&](Slot slot) {
    const EntityId id(kind, slot);
    if (others.size() == kMaxIds || !mesh.IsElement(id)) return;
    const ElementType type = mesh.Type(id);
    const bool simplex = type == ElementType::kTriangle || type == ElementType::kTetrahedron;
    if (!fits || !simplex) others.push_back(slot);
  });
  return others;
}

/// The first elements of a kind that name a vertex twice.
std::vector<Slot> Degenerates(const Mesh& mesh, EntityKind kind) {
  std::vector<Slot> degenerates;
  if (mesh.IsPlain()) return degenerates;
  mesh.slots(kind).live().ForEach([&](Slot slot) {
    const EntityId id(kind, slot);
    const bool fits = mesh.IsElement(id) && mesh.IsDegenerate(id);
    if (fits && degenerates.size() < kMaxIds) degenerates.push_back(slot);
  });
  return degenerates;
}

}  // namespace

absl::string_view AdaptPhaseName(AdaptPhase phase) {
  constexpr absl::string_view kNames[] = {"collapse", "split", "swap", "smooth", "improve", "done"};
  return kNames[static_cast<int>(phase)];
}

absl::Status CheckAdaptable(const Mesh& mesh) {
  for (EntityKind kind : {EntityKind::kCell, EntityKind::kFace, EntityKind::kEdge}) {
    const std::vector<Slot> others = Others(mesh, kind);
    if (others.empty()) continue;
    return kind == ElementKindOf(mesh)
               ? Refuse(reason::kNotSimplex, "only triangles and tetrahedra can be adapted", kind, others)
               : Refuse(reason::kElementInTheWay, "other elements stand beside those to be adapted", kind,
                        others);
  }
  const EntityKind kind = ElementKindOf(mesh);
  const std::vector<Slot> degenerates = Degenerates(mesh, kind);
  if (degenerates.empty()) return absl::OkStatus();
  return Refuse(reason::kDegenerateElement, "elements name a vertex twice", kind, degenerates);
}

absl::StatusOr<std::unique_ptr<Adapter>> Adapter::Start(const Mesh& mesh, const AdaptOptions& options) {
  DYNMESH_RETURN_IF_ERROR(CheckOptions(options));
  DYNMESH_ASSIGN_OR_RETURN(const Sizing sizing, Sizing::Make(mesh, options));
  DYNMESH_RETURN_IF_ERROR(CheckAdaptable(mesh));
  return std::unique_ptr<Adapter>(new Adapter(mesh, options, sizing, MeasureShape(mesh, sizing)));
}

Adapter::Adapter(const Mesh& mesh, const AdaptOptions& options, const Sizing& sizing, const MeshShape& before)
    : state_{options, sizing, Goodness(std::min(before.smallest_angle, kSafeAngle)),
             Features(mesh, options.feature_angle)},
      phases_{MakeCollapsePhase(), MakeSplitPhase(), MakeImprovePhase(Remedies::kSwaps), MakeSmoothPhase(),
              MakeImprovePhase(Remedies::kAll)},
      revision_(mesh.revision()),
      num_elements_(before.num_elements),
      smallest_angle_(before.smallest_angle) {
  state_.result.before = before;
  state_.result.passes = 1;
  Enter(AdaptPhase::kCollapse, mesh);
}

void Adapter::Enter(AdaptPhase phase, const Mesh& mesh) {
  phase_ = phase;
  work_.Clear();
  if (done()) return;
  uint32_t& looked_at = looked_at_[static_cast<int>(phase)];
  current().Fill(mesh, state_, looked_at, work_);
  looked_at = state_.changes.Now();
}

/// What waits goes on waiting, and what others have changed comes to it: so those who edit all the time
/// cannot keep this from its end.
absl::Status Adapter::LookAgain(const Mesh& mesh) {
  DYNMESH_RETURN_IF_ERROR(CheckAdaptable(mesh));
  state_.features.Refresh(mesh, revision_);
  const uint32_t before = state_.changes.Now();
  const auto is_new = [&](EntityId id) { return mesh.changed(id.kind).At(id.slot) > revision_; };
  mesh.slots(EntityKind::kVertex).live().ForEach([&](Slot v) {
    if (is_new(VertexId(v))) state_.changes.Touch(VertexId(v));
  });
  ForEachAdaptable(mesh, [&](EntityId element) {
    if (!is_new(element)) return;
    for (VertexId v : mesh.VerticesOf(element)) state_.changes.Touch(v);
  });
  current().Fill(mesh, state_, before, work_);
  return absl::OkStatus();
}

absl::Status Adapter::Step(Mesh& mesh) {
  if (mesh.revision() != revision_) DYNMESH_RETURN_IF_ERROR(LookAgain(mesh));
  const Mesh::Savepoint start = mesh.MakeSavepoint();
  const int pass = state_.result.passes;
  Operations operations(mesh, state_);
  for (uint64_t attempts = 0; attempts < state_.options.max_attempts && !done(); ++attempts) {
    if (operations.work() > kMaxStepWork) break;
    while ((work_.empty() || GoesInCircles(mesh)) && !done()) Advance(mesh);
    if (done() || state_.result.passes != pass) break;
    DYNMESH_RETURN_IF_ERROR(current().Process(work_.Take(), operations, work_));
  }
  num_elements_ = mesh.NumElements(ElementKindOf(mesh));
  revision_ = mesh.revision() + (mesh.MakeSavepoint() != start);
  return absl::OkStatus();
}

bool Adapter::GoesInCircles(const Mesh& mesh) const {
  return work_.num_taken() > kMostTurns * mesh.NumLive(EntityKind::kEdge) + kMoreTurns;
}

void Adapter::Advance(const Mesh& mesh) {
  switch (phase_) {
    case AdaptPhase::kSmooth:
      return EndPass(mesh);
    case AdaptPhase::kImprove: {
      const uint64_t improved = state_.result.counts.all() - improved_before_;
      improved_before_ += improved;
      const bool again = improved > 0 && ++rounds_ < kMaxRounds;
      return Enter(again ? AdaptPhase::kImprove : AdaptPhase::kDone, mesh);
    }
    default:
      return Enter(static_cast<AdaptPhase>(static_cast<int>(phase_) + 1), mesh);
  }
}

void Adapter::EndPass(const Mesh& mesh) {
  AdaptResult& result = state_.result;
  smallest_angle_ = SmallestAngleOf(mesh);
  const uint64_t resized = result.counts.splits + result.counts.collapses - resized_before_;
  resized_before_ += resized;
  const bool converged = resized * kFewOf <= mesh.NumLive(EntityKind::kEdge);
  const bool last =
      converged || result.passes == state_.options.max_passes || result.end == AdaptEnd::kMaxElements;
  if (!last) {
    ++result.passes;
    return Enter(AdaptPhase::kCollapse, mesh);
  }
  if (!converged && result.end != AdaptEnd::kMaxElements) result.end = AdaptEnd::kMaxPasses;
  improved_before_ = result.counts.all();
  Enter(AdaptPhase::kImprove, mesh);
}

AdaptProgress Adapter::progress() const {
  return {state_.result.passes, phase_, work_.num_taken(), work_.num_added(), num_elements_, smallest_angle_};
}

AdaptResult Adapter::Finish(const Mesh& mesh) {
  AdaptResult result = state_.result;
  if (CheckAdaptable(mesh).ok()) result.after = MeasureShape(mesh, state_.sizing);
  return result;
}

}  // namespace dynmesh
