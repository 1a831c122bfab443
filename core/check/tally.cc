#include "core/check/tally.h"

#include <algorithm>

#include "core/check/local_check.h"

namespace dynmesh {

bool Tally::Note(double value) {
  ++num_measured;
  lowest = std::min(lowest, value);
  highest = std::max(highest, value);
  const bool bad = Fails(check, value, setting.threshold);
  num_bad += bad;
  return bad;
}

Tallies::Tallies(const Mesh& mesh, const CheckSettings& settings, size_t max_findings)
    : mesh_(mesh), max_findings_(max_findings) {
  for (CheckKind check : AllChecks()) {
    if (!IsLocal(check) || !settings.IsOn(check)) continue;
    tallies_.emplace_back();
    tallies_.back().check = check;
    tallies_.back().setting = settings[check];
  }
}

bool Tallies::LookAt(EntityKind kind) const {
  return std::any_of(tallies_.begin(), tallies_.end(),
                     [kind](const Tally& tally) { return LooksAt(tally.check, kind); });
}

absl::Status Tallies::Add(EntityId id, WorkMeter& meter) {
  for (Tally& tally : tallies_) {
    DYNMESH_ASSIGN_OR_RETURN(const absl::optional<double> value,
                             MeasureEntity(mesh_, tally.check, id, meter));
    if (!value.has_value() || !tally.Note(*value)) continue;
    Findings& findings = tally.findings[Dimension(id.kind)];
    ++findings.count;
    if (findings.slots.size() >= max_findings_) continue;
    DYNMESH_RETURN_IF_ERROR(meter.ChargeBytes(sizeof(Slot) + sizeof(double)));
    findings.slots.push_back(id.slot);
    findings.values.push_back(*value);
  }
  return absl::OkStatus();
}

}  // namespace dynmesh
