#include "server/session/executor.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <semaphore>
#include <stdexcept>

#include "absl/time/clock.h"
#include "server/session/timer.h"
#include "tests/session/session_support.h"

namespace dynmesh::testing {
namespace {

TEST(ExecutorTest, RunsWhatWaitsBeforeItStops) {
  std::atomic<int> runs{0};
  {
    Executor executor({"test", 2, 1000});
    for (int i = 0; i < 500; ++i) EXPECT_TRUE(executor.TryPost([&] { ++runs; }).ok());
  }
  EXPECT_EQ(runs, 500);
}

TEST(ExecutorTest, RefusesBeyondTheLimitAndNamesIt) {
  std::binary_semaphore go{0}, begun{0};
  Executor executor({"test", 1, 2});
  ASSERT_TRUE(executor
                  .TryPost([&] {
                    begun.release();
                    go.acquire();
                  })
                  .ok());
  begun.acquire();
  EXPECT_TRUE(executor.TryPost([] {}).ok());
  EXPECT_TRUE(executor.TryPost([] {}).ok());
  const absl::Status refused = executor.TryPost([] {});
  EXPECT_EQ(RefusalOf(refused), (Refusal{absl::StatusCode::kResourceExhausted, reason::kLimitExceeded}));
  EXPECT_EQ(MetadataOf(refused, "limit"), "max_queued_tasks");
  bool ran = false;
  executor.Post([&] { ran = true; });  // what was admitted goes on
  go.release();
  executor.Stop();
  EXPECT_TRUE(ran);
}

TEST(ExecutorTest, RefusesAfterStop) {
  Executor executor({"test", 1, 2});
  executor.Stop();
  EXPECT_EQ(RefusalOf(executor.TryPost([] {})),
            (Refusal{absl::StatusCode::kUnavailable, reason::kShuttingDown}));
}

TEST(ExecutorTest, SurvivesExceptions) {
  Executor executor({"test", 1, 10});
  bool ran = false;
  executor.Post([] { throw std::runtime_error("no"); });
  executor.Post([] { throw std::bad_alloc(); });
  executor.Post([&] { ran = true; });
  executor.Stop();
  EXPECT_TRUE(ran);
}

TEST(ExecutorTest, WhatATaskOwnsIsGoneWhenItHasRun) {
  Executor executor({"test", 1, 10});
  std::binary_semaphore gone{0};
  std::shared_ptr<int> owned(new int(0), [&](int* number) {
    delete number;
    gone.release();
  });
  executor.Post([owned = std::move(owned)] {});
  EXPECT_TRUE(gone.try_acquire_for(std::chrono::seconds(60))) << "kept until there is another task";
}

TEST(TimerTest, CallsInOrderOfTimeAndNotBefore) {
  Timer timer;
  Mutex mu;
  CondVar changed;
  std::vector<int> order;
  const absl::Time begin = absl::Now();
  const auto later = [&](int ms, int id) {
    timer.RunAt(begin + absl::Milliseconds(ms), [&, ms, id] {
      EXPECT_GE(absl::Now(), begin + absl::Milliseconds(ms));
      MutexLock lock(&mu);
      order.push_back(id);
      changed.NotifyAll();
    });
  };
  later(60, 3);
  later(20, 1);
  later(40, 2);
  later(-5, 0);
  MutexLock lock(&mu);
  ASSERT_TRUE(AwaitThat(&mu, changed, [&] { return order.size() == 4; }));
  EXPECT_EQ(order, (std::vector<int>{0, 1, 2, 3}));
}

TEST(TimerTest, DropsWhatWaitsWhenItStops) {
  auto owned = std::make_shared<int>(1);
  Timer timer;
  timer.RunAt(absl::Now() + absl::Hours(1), [owned] {});
  timer.Stop();
  EXPECT_EQ(owned.use_count(), 1);
  timer.RunAt(absl::Now(), [owned] {});
  EXPECT_EQ(owned.use_count(), 1);
}

}  // namespace
}  // namespace dynmesh::testing
