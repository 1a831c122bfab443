#ifndef DYNMESH_CORE_CHECK_REPORT_H_
#define DYNMESH_CORE_CHECK_REPORT_H_

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/types/optional.h"
#include "core/check/check.h"
#include "core/check/summary.h"
#include "core/check/tally.h"
#include "core/mesh/mesh.h"
#include "core/mesh/work_meter.h"

namespace dynmesh {

struct ReportOptions {
  CheckSettings checks;        ///< those that are on are made, whatever their severity
  size_t max_findings = 1000;  ///< of each check and kind; the rest is counted
};

/// What checks found in a mesh.
struct CheckReport {
  int64_t revision = 0;
  std::vector<Tally> tallies;             ///< of the checks that were made, in order
  absl::optional<MeshTopology> topology;  ///< if the whole mesh was looked at
};

/// Who is told how far a report is.
class ReportMonitor {
 public:
  virtual ~ReportMonitor() = default;
  /// `phase` is "vertex", "edge", "face", "cell", or "topology". Called every few thousand entities.
  virtual void OnProgress(absl::string_view phase, uint64_t done, uint64_t total) = 0;
};

/// Looks at every entity, and at the mesh as a whole. Errors: those of `meter`.
/// Cost: about a microsecond an entity with all checks.
absl::StatusOr<CheckReport> CheckMesh(const Mesh& mesh, const ReportOptions& options, WorkMeter& meter,
                                      ReportMonitor& monitor);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_CHECK_REPORT_H_
