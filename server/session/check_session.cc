#include "server/session/check_session.h"

#include <limits>
#include <utility>

#include "core/check/tally.h"

namespace dynmesh {
namespace {

/// All checks are on.
CheckSettings EveryCheck(CheckSettings settings) {
  for (CheckKind check : AllChecks()) {
    if (settings.IsOn(check)) continue;
    settings.Set(check, {Severity::kWarn, TraitsOf(check).default_threshold}).IgnoreError();  // cannot fail
  }
  return settings;
}

ReportOptions OptionsOf(const Session& session, const CheckQuestion& question) {
  return {question.checks.has_value() ? *question.checks : EveryCheck(session.checks()),
          question.max_findings};
}

/// What the whole of a mesh may take: some ten times what all checks take of hexahedra, whose entities take
/// most; more only where many elements are equal.
constexpr uint64_t kMaxStepsForEntity = 2'000;
constexpr uint64_t kMaxStepsForAny = 10'000'000;

/// Whoever works on a copy keeps nobody waiting: what its answer holds, a caller who is gone, and work beyond
/// all measure end it.
QueryBudget::Bounds BoundsFor(const Mesh& mesh) {
  uint64_t entities = 0;
  for (EntityKind kind : kEntityKinds) entities += mesh.NumLive(kind);
  return {std::numeric_limits<int64_t>::max(), kMaxStepsForAny + kMaxStepsForEntity * entities,
          "max_check_work"};
}

}  // namespace

absl::StatusOr<CheckReport> CheckWholeSession(const Session& session, const CheckQuestion& question,
                                              const QueryTerms& terms, ReportMonitor& monitor,
                                              absl::FunctionRef<void(int64_t revision)> copied) {
  absl::optional<Mesh> copy;
  DYNMESH_RETURN_IF_ERROR(session.Read([&copy](const SessionView& view) {
    copy = view.mesh.Clone();
    return absl::OkStatus();
  }));
  copied(copy->revision());
  QueryBudget budget(BoundsFor(*copy), terms);
  return CheckMesh(*copy, OptionsOf(session, question), budget, monitor);
}

absl::StatusOr<CheckReport> CheckPartOfSession(const Session& session, const CheckQuestion& question,
                                               const QueryTerms& terms) {
  const ReportOptions options = OptionsOf(session, question);
  return session.ReadAs<CheckReport>([&](const SessionView& view) -> absl::StatusOr<CheckReport> {
    QueryBudget budget(session.limits(), terms);
    Tallies tallies(view.mesh, options.checks, options.max_findings);
    const EntityKind kind = question.part->kind;
    DYNMESH_RETURN_IF_ERROR(ForEachSelected({view.mesh, session.spatial(), budget}, kind,
                                            question.part->selection, [&](Slot slot) {
                                              return tallies.Add({kind, slot}, budget);
                                            }));
    CheckReport report;
    report.revision = view.mesh.revision();
    report.tallies = std::move(tallies).Take();
    return report;
  });
}

}  // namespace dynmesh
