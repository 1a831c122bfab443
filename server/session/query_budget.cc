#include "server/session/query_budget.h"

#include <algorithm>

#include "core/mesh/error.h"

namespace dynmesh {

absl::Status QueryBudget::LeaseMore() {
  if (bytes_ > bounds_.max_bytes) return LimitExceeded("max_query_bytes", bounds_.max_bytes, bytes_);
  const uint64_t more = std::max(bytes_ - leased_, kLeaseBytes);
  if (terms_.answer != nullptr) DYNMESH_RETURN_IF_ERROR(terms_.answer->Grow(more));
  leased_ += more;
  leased_ = std::min(leased_, bounds_.max_bytes);
  return absl::OkStatus();
}

absl::Status QueryBudget::CheckBytes(uint64_t bytes) const {
  const uint64_t all = bytes_ + bytes;
  return all <= bounds_.max_bytes ? absl::OkStatus()
                                  : LimitExceeded("max_query_bytes", bounds_.max_bytes, all);
}

absl::Status QueryBudget::CheckSteps() {
  if (steps_ > bounds_.max_steps) return LimitExceeded(bounds_.steps_name, bounds_.max_steps, steps_);
  next_check_ = std::min(steps_ + kStepsPerCheck, bounds_.max_steps + 1);
  return terms_.stop.Check();
}

}  // namespace dynmesh
