#ifndef DYNMESH_SERVER_SESSION_QUERY_BUDGET_H_
#define DYNMESH_SERVER_SESSION_QUERY_BUDGET_H_

#include <cstdint>

#include "absl/status/status.h"
#include "core/mesh/work_meter.h"
#include "server/session/budget.h"
#include "server/session/limits.h"
#include "server/session/stop_signal.h"

namespace dynmesh {

/// On whose behalf a session is read. The defaults are those of a caller within the daemon.
struct QueryTerms {
  const StopSignal& stop = StopSignal::Never();
  Lease* answer = nullptr;  ///< grows by what the answer occupies; null: nobody counts that
};

/// What one answer may still cost while it is gathered: bytes of the answer, and steps of the way to it.
///
/// A step is one entity or one entry of an incidence list that is looked at, about ten nanoseconds; a
/// geometric test counts as many steps as it takes. So a query takes a time that is bounded whatever the mesh
/// looks like, and never goes on for longer than kStepsPerCheck steps after nobody wants its answer any more.
/// Thread safety: that of std::vector.
class QueryBudget final : public WorkMeter {
 public:
  static constexpr uint64_t kStepsPerCheck = WorkMeter::kMaxCharge;

  struct Bounds {
    uint64_t max_bytes;
    uint64_t max_steps;
    const char* steps_name;  ///< of that limit
  };

  QueryBudget(const Limits& limits, const QueryTerms& terms)
      : QueryBudget(Bounds{limits.max_query_bytes, limits.max_query_steps, "max_query_steps"}, terms) {}
  QueryBudget(const Bounds& bounds, const QueryTerms& terms) : bounds_(bounds), terms_(terms) {}

  /// Errors: RESOURCE_EXHAUSTED LIMIT_EXCEEDED (max_query_bytes, max_answer_bytes).
  absl::Status ChargeBytes(uint64_t bytes) override {
    bytes_ += bytes;
    return bytes_ <= leased_ ? absl::OkStatus() : LeaseMore();
  }

  /// Whether an answer of so many bytes more can be: for what is known to be too large before it is worked
  /// out. Charges nothing. Errors: RESOURCE_EXHAUSTED LIMIT_EXCEEDED (max_query_bytes).
  absl::Status CheckBytes(uint64_t bytes) const;

  /// To be called before the steps are made, so `steps` should be no more than some kStepsPerCheck.
  /// Errors: RESOURCE_EXHAUSTED LIMIT_EXCEEDED (Bounds::steps_name); those of the StopSignal.
  absl::Status ChargeSteps(uint64_t steps) override {
    steps_ += steps;
    return steps_ < next_check_ ? absl::OkStatus() : CheckSteps();
  }

 private:
  // The daemon's budget is asked once for so many bytes.
  static constexpr uint64_t kLeaseBytes = uint64_t{64} << 10;

  absl::Status LeaseMore();
  absl::Status CheckSteps();

  const Bounds bounds_;
  const QueryTerms terms_;
  uint64_t bytes_ = 0;
  uint64_t leased_ = 0;
  uint64_t steps_ = 0;
  uint64_t next_check_ = 1;  ///< at once: an answer that nobody waits for is not begun
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_QUERY_BUDGET_H_
