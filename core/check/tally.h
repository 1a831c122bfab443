#ifndef DYNMESH_CORE_CHECK_TALLY_H_
#define DYNMESH_CORE_CHECK_TALLY_H_

#include <array>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "core/check/check.h"
#include "core/mesh/mesh.h"
#include "core/mesh/work_meter.h"

namespace dynmesh {

/// Entities of one kind that a check found bad, and what it measured there.
struct Findings {
  std::vector<Slot> slots;
  std::vector<double> values;
  uint64_t count = 0;  ///< all, also those that are not named
};

/// What one check found.
struct Tally {
  CheckKind check = CheckKind::kUnspecified;
  CheckSetting setting;
  uint64_t num_measured = 0;  ///< entities; of the whole mesh: 1
  uint64_t num_bad = 0;
  double lowest = std::numeric_limits<double>::infinity();  ///< value, of what was measured
  double highest = -std::numeric_limits<double>::infinity();
  std::array<Findings, kNumEntityKinds> findings;  ///< of local checks, by kind

  /// Notes a value; true when it is bad.
  bool Note(double value);
};

/// Makes local checks on entities one by one, and keeps up to `max_findings` of each check and kind.
/// Thread safety: that of std::vector.
class Tallies {
 public:
  /// Of the checks of `settings` that are local and on.
  Tallies(const Mesh& mesh, const CheckSettings& settings, size_t max_findings);

  /// Makes the checks that look at entities of this kind. Errors: those of `meter`, which is also charged the
  /// bytes of findings. REQUIRES: `id` is live.
  absl::Status Add(EntityId id, WorkMeter& meter);
  bool LookAt(EntityKind kind) const;

  const std::vector<Tally>& tallies() const { return tallies_; }
  std::vector<Tally> Take() && { return std::move(tallies_); }

 private:
  const Mesh& mesh_;
  const size_t max_findings_;
  std::vector<Tally> tallies_;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_CHECK_TALLY_H_
