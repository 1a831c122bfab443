#include "server/session/durability/revision_gate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>
#include <vector>

namespace dynmesh::testing {
namespace {

using Result = std::future<absl::Status>;

Result WaitFor(RevisionGate& gate, int64_t revision) {
  auto promise = std::make_shared<std::promise<absl::Status>>();
  Result result = promise->get_future();
  gate.Wait(revision, [promise](const absl::Status& status) { promise->set_value(status); });
  return result;
}

bool IsReady(const Result& result) {
  return result.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

TEST(RevisionGateTest, WhoWaitsIsCalledWhenTheRevisionIsReached) {
  Executor executor({"test", 2, 100});
  RevisionGate gate(3, &executor);
  EXPECT_TRUE(IsReady(WaitFor(gate, 3))) << "it was reached before";
  Result fourth = WaitFor(gate, 4), another = WaitFor(gate, 4), sixth = WaitFor(gate, 6);
  EXPECT_FALSE(IsReady(fourth));
  gate.Reach(5);
  EXPECT_TRUE(fourth.get().ok());
  EXPECT_TRUE(another.get().ok());
  EXPECT_FALSE(IsReady(sixth));
  EXPECT_EQ(gate.reached(), 5);
  gate.Reach(4);
  EXPECT_EQ(gate.reached(), 5) << "it never goes back";
  gate.Reach(6);
  EXPECT_TRUE(sixth.get().ok());
}

TEST(RevisionGateTest, AfterAFailureNothingMoreIsReachedButWhatWas) {
  Executor executor({"test", 2, 100});
  RevisionGate gate(1, &executor);
  Result waiting = WaitFor(gate, 2);
  gate.Fail(absl::UnavailableError("first"));
  gate.Fail(absl::UnavailableError("second"));
  EXPECT_EQ(waiting.get().message(), "first");
  EXPECT_TRUE(WaitFor(gate, 1).get().ok());
  EXPECT_EQ(WaitFor(gate, 2).get().message(), "first");
  EXPECT_EQ(gate.Await(7).message(), "first");
  EXPECT_EQ(gate.status().message(), "first");
}

TEST(RevisionGateTest, AThreadCanWait) {
  Executor executor({"test", 1, 100});
  RevisionGate gate(0, &executor);
  executor.Post([&] { gate.Reach(2); });
  EXPECT_TRUE(gate.Await(1).ok());
}

}  // namespace
}  // namespace dynmesh::testing
