#ifndef DYNMESH_SERVER_SESSION_BUDGET_H_
#define DYNMESH_SERVER_SESSION_BUDGET_H_

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <memory>
#include <utility>

#include "absl/status/status.h"
#include "core/mesh/error.h"

namespace dynmesh {

/// An amount that a whole daemon shares: bytes, or places in a queue.
///
/// Thread safety: full; one atomic operation a call.
class Budget {
 public:
  /// `limit` is the name of a field of Limits.
  Budget(const char* limit, uint64_t max) : limit_(limit), max_(max) {}

  /// Errors: RESOURCE_EXHAUSTED LIMIT_EXCEEDED; nothing is taken then.
  absl::Status Take(uint64_t amount) {
    const uint64_t used = used_.fetch_add(amount) + amount;
    if (used <= max_) return absl::OkStatus();
    used_.fetch_sub(amount);
    return LimitExceeded(limit_, max_, used);
  }
  void Give(uint64_t amount) { used_.fetch_sub(amount); }

  uint64_t used() const { return used_.load(); }

 private:
  const char* const limit_;
  const uint64_t max_;
  std::atomic<uint64_t> used_{0};
};

/// A part of a Budget, given back when this is destroyed. One without a budget is never refused.
///
/// Thread safety: that of std::vector.
class Lease {
 public:
  Lease() = default;
  explicit Lease(std::shared_ptr<Budget> budget) : budget_(std::move(budget)) {}
  Lease(Lease&& other) noexcept : budget_(std::move(other.budget_)), held_(std::exchange(other.held_, 0)) {}
  Lease& operator=(Lease&& other) noexcept {
    std::swap(budget_, other.budget_);
    std::swap(held_, other.held_);
    return *this;
  }
  ~Lease() { Shrink(held_); }

  /// Errors: those of Budget::Take.
  absl::Status Grow(uint64_t amount) {
    if (budget_ == nullptr) return absl::OkStatus();
    DYNMESH_RETURN_IF_ERROR(budget_->Take(amount));
    held_ += amount;
    return absl::OkStatus();
  }

  /// Gives `amount` back, or all when that is less.
  void Shrink(uint64_t amount) {
    amount = std::min(amount, held_);
    if (budget_ != nullptr) budget_->Give(amount);
    held_ -= amount;
  }

  uint64_t held() const { return held_; }

 private:
  std::shared_ptr<Budget> budget_;
  uint64_t held_ = 0;
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_BUDGET_H_
