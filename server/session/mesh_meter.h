#ifndef DYNMESH_SERVER_SESSION_MESH_METER_H_
#define DYNMESH_SERVER_SESSION_MESH_METER_H_

#include <cstdint>
#include <limits>

#include "absl/status/status.h"
#include "core/mesh/error.h"
#include "core/mesh/work_meter.h"
#include "server/session/stop_signal.h"

namespace dynmesh {

/// Lets a session's mesh grow and be worked on as long as it stays within its limit, and somebody waits for
/// what comes of it. Thread safety: that of std::vector.
class MeshMeter final : public WorkMeter {
 public:
  struct Allowance {
    uint64_t used_bytes;
    uint64_t max_bytes;
    uint64_t max_steps = std::numeric_limits<uint64_t>::max();
    const char* steps_name = "";  ///< of that limit
  };

  MeshMeter(const Allowance& allowance, const StopSignal& stop)
      : allowance_(allowance), bytes_(allowance.used_bytes), stop_(stop) {}

  /// Errors: RESOURCE_EXHAUSTED LIMIT_EXCEEDED (steps_name); those of the StopSignal.
  absl::Status ChargeSteps(uint64_t steps) override {
    steps_ += steps;
    if (steps_ > allowance_.max_steps) {
      return LimitExceeded(allowance_.steps_name, allowance_.max_steps, steps_);
    }
    return stop_.Check();
  }

  /// Errors: RESOURCE_EXHAUSTED LIMIT_EXCEEDED (max_session_bytes).
  absl::Status ChargeBytes(uint64_t bytes) override {
    bytes_ += bytes;
    if (bytes_ <= allowance_.max_bytes) return absl::OkStatus();
    return LimitExceeded("max_session_bytes", allowance_.max_bytes, bytes_);
  }

 private:
  const Allowance allowance_;
  uint64_t bytes_;
  uint64_t steps_ = 0;
  const StopSignal& stop_;
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_MESH_METER_H_
