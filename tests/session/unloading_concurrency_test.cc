// Callers and followers while sessions are unloaded under them, over and over. Meant for ThreadSanitizer, and
// true without it.

#include <atomic>
#include <memory>
#include <thread>

#include "server/store/local_store.h"
#include "server/store/memory_engine.h"
#include "tests/session/session_support.h"

namespace dynmesh::testing {
namespace {

constexpr int kRounds = 40;

class UnloadingConcurrencyTest : public ::testing::Test {
 protected:
  ~UnloadingConcurrencyTest() override { StopUnloading(); }

  SessionRegistry& registry() { return daemon_.registry(); }

  void StopUnloading() {
    stop_ = true;
    if (unloader_.joinable()) unloader_.join();
  }

  /// Whoever has used a session waits until one is unloaded since `before`: so that the next round finds one
  /// that is not loaded, or is just being unloaded or loaded.
  void AwaitUnloadingSince(int64_t before) {
    const absl::Time deadline = absl::Now() + kPatience;
    while (num_unloaded_ == before) {
      ASSERT_LT(absl::Now(), deadline) << "nothing is unloaded";
      std::this_thread::yield();
    }
  }

  /// A call as the RPC layer makes it: finds the session, and waits for its turn.
  template <typename Fn>
  void Call(const std::string& name, AccessMode mode, Fn fn) {
    const absl::StatusOr<SessionPtr> session = registry().Find(name);
    ASSERT_TRUE(session.ok()) << session.status();
    const AccessGrant turn = (*session)->access().Acquire(mode);
    fn(**session);
  }

  /// The revision that a batch has made, on disk.
  int64_t Edit(const std::string& name, const std::string& request_id) {
    int64_t revision = 0;
    Call(name, AccessMode::kWrite, [&](Session& session) {
      const auto applied = session.Apply(AddTet(), {.request_id = request_id});
      ASSERT_TRUE(applied.ok()) << applied.status();
      revision = (*applied)->revision;
      const absl::Status acknowledged = session.WaitUntilAcknowledged(revision);
      ASSERT_TRUE(acknowledged.ok()) << acknowledged;
    });
    return revision;
  }

  Daemon daemon_{{},
                 *LocalStore::Open(std::make_unique<MemoryEngine>()),
                 {.checkpoint_bytes = 20'000, .kept_answers = {10'000, 64 << 20}}};
  std::atomic<bool> stop_{false};
  std::atomic<int64_t> num_unloaded_{0};
  std::thread unloader_{[this] {
    for (absl::Time now = absl::Now() + absl::Hours(1); !stop_; now += absl::Hours(1)) {
      num_unloaded_ += registry().UnloadIdle(now, {.idle_timeout = absl::ZeroDuration()});
      std::this_thread::yield();
    }
  }};
};

TEST_F(UnloadingConcurrencyTest, NoCallFailsAndNoEditIsLostOrMadeTwice) {
  const std::string names[] = {"a", "b"};
  for (const std::string& name : names) daemon_.NewSession(name);
  std::vector<std::thread> callers;
  for (int i = 0; i < 4; ++i) {
    callers.emplace_back([&, i] {
      const std::string& name = names[i % 2];
      for (int round = 0; round < kRounds; ++round) {
        const std::string id = "edit " + std::to_string(round);  // two callers have the same
        const int64_t before = num_unloaded_;
        const int64_t revision = Edit(name, id);
        if (round % 2 == 0) AwaitUnloadingSince(before);
        EXPECT_EQ(Edit(name, id), revision) << "a retry";
        Call(name, AccessMode::kRead, [&](Session& session) {
          const absl::StatusOr<SessionInfo> info = session.Info();
          ASSERT_TRUE(info.ok()) << info.status();
          EXPECT_GE(info->durable_revision, revision);
          EXPECT_EQ(info->counts[3], static_cast<uint64_t>(info->revision));
        });
        registry().ListAfter("", 10)[0]->Outline();
      }
    });
  }
  for (std::thread& caller : callers) caller.join();
  StopUnloading();
  for (const std::string& name : names) {
    Call(name, AccessMode::kRead, [&](Session& session) {
      EXPECT_EQ(session.revision(), kRounds);
      EXPECT_EQ(session.Info()->counts[3], uint64_t{kRounds});
    });
  }
}

TEST_F(UnloadingConcurrencyTest, FollowersThatComeAndGoMissNothing) {
  daemon_.NewSession("mesh");
  Edit("mesh", "");
  std::thread editor([&] {
    for (int round = 0; round < kRounds; ++round) {
      const int64_t before = num_unloaded_;
      Edit("mesh", "");
      AwaitUnloadingSince(before);
    }
  });
  for (int round = 0; round < kRounds; ++round) {
    const int64_t before = num_unloaded_;
    {
      const SessionPtr session = *registry().Find("mesh");
      RecordingSink sink(daemon_.workers(), RecordingSink::Acknowledge::kAtOnce);
      ASSERT_TRUE(sink.Follow(session, {}).ok());
      sink.AwaitRevision(Edit("mesh", ""));
      EXPECT_TRUE(sink.error().ok()) << sink.error();
    }
    AwaitUnloadingSince(before);
  }
  editor.join();
  StopUnloading();
  EXPECT_EQ((*registry().Find("mesh"))->revision(), 2 * kRounds + 1);
}

TEST_F(UnloadingConcurrencyTest, SessionsComeAndGoAndNoneIsAnother) {
  std::vector<std::thread> callers;
  for (int i = 0; i < 3; ++i) {
    callers.emplace_back([&, name = "mesh" + std::to_string(i)] {
      for (int round = 0; round < kRounds; ++round) {
        const int64_t before = num_unloaded_;
        daemon_.NewSession(name);
        EXPECT_EQ(Edit(name, ""), 1);
        if (round % 3 == 0) AwaitUnloadingSince(before);
        const absl::StatusOr<int64_t> deleted = registry().Delete(name, "");
        ASSERT_TRUE(deleted.ok()) << deleted.status();
        EXPECT_EQ(*deleted, 1);
      }
    });
  }
  for (std::thread& caller : callers) caller.join();
  StopUnloading();
  EXPECT_TRUE(registry().ListAfter("", 10).empty());
}

}  // namespace
}  // namespace dynmesh::testing
