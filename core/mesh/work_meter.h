#ifndef DYNMESH_CORE_MESH_WORK_METER_H_
#define DYNMESH_CORE_MESH_WORK_METER_H_

#include <algorithm>
#include <cstdint>

#include "absl/status/status.h"

namespace dynmesh {

/// Whom a long search asks before it goes on, so that it ends early when it costs too much or when nobody
/// wants its result any more. Searches return the error that they get. Thread safety: that of std::vector.
class WorkMeter {
 public:
  /// The largest number of steps to charge at once.
  static constexpr uint64_t kMaxCharge = 8192;

  virtual ~WorkMeter() = default;

  /// To be called before `steps` entities, or entries of incidence lists, are looked at.
  virtual absl::Status ChargeSteps(uint64_t steps) = 0;
  /// The same for any number of steps.
  absl::Status ChargeManySteps(uint64_t steps) {
    absl::Status status;
    for (; steps > 0 && status.ok(); steps -= std::min(steps, kMaxCharge)) {
      status = ChargeSteps(std::min(steps, kMaxCharge));
    }
    return status;
  }
  /// To be called before a result grows by `bytes`.
  virtual absl::Status ChargeBytes(uint64_t bytes) = 0;

  /// One that lets everything pass.
  static WorkMeter& Unlimited();

 protected:
  WorkMeter() = default;
  WorkMeter(const WorkMeter&) = default;
  WorkMeter& operator=(const WorkMeter&) = default;
};

namespace internal {

class UnlimitedWork final : public WorkMeter {
 public:
  absl::Status ChargeSteps(uint64_t) override { return absl::OkStatus(); }
  absl::Status ChargeBytes(uint64_t) override { return absl::OkStatus(); }
};

}  // namespace internal

inline WorkMeter& WorkMeter::Unlimited() {
  static internal::UnlimitedWork unlimited;
  return unlimited;
}

}  // namespace dynmesh

#endif  // DYNMESH_CORE_MESH_WORK_METER_H_
