#include "server/session/access_queue.h"

#include <atomic>
#include <chrono>
#include <semaphore>
#include <thread>

#include "tests/session/session_support.h"

namespace dynmesh::testing {
namespace {

constexpr AccessMode kRead = AccessMode::kRead;
constexpr AccessMode kWrite = AccessMode::kWrite;

/// Runs what waits in an executor; the turn of whoever began has come then.
void Settle(Executor& executor) {
  std::binary_semaphore done{0};
  executor.Post([&] { done.release(); });
  done.acquire();
}

// Each of two readers waits for the other: both have their turn at once, or neither ends.
TEST(AccessQueueTest, ReadersComeTogether) {
  Executor executor({"test", 2, 10});
  const auto queue = std::make_shared<AccessQueue>();
  std::binary_semaphore first{0}, second{0};
  std::atomic<int> met{0};
  const auto meet = [&](std::binary_semaphore& mine, std::binary_semaphore& theirs) {
    mine.release();
    if (theirs.try_acquire_for(std::chrono::seconds(60))) ++met;
  };
  queue->Post(kRead, executor, [&](AccessGrant) { meet(first, second); });
  queue->Post(kRead, executor, [&](AccessGrant) { meet(second, first); });
  const AccessGrant last = queue->Acquire(kWrite);
  EXPECT_EQ(met, 2);
}

TEST(AccessQueueTest, AWriterIsAlone) {
  Executor executor({"test", 4, 10'000});
  const auto queue = std::make_shared<AccessQueue>();
  std::atomic<int> reading{0}, writing{0}, clashes{0}, runs{0};
  for (int i = 0; i < 600; ++i) {
    const bool writes = i % 7 == 0;
    queue->Post(writes ? kWrite : kRead, executor, [&, writes](AccessGrant) {
      (writes ? writing : reading)++;
      if (writing > 1 || (writing == 1 && reading > 0)) ++clashes;
      std::this_thread::yield();
      (writes ? writing : reading)--;
      ++runs;
    });
  }
  const AccessGrant last = queue->Acquire(kWrite);
  EXPECT_EQ(runs, 600);
  EXPECT_EQ(clashes, 0);
}

TEST(AccessQueueTest, FirstComeFirstServed) {
  Executor executor({"test", 1, 100});
  const auto queue = std::make_shared<AccessQueue>();
  std::string order;
  AccessGrant held = queue->Acquire(kRead);
  const auto post = [&](AccessMode mode, char name) {
    queue->Post(mode, executor, [&order, name](AccessGrant) { order += name; });
  };
  post(kRead, 'a');
  post(kWrite, 'B');
  post(kRead, 'c');  // readers that come later do not starve the writer
  post(kRead, 'd');
  post(kWrite, 'E');
  Settle(executor);
  EXPECT_EQ(order, "a");
  held.Release();
  held.Release();
  const AccessGrant last = queue->Acquire(kWrite);
  EXPECT_EQ(order, "aBcdE");
}

TEST(AccessQueueTest, ABusySessionKeepsNoThreadFromOthers) {
  Executor executor({"test", 1, 1000});
  const auto busy = std::make_shared<AccessQueue>();
  const auto other = std::make_shared<AccessQueue>();
  std::atomic<int> runs{0};
  AccessGrant held = busy->Acquire(kRead);
  for (int i = 0; i < 100; ++i) {
    ASSERT_TRUE(busy->TryPost(i % 2 == 0 ? kWrite : kRead, executor, 10, [&](AccessGrant) { ++runs; }).ok());
  }
  bool answered = false;
  other->Post(kWrite, executor, [&](AccessGrant) { answered = true; });
  Settle(executor);
  EXPECT_TRUE(answered);
  EXPECT_EQ(runs, 0);
  held.Release();
  { const AccessGrant last = busy->Acquire(kWrite); }
  EXPECT_EQ(runs, 100);
}

TEST(AccessQueueTest, WhatWaitsForASessionCountsAsWaiting) {
  Executor executor({"test", 1, 3, 1000});
  const auto queue = std::make_shared<AccessQueue>();
  AccessGrant held = queue->Acquire(kWrite);
  const auto post = [&](size_t bytes) { return queue->TryPost(kRead, executor, bytes, [](AccessGrant) {}); };
  EXPECT_TRUE(post(600).ok());
  EXPECT_EQ(MetadataOf(post(600), "limit"), "max_queued_bytes");
  EXPECT_TRUE(post(400).ok());
  EXPECT_TRUE(post(0).ok());
  EXPECT_EQ(MetadataOf(post(0), "limit"), "max_queued_tasks");
  held.Release();
  { const AccessGrant last = queue->Acquire(kWrite); }
  EXPECT_TRUE(post(1000).ok());
}

TEST(AccessQueueTest, ATurnThatIsDroppedPassesOn) {
  const auto queue = std::make_shared<AccessQueue>();
  auto executor = std::make_unique<Executor>(Executor::Options{"test", 1, 10});
  AccessGrant held = queue->Acquire(kWrite);
  for (int i = 0; i < 20'000; ++i) queue->Post(kWrite, *executor, [](AccessGrant) {});
  executor->Stop();
  held.Release();
  const AccessGrant last = queue->Acquire(kWrite);
}

// With the lock itself held, which no call does for long, one call waits for it and the others for their
// turn.
TEST(AccessQueueTest, EditsOfALockedSessionTakeOneThread) {
  Daemon daemon;  // three quick threads
  const SessionPtr locked = daemon.NewSession("locked");
  const SessionPtr other = daemon.NewSession("other");
  std::binary_semaphore holds{0}, enough{0};
  std::thread reader([&] {
    EXPECT_TRUE(locked
                    ->Read([&](const SessionView&) {
                      holds.release();
                      enough.acquire();
                      return absl::OkStatus();
                    })
                    .ok());
  });
  holds.acquire();
  for (int i = 0; i < 100; ++i) {
    locked->access().Post(kWrite, *daemon.workers().quick,
                          [&](AccessGrant) { EXPECT_TRUE(locked->Apply(AddTet(), {}).ok()); });
  }
  for (int i = 0; i < 100; ++i) {
    std::binary_semaphore answered{0};
    other->access().Post(kWrite, *daemon.workers().quick, [&](AccessGrant) {
      EXPECT_TRUE(other->Apply(AddTet(), {}).ok());
      answered.release();
    });
    ASSERT_TRUE(answered.try_acquire_for(absl::ToChronoSeconds(kPatience)));
  }
  EXPECT_EQ(locked->revision(), 0);
  enough.release();
  reader.join();
  { const AccessGrant last = locked->access().Acquire(kWrite); }
  EXPECT_EQ(locked->revision(), 100);
}

}  // namespace
}  // namespace dynmesh::testing
