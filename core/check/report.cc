#include "core/check/report.h"

#include <utility>

namespace dynmesh {
namespace {

constexpr uint64_t kEntitiesPerReport = 1 << 14;
constexpr char kTopology[] = "topology";

absl::Status AddAll(const Mesh& mesh, EntityKind kind, Tallies& tallies, WorkMeter& meter,
                    ReportMonitor& monitor) {
  if (!tallies.LookAt(kind)) return absl::OkStatus();
  const BitSet& live = mesh.slots(kind).live();
  uint64_t done = 0;
  for (Slot slot = live.Next(0); slot != kNoSlot; slot = live.Next(slot + 1)) {
    if (done++ % kEntitiesPerReport == 0) monitor.OnProgress(EntityKindName(kind), done - 1, live.size());
    DYNMESH_RETURN_IF_ERROR(tallies.Add({kind, slot}, meter));
  }
  return absl::OkStatus();
}

std::vector<Tally> TalliesOf(const MeshTopology& topology, const CheckSettings& settings) {
  std::vector<Tally> tallies;
  for (CheckKind check : AllChecks()) {
    if (IsLocal(check) || !settings.IsOn(check)) continue;
    tallies.emplace_back();
    tallies.back().check = check;
    tallies.back().setting = settings[check];
    tallies.back().Note(ValueOf(check, topology));
  }
  return tallies;
}

}  // namespace

absl::StatusOr<CheckReport> CheckMesh(const Mesh& mesh, const ReportOptions& options, WorkMeter& meter,
                                      ReportMonitor& monitor) {
  CheckReport report;
  report.revision = mesh.revision();
  Tallies tallies(mesh, options.checks, options.max_findings);
  for (EntityKind kind : kEntityKinds) {
    DYNMESH_RETURN_IF_ERROR(AddAll(mesh, kind, tallies, meter, monitor));
  }
  monitor.OnProgress(kTopology, 0, 0);
  DYNMESH_ASSIGN_OR_RETURN(report.topology, SummarizeTopology(mesh, meter));
  report.tallies = std::move(tallies).Take();
  for (Tally& tally : TalliesOf(*report.topology, options.checks)) report.tallies.push_back(std::move(tally));
  return report;
}

}  // namespace dynmesh
