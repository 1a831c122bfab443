#include "server/session/query_budget.h"

#include <algorithm>

#include "core/mesh/error.h"

namespace dynmesh {

absl::Status QueryBudget::LeaseMore() {
  if (bytes_ > max_bytes_) return LimitExceeded("max_query_bytes", max_bytes_, bytes_);
  const uint64_t more = std::max(bytes_ - leased_, kLeaseBytes);
  if (terms_.answer != nullptr) DYNMESH_RETURN_IF_ERROR(terms_.answer->Grow(more));
  leased_ += more;
  leased_ = std::min(leased_, max_bytes_);
  return absl::OkStatus();
}

absl::Status QueryBudget::CheckBytes(uint64_t bytes) const {
  const uint64_t all = bytes_ + bytes;
  return all <= max_bytes_ ? absl::OkStatus() : LimitExceeded("max_query_bytes", max_bytes_, all);
}

absl::Status QueryBudget::CheckSteps() {
  if (steps_ > max_steps_) return LimitExceeded("max_query_steps", max_steps_, steps_);
  next_check_ = std::min(steps_ + kStepsPerCheck, max_steps_ + 1);
  return terms_.stop.Check();
}

}  // namespace dynmesh
