#include "server/store/committer.h"

#include <gtest/gtest.h>

#include <thread>

#include "core/mesh/error.h"
#include "server/store/store_errors.h"
#include "tests/store/acknowledgements.h"

namespace dynmesh::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::Pair;

constexpr absl::Duration kNever = absl::Hours(24);

// Notes what is written to it, and holds writers up while told to.
class NotingEngine final : public Engine {
 public:
  struct Note {
    size_t num_changes;
    bool synced;
    bool operator==(const Note&) const = default;
  };

  absl::Status Write(const EngineBatch& batch, Sync sync) override {
    MutexLock lock(&mu_);
    writing_ = true;
    changed_.NotifyAll();
    while (hold_) changed_.Wait(&mu_);
    writing_ = false;
    notes_.push_back({batch.changes().size(), sync == Sync::kYes});
    return result_;
  }
  absl::StatusOr<absl::optional<std::string>> Get(absl::string_view) const override {
    return absl::UnimplementedError("");
  }
  absl::Status Scan(absl::string_view, absl::string_view, Visitor) const override {
    return absl::UnimplementedError("");
  }
  absl::StatusOr<absl::optional<std::string>> LastKey(absl::string_view, absl::string_view) const override {
    return absl::UnimplementedError("");
  }

  void Hold() {
    MutexLock lock(&mu_);
    hold_ = true;
  }
  void AwaitHeldWrite() {
    MutexLock lock(&mu_);
    EXPECT_TRUE(AwaitThat(&mu_, changed_, [this] { return writing_; }));
  }
  void Release() {
    MutexLock lock(&mu_);
    hold_ = false;
    changed_.NotifyAll();
  }
  void Answer(absl::Status result) {
    MutexLock lock(&mu_);
    result_ = std::move(result);
  }
  std::vector<Note> notes() const {
    MutexLock lock(&mu_);
    return notes_;
  }

 private:
  mutable Mutex mu_;
  CondVar changed_;
  bool hold_ = false;
  bool writing_ = false;
  absl::Status result_;
  std::vector<Note> notes_;
};

void PrintTo(const NotingEngine::Note& note, std::ostream* out) {
  *out << note.num_changes << (note.synced ? " synced" : "");
}

Committer::Write WriteOf(Durability durability, SessionStore::Done done, size_t bytes = 1) {
  Committer::Write write;
  write.batch.Put("k", std::string(bytes - 1, 'x'));
  write.durability = durability;
  write.done = std::move(done);
  return write;
}

TEST(CommitterTest, WritesThatWaitShareOneBatchAndOneSync) {
  NotingEngine engine;
  Acknowledgements acknowledged;
  Committer committer(&engine, {.async_delay = kNever});
  engine.Hold();
  committer.Enqueue(WriteOf(Durability::kSync, acknowledged.Of(0)));
  engine.AwaitHeldWrite();
  for (int i = 1; i < 65; ++i) committer.Enqueue(WriteOf(Durability::kSync, acknowledged.Of(i)));
  engine.Release();
  EXPECT_EQ(acknowledged.AwaitSuccesses(65).size(), 65u);
  EXPECT_THAT(engine.notes(), ElementsAre(NotingEngine::Note{1, true}, NotingEngine::Note{64, true}));
}

TEST(CommitterTest, AcknowledgesInTheOrderOfTheWrites) {
  NotingEngine engine;
  Acknowledgements acknowledged;
  Committer committer(&engine, {.async_delay = kNever});
  std::vector<int> order;
  for (int i = 0; i < 300; ++i) {
    committer.Enqueue(WriteOf(i % 3 == 0 ? Durability::kSync : Durability::kAsync, acknowledged.Of(i)));
    order.push_back(i);
  }
  EXPECT_EQ(acknowledged.AwaitSuccesses(300), order);
}

TEST(CommitterTest, SyncsNothingBeforeItsTimeIfNobodyAsks) {
  NotingEngine engine;
  Acknowledgements acknowledged;
  {
    Committer committer(&engine, {.async_delay = kNever});
    committer.Enqueue(WriteOf(Durability::kAsync, acknowledged.Of(0)));
    acknowledged.Await(1);
    EXPECT_THAT(engine.notes(), ElementsAre(NotingEngine::Note{1, false}));
  }
  EXPECT_THAT(engine.notes(), ElementsAre(NotingEngine::Note{1, false}, NotingEngine::Note{0, true}))
      << "the end brings it to disk";
}

TEST(CommitterTest, SyncsAnAsyncWriteInItsTimeThoughNobodyAsks) {
  NotingEngine engine;
  Acknowledgements acknowledged, on_disk;
  Committer committer(&engine, {.async_delay = absl::Milliseconds(1)});
  Committer::Write write = WriteOf(Durability::kAsync, acknowledged.Of(0));
  write.on_disk = on_disk.Of(0);
  committer.Enqueue(std::move(write));
  EXPECT_THAT(on_disk.AwaitSuccesses(1), ElementsAre(0));
  EXPECT_TRUE(engine.notes().back().synced);
}

TEST(CommitterTest, TellsWhatIsOnDiskBeforeItAcknowledgesASync) {
  NotingEngine engine;
  Acknowledgements heard;
  Committer committer(&engine, {.async_delay = kNever});
  for (int i = 0; i < 4; i += 2) {
    Committer::Write write = WriteOf(i == 0 ? Durability::kAsync : Durability::kSync, heard.Of(i));
    write.on_disk = heard.Of(i + 1);
    committer.Enqueue(std::move(write));
    heard.Await(i == 0 ? 1 : 4);
  }
  EXPECT_THAT(heard.AwaitSuccesses(4), ElementsAre(0, 1, 3, 2));
}

TEST(CommitterTest, FailsEveryWriteAfterOneThatFailed) {
  NotingEngine engine;
  Acknowledgements acknowledged;
  Committer committer(&engine, {.async_delay = kNever});
  engine.Answer(StoreFailed("injected"));
  committer.Enqueue(WriteOf(Durability::kSync, acknowledged.Of(0)));
  EXPECT_EQ(acknowledged.Await(1)[0].second.code(), absl::StatusCode::kUnavailable);
  engine.Answer(absl::OkStatus());
  committer.Enqueue(WriteOf(Durability::kAsync, acknowledged.Of(1)));
  committer.EnqueueBackground(WriteOf(Durability::kAsync, acknowledged.Of(2)));
  for (const auto& [id, status] : acknowledged.Await(3)) {
    EXPECT_EQ(ErrorReason(status), reason::kStoreFailed) << id;
    if (id > 0) {
      EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
    }
  }
  EXPECT_EQ(committer.AwaitRoom(), committer.status());
  EXPECT_EQ(ErrorReason(committer.status()), reason::kStoreFailed);
  EXPECT_EQ(engine.notes().size(), 1u) << "nothing is written after a failure";
}

TEST(CommitterTest, DoesNotWriteWhatIsRefusedAndAnswersItInItsTurn) {
  NotingEngine engine;
  Acknowledgements acknowledged;
  Committer committer(&engine, {.async_delay = kNever});
  engine.Hold();
  committer.Enqueue(WriteOf(Durability::kSync, acknowledged.Of(0)));
  engine.AwaitHeldWrite();
  committer.Enqueue(WriteOf(Durability::kAsync, acknowledged.Of(1)));
  Committer::Write refused = WriteOf(Durability::kSync, acknowledged.Of(2));
  refused.refusal = Fenced("part");
  committer.Enqueue(std::move(refused));
  committer.Enqueue(WriteOf(Durability::kAsync, acknowledged.Of(3)));
  engine.Release();
  EXPECT_THAT(acknowledged.Await(4), ElementsAre(Pair(0, absl::OkStatus()), Pair(1, absl::OkStatus()),
                                                 Pair(2, Fenced("part")), Pair(3, absl::OkStatus())));
  EXPECT_THAT(engine.notes(), ElementsAre(NotingEngine::Note{1, true}, NotingEngine::Note{2, false}));
}

TEST(CommitterTest, WritesTheBackgroundInPartsThatOthersOvertake) {
  NotingEngine engine;
  Acknowledgements acknowledged;
  Committer committer(&engine, {.async_delay = kNever, .background_round_bytes = 200});
  engine.Hold();
  for (int i = 0; i < 6; ++i) {
    committer.EnqueueBackground(WriteOf(Durability::kAsync, acknowledged.Of(i), 100));
    if (i == 0) engine.AwaitHeldWrite();
  }
  committer.Enqueue(WriteOf(Durability::kSync, acknowledged.Of(6)));
  engine.Release();
  EXPECT_THAT(acknowledged.AwaitSuccesses(7), ElementsAre(0, 6, 1, 2, 3, 4, 5));
}

TEST(CommitterTest, GivesRoomWhenLittleEnoughWaits) {
  NotingEngine engine;
  Acknowledgements acknowledged;
  Committer committer(&engine,
                      {.async_delay = kNever, .max_waiting_bytes = 250, .background_round_bytes = 1});
  engine.Hold();
  for (int i = 0; i < 6; ++i) {
    committer.EnqueueBackground(WriteOf(Durability::kAsync, acknowledged.Of(i), 100));
    if (i == 0) engine.AwaitHeldWrite();
  }
  std::thread editor([&] {
    EXPECT_TRUE(committer.AwaitRoom().ok());
    EXPECT_GE(engine.notes().size(), 3u) << "two of the five that waited may go on waiting";
  });
  engine.Release();
  editor.join();
}

TEST(CommitterTest, DrainsBothLanes) {
  NotingEngine engine;
  Acknowledgements acknowledged;
  Committer committer(&engine, {.async_delay = kNever, .background_round_bytes = 1});
  for (int i = 0; i < 20; i += 2) {
    committer.EnqueueBackground(WriteOf(Durability::kAsync, acknowledged.Of(i)));
    committer.Enqueue(WriteOf(Durability::kAsync, acknowledged.Of(i + 1)));
  }
  committer.Drain();
  EXPECT_EQ(acknowledged.Await(0).size(), 20u);
  committer.Drain();
  const size_t num_writes = engine.notes().size();
  committer.Drain();
  EXPECT_EQ(engine.notes().size(), num_writes) << "nothing new, nothing to sync";
}

TEST(CommitterTest, WritesAndSyncsWhatWaitsBeforeItEnds) {
  NotingEngine engine;
  Acknowledgements acknowledged;
  {
    Committer committer(&engine, {.async_delay = kNever, .background_round_bytes = 1});
    engine.Hold();
    committer.Enqueue(WriteOf(Durability::kAsync, acknowledged.Of(0)));
    engine.AwaitHeldWrite();
    for (int i = 1; i < 5; ++i) committer.EnqueueBackground(WriteOf(Durability::kAsync, acknowledged.Of(i)));
    engine.Release();
  }
  EXPECT_EQ(acknowledged.AwaitSuccesses(0).size(), 5u);
  EXPECT_TRUE(engine.notes().back().synced);
}

}  // namespace
}  // namespace dynmesh::testing
