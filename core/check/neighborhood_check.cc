#include "core/check/neighborhood_check.h"

#include <string>

#include "absl/strings/str_cat.h"
#include "core/check/tally.h"
#include "core/mesh/error.h"

namespace dynmesh {
namespace {

absl::Status Refuse(const Tally& tally, EntityKind kind) {
  const CheckTraits& traits = TraitsOf(tally.check);
  const Findings& findings = tally.findings[Dimension(kind)];
  const std::string value = absl::StrCat(findings.values[0]),
                    threshold = absl::StrCat(tally.setting.threshold);
  const absl::string_view side = traits.bad == BadSide::kBelow ? " is below " : " is above ";
  return FailedPrecondition(reason::kCheckFailed,
                            absl::StrCat(traits.name, " of ", EntityKindName(kind), " ", findings.slots[0],
                                         " would be ", value, ", which", side, threshold),
                            {{"check", std::string(traits.name)},
                             {"kind", std::string(EntityKindName(kind))},
                             {"ids", JoinSlots(findings.slots)},
                             {"count", absl::StrCat(findings.count)},
                             {"value", value},
                             {"threshold", threshold}});
}

BatchWarning Warn(const Tally& tally, EntityKind kind) {
  const Findings& findings = tally.findings[Dimension(kind)];
  return {static_cast<uint32_t>(tally.check),
          std::string(TraitsOf(tally.check).name),
          kind,
          tally.setting.threshold,
          findings.slots,
          findings.values,
          findings.count};
}

}  // namespace

absl::Status NeighborhoodCheck::Check(const Mesh& mesh, WorkMeter& meter,
                                      std::vector<BatchWarning>& warnings) {
  Tallies tallies(mesh, settings_, kMaxWarnedIds);
  if (tallies.tallies().empty()) return absl::OkStatus();
  DYNMESH_ASSIGN_OR_RETURN(const EntitySlots touched, mesh.Touched(meter));
  for (EntityKind kind : kEntityKinds) {
    for (Slot slot : touched[Dimension(kind)]) DYNMESH_RETURN_IF_ERROR(tallies.Add({kind, slot}, meter));
  }
  for (const Tally& tally : tallies.tallies()) {
    for (EntityKind kind : kEntityKinds) {
      if (tally.findings[Dimension(kind)].count == 0) continue;
      if (tally.setting.severity == Severity::kReject) return Refuse(tally, kind);
      warnings.push_back(Warn(tally, kind));
    }
  }
  return absl::OkStatus();
}

}  // namespace dynmesh
