#ifndef DYNMESH_TESTS_SUPPORT_COUNT_DOWN_H_
#define DYNMESH_TESTS_SUPPORT_COUNT_DOWN_H_

#include "core/mesh/work_meter.h"

namespace dynmesh::testing {

/// A meter that says stop after so many steps, and notes whether anybody went on.
class CountDown : public WorkMeter {
 public:
  explicit CountDown(int64_t steps) : left_(steps) {}

  absl::Status ChargeSteps(uint64_t steps) override {
    if (left_ < 0) ++charges_after_end_;
    left_ -= steps;
    return left_ < 0 ? error() : absl::OkStatus();
  }
  absl::Status ChargeBytes(uint64_t bytes) override {
    bytes_ += bytes;
    return absl::OkStatus();
  }

  static absl::Status error() { return absl::CancelledError("enough"); }
  int64_t left() const { return left_; }
  uint64_t bytes() const { return bytes_; }
  int charges_after_end() const { return charges_after_end_; }

 private:
  int64_t left_;
  uint64_t bytes_ = 0;
  int charges_after_end_ = 0;
};

}  // namespace dynmesh::testing

#endif  // DYNMESH_TESTS_SUPPORT_COUNT_DOWN_H_
