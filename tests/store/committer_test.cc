#include "server/store/committer.h"

#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <random>
#include <thread>

#include "absl/strings/str_cat.h"
#include "core/mesh/error.h"
#include "server/store/store_errors.h"
#include "tests/store/acknowledgements.h"

namespace dynmesh::testing {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::IsSupersetOf;
using ::testing::Pair;
using ::testing::UnorderedElementsAre;

constexpr absl::Duration kNever = absl::Hours(24);

// Holds up those who pass it, while told to.
class Gate {
 public:
  void Pass() {
    MutexLock lock(&mu_);
    ++num_waiting_;
    changed_.NotifyAll();
    while (closed_) changed_.Wait(&mu_);
    --num_waiting_;
  }
  void Close() {
    MutexLock lock(&mu_);
    closed_ = true;
  }
  void AwaitHeld() {
    MutexLock lock(&mu_);
    EXPECT_TRUE(AwaitThat(&mu_, changed_, [this] { return closed_ && num_waiting_ > 0; }));
  }
  void Open() {
    MutexLock lock(&mu_);
    closed_ = false;
    changed_.NotifyAll();
  }

 private:
  Mutex mu_;
  CondVar changed_;
  bool closed_ = false;
  int num_waiting_ = 0;
};

// Notes what is done to it. Before it answers, it passes a gate; a sync covers what was written before that,
// and what happens during one can be said.
class NotingEngine final : public Engine {
 public:
  absl::Status Write(const EngineBatch& batch) override {
    write_gate.Pass();
    EXPECT_EQ(num_writing_.fetch_add(1), 0) << "one at a time";
    MutexLock lock(&mu_);
    changes_.push_back(batch.changes().size());
    changed_.NotifyAll();
    --num_writing_;
    return write_result_;
  }
  absl::Status Sync() override {
    EXPECT_EQ(num_syncing_.fetch_add(1), 0) << "one at a time";
    const size_t covered = changes().size();
    if (during_sync != nullptr) during_sync();
    sync_gate.Pass();
    MutexLock lock(&mu_);
    covered_.push_back(covered);
    --num_syncing_;
    return sync_result_;
  }
  bool IsBehind() const override {
    MutexLock lock(&mu_);
    ++num_asked_;
    changed_.NotifyAll();
    return is_behind;
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

  void AnswerWrites(absl::Status result) {
    MutexLock lock(&mu_);
    write_result_ = std::move(result);
  }
  void AnswerSyncs(absl::Status result) {
    MutexLock lock(&mu_);
    sync_result_ = std::move(result);
  }
  void AwaitWrites(size_t count) {
    MutexLock lock(&mu_);
    EXPECT_TRUE(AwaitThat(&mu_, changed_, [&] { return changes_.size() >= count; }));
  }

  /// Until it was asked so often whether it is behind.
  void AwaitAsked(size_t count) {
    MutexLock lock(&mu_);
    EXPECT_TRUE(AwaitThat(&mu_, changed_, [&] { return num_asked_ >= count; }));
  }

  /// How many changes each write had.
  std::vector<size_t> changes() const {
    MutexLock lock(&mu_);
    return changes_;
  }
  /// How many writes each sync covers, those of the syncs before included.
  std::vector<size_t> covered() const {
    MutexLock lock(&mu_);
    return covered_;
  }

  std::atomic<bool> is_behind{false};
  std::function<void()> during_sync;
  Gate write_gate;
  Gate sync_gate;

 private:
  mutable Mutex mu_;
  mutable CondVar changed_;
  mutable size_t num_asked_ = 0;
  absl::Status write_result_;
  absl::Status sync_result_;
  std::vector<size_t> changes_;
  std::vector<size_t> covered_;
  std::atomic<int> num_writing_{0};
  std::atomic<int> num_syncing_{0};
};

Committer::Write WriteOf(Durability durability, SessionStore::Done done, size_t bytes = 1) {
  Committer::Write write;
  write.batch.Put("k", std::string(bytes - 1, 'x'));
  write.durability = durability;
  write.done = std::move(done);
  return write;
}

// Its acknowledgement is `id`, its on_disk `id` + kOnDisk.
constexpr int kOnDisk = 1000;

Committer::Write ToldWrite(Durability durability, Acknowledgements& heard, int id) {
  Committer::Write write = WriteOf(durability, heard.Of(id));
  write.on_disk = heard.Of(id + kOnDisk);
  return write;
}

std::vector<int> Ids(const Acknowledgements::List& list, const std::function<bool(int)>& pred) {
  std::vector<int> ids;
  for (const auto& [id, status] : list) {
    if (pred(id)) ids.push_back(id);
  }
  return ids;
}

absl::Status StatusOf(const Acknowledgements::List& list, int wanted) {
  for (const auto& [id, status] : list) {
    if (id == wanted) return status;
  }
  return absl::UnknownError("never told");
}

TEST(CommitterTest, WritesThatWaitShareOneBatchAndOneSync) {
  NotingEngine engine;
  Acknowledgements acknowledged;
  Committer committer(&engine, {.async_delay = kNever});
  engine.write_gate.Close();
  committer.Enqueue(WriteOf(Durability::kAsync, acknowledged.Of(0)));
  engine.write_gate.AwaitHeld();
  for (int i = 1; i < 65; ++i) committer.Enqueue(WriteOf(Durability::kSync, acknowledged.Of(i)));
  engine.write_gate.Open();
  EXPECT_EQ(acknowledged.AwaitSuccesses(65).size(), 65u);
  EXPECT_THAT(engine.changes(), ElementsAre(1, 64));
  EXPECT_THAT(engine.covered(), ElementsAre(2));
}

TEST(CommitterTest, AnAsyncWriteIsAcknowledgedWhileASyncHangs) {
  NotingEngine engine;
  Acknowledgements heard;
  Committer committer(&engine, {.async_delay = kNever});
  engine.sync_gate.Close();
  committer.Enqueue(ToldWrite(Durability::kSync, heard, 0));
  engine.sync_gate.AwaitHeld();
  for (int i = 1; i <= 3; ++i) {
    committer.Enqueue(ToldWrite(Durability::kAsync, heard, i));
    EXPECT_EQ(heard.AwaitSuccesses(i).back(), i);
  }
  engine.sync_gate.Open();
  EXPECT_THAT(heard.AwaitSuccesses(5), ElementsAre(1, 2, 3, kOnDisk, 0))
      << "the sync does not cover what was written after it began";
}

TEST(CommitterTest, AnAsyncWriteIsAcknowledgedWhileADelayedSyncHangs) {
  NotingEngine engine;
  Acknowledgements heard;
  Committer committer(&engine, {.async_delay = absl::Milliseconds(1)});
  engine.sync_gate.Close();
  committer.Enqueue(WriteOf(Durability::kAsync, heard.Of(0)));
  engine.sync_gate.AwaitHeld();
  committer.Enqueue(WriteOf(Durability::kAsync, heard.Of(1)));
  EXPECT_THAT(heard.AwaitSuccesses(2), ElementsAre(0, 1));
  engine.sync_gate.Open();
}

TEST(CommitterTest, ASyncWriteThatComesDuringASyncIsCoveredByTheNext) {
  NotingEngine engine;
  Acknowledgements heard;
  Committer committer(&engine, {.async_delay = kNever});
  engine.sync_gate.Close();
  committer.Enqueue(WriteOf(Durability::kSync, heard.Of(0)));
  engine.sync_gate.AwaitHeld();
  committer.Enqueue(WriteOf(Durability::kSync, heard.Of(1)));
  committer.Enqueue(WriteOf(Durability::kAsync, heard.Of(2)));
  EXPECT_THAT(heard.AwaitSuccesses(1), ElementsAre(2));
  engine.sync_gate.Open();
  EXPECT_THAT(heard.AwaitSuccesses(3), ElementsAre(2, 0, 1));
  EXPECT_THAT(engine.changes(), ElementsAre(1, 2));
  EXPECT_THAT(engine.covered(), ElementsAre(1, 2));
}

TEST(CommitterTest, SmallSyncWritesThatComeDuringASyncShareTheNextWriteAndSync) {
  NotingEngine engine;
  Acknowledgements acknowledged;
  Committer committer(&engine, {.async_delay = kNever});
  engine.sync_gate.Close();
  committer.Enqueue(WriteOf(Durability::kSync, acknowledged.Of(0)));
  engine.sync_gate.AwaitHeld();
  for (int i = 1; i <= 20; ++i) committer.Enqueue(WriteOf(Durability::kSync, acknowledged.Of(i)));
  engine.sync_gate.Open();
  EXPECT_EQ(acknowledged.AwaitSuccesses(21).size(), 21u);
  EXPECT_THAT(engine.changes(), ElementsAre(1, 20));
  EXPECT_THAT(engine.covered(), ElementsAre(1, 2));
}

TEST(CommitterTest, LargeSyncWritesAreWrittenWhileASyncRuns) {
  NotingEngine engine;
  Acknowledgements acknowledged;
  Committer committer(&engine, {.async_delay = kNever});
  engine.sync_gate.Close();
  committer.Enqueue(WriteOf(Durability::kSync, acknowledged.Of(0)));
  engine.sync_gate.AwaitHeld();
  committer.Enqueue(WriteOf(Durability::kSync, acknowledged.Of(1), size_t{1} << 20));
  engine.AwaitWrites(2);
  EXPECT_THAT(acknowledged.Await(0), IsEmpty());
  engine.sync_gate.Open();
  EXPECT_THAT(acknowledged.AwaitSuccesses(2), ElementsAre(0, 1));
  EXPECT_THAT(engine.covered(), ElementsAre(1, 2));
}

TEST(CommitterTest, ASyncWriteIsWrittenThoughThoseOfTheLastSyncDoNotComeBack) {
  NotingEngine engine;
  Acknowledgements acknowledged;
  Committer committer(&engine, {.async_delay = kNever});
  for (int i = 0; i < 100; i += 4) {
    engine.write_gate.Close();
    for (int j = 0; j < 3; ++j) committer.Enqueue(WriteOf(Durability::kSync, acknowledged.Of(i + j)));
    engine.write_gate.AwaitHeld();
    engine.write_gate.Open();
    acknowledged.Await(i + 3);
    committer.Enqueue(WriteOf(Durability::kSync, acknowledged.Of(i + 3)));
    EXPECT_EQ(acknowledged.AwaitSuccesses(i + 4).back(), i + 3);
  }
}

TEST(CommitterTest, AcknowledgesInTheOrderOfTheWritesOfTheSameDurability) {
  NotingEngine engine;
  Acknowledgements acknowledged;
  Committer committer(&engine, {.async_delay = kNever});
  std::vector<int> synced, others;
  for (int i = 0; i < 300; ++i) {
    const bool sync = i % 3 == 0;
    committer.Enqueue(WriteOf(sync ? Durability::kSync : Durability::kAsync, acknowledged.Of(i)));
    (sync ? synced : others).push_back(i);
  }
  EXPECT_EQ(Ids(acknowledged.Await(300), [](int id) { return id % 3 == 0; }), synced);
  EXPECT_EQ(Ids(acknowledged.Await(300), [](int id) { return id % 3 != 0; }), others);
}

TEST(CommitterTest, TellsWhatIsOnDiskInTheOrderOfTheWrites) {
  NotingEngine engine;
  Acknowledgements heard;
  {
    Committer committer(&engine, {.async_delay = absl::Microseconds(100)});
    for (int i = 0; i < 300; ++i) {
      committer.Enqueue(ToldWrite(i % 7 == 0 ? Durability::kSync : Durability::kAsync, heard, i));
    }
  }
  std::vector<int> order;
  for (int i = 0; i < 300; ++i) order.push_back(i + kOnDisk);
  EXPECT_EQ(Ids(heard.Await(0), [](int id) { return id >= kOnDisk; }), order);
}

TEST(CommitterTest, SyncsNothingBeforeItsTimeIfNobodyAsks) {
  NotingEngine engine;
  Acknowledgements acknowledged;
  {
    Committer committer(&engine, {.async_delay = kNever});
    committer.Enqueue(WriteOf(Durability::kAsync, acknowledged.Of(0)));
    acknowledged.Await(1);
    EXPECT_THAT(engine.covered(), IsEmpty());
  }
  EXPECT_THAT(engine.changes(), ElementsAre(1));
  EXPECT_THAT(engine.covered(), ElementsAre(1)) << "the end brings it to disk";
}

TEST(CommitterTest, SyncsAnAsyncWriteInItsTimeThoughNobodyAsks) {
  NotingEngine engine;
  Acknowledgements on_disk;
  Committer committer(&engine, {.async_delay = absl::Milliseconds(1)});
  Committer::Write write = WriteOf(Durability::kAsync, nullptr);
  write.on_disk = on_disk.Of(0);
  committer.Enqueue(std::move(write));
  EXPECT_THAT(on_disk.AwaitSuccesses(1), ElementsAre(0));
  EXPECT_THAT(engine.covered(), ElementsAre(1));
}

TEST(CommitterTest, SyncsAnAsyncWriteInItsTimeThoughALaterWriteHangs) {
  for (int i = 0; i < 10; ++i) {
    NotingEngine engine;
    Acknowledgements acknowledged, on_disk;
    Committer committer(&engine, {.async_delay = absl::Milliseconds(1)});
    Committer::Write write = WriteOf(Durability::kAsync, acknowledged.Of(0));
    write.on_disk = on_disk.Of(0);
    committer.Enqueue(std::move(write));
    acknowledged.Await(1);
    engine.write_gate.Close();
    committer.Enqueue(WriteOf(Durability::kAsync, acknowledged.Of(1)));
    engine.write_gate.AwaitHeld();
    EXPECT_THAT(on_disk.AwaitSuccesses(1), ElementsAre(0));
    engine.write_gate.Open();
  }
}

TEST(CommitterTest, TellsWhatIsOnDiskBeforeItAcknowledgesASync) {
  NotingEngine engine;
  Acknowledgements heard;
  Committer committer(&engine, {.async_delay = kNever});
  committer.Enqueue(ToldWrite(Durability::kAsync, heard, 0));
  heard.Await(1);
  committer.Enqueue(ToldWrite(Durability::kSync, heard, 1));
  EXPECT_THAT(heard.AwaitSuccesses(4), ElementsAre(0, kOnDisk, 1 + kOnDisk, 1));
}

TEST(CommitterTest, FailsEveryWriteAfterOneThatFailed) {
  NotingEngine engine;
  Acknowledgements acknowledged;
  Committer committer(&engine, {.async_delay = kNever});
  engine.AnswerWrites(StoreFailed("injected"));
  committer.Enqueue(WriteOf(Durability::kSync, acknowledged.Of(0)));
  EXPECT_EQ(acknowledged.Await(1)[0].second.code(), absl::StatusCode::kUnavailable);
  engine.AnswerWrites(absl::OkStatus());
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
  EXPECT_EQ(engine.changes().size(), 1u) << "nothing is written after a failure";
  EXPECT_THAT(engine.covered(), IsEmpty()) << "nor synced";
}

TEST(CommitterTest, AFailedWriteTakesWhatWasNotOnDisk) {
  NotingEngine engine;
  Acknowledgements heard;
  Committer committer(&engine, {.async_delay = kNever});
  committer.Enqueue(ToldWrite(Durability::kAsync, heard, 0));
  heard.Await(1);
  engine.AnswerWrites(StoreFailed("injected"));
  committer.Enqueue(ToldWrite(Durability::kAsync, heard, 1));
  EXPECT_THAT(heard.Await(4),
              ElementsAre(Pair(0, absl::OkStatus()), Pair(kOnDisk, StoreFailed("injected")),
                          Pair(1 + kOnDisk, StoreFailed("injected")), Pair(1, StoreFailed("injected"))));
  EXPECT_THAT(engine.covered(), IsEmpty());
}

TEST(CommitterTest, ASyncThatWasRunningWhenAWriteFailedHoldsForWhatItCovers) {
  NotingEngine engine;
  Acknowledgements heard;
  Committer committer(&engine, {.async_delay = kNever});
  engine.sync_gate.Close();
  committer.Enqueue(ToldWrite(Durability::kSync, heard, 0));
  engine.sync_gate.AwaitHeld();
  engine.AnswerWrites(StoreFailed("injected"));
  committer.Enqueue(ToldWrite(Durability::kSync, heard, 1));
  committer.Enqueue(WriteOf(Durability::kAsync, nullptr));
  engine.AwaitWrites(2);
  engine.sync_gate.Open();
  const auto list = heard.Await(4);
  EXPECT_EQ(StatusOf(list, 0), absl::OkStatus());
  EXPECT_EQ(StatusOf(list, kOnDisk), absl::OkStatus());
  EXPECT_EQ(StatusOf(list, 1), StoreFailed("injected"));
  EXPECT_EQ(StatusOf(list, 1 + kOnDisk), StoreFailed("injected"));
  EXPECT_THAT(engine.covered(), ElementsAre(1));
}

TEST(CommitterTest, AFailedSyncTakesWhatWasWrittenMeanwhile) {
  NotingEngine engine;
  Acknowledgements heard;
  {
    Committer committer(&engine, {.async_delay = kNever});
    engine.sync_gate.Close();
    committer.Enqueue(ToldWrite(Durability::kSync, heard, 0));
    engine.sync_gate.AwaitHeld();
    committer.Enqueue(ToldWrite(Durability::kSync, heard, 2));
    committer.Enqueue(ToldWrite(Durability::kAsync, heard, 1));
    EXPECT_THAT(heard.AwaitSuccesses(1), ElementsAre(1));
    engine.AnswerSyncs(StoreFailed("injected"));
    engine.sync_gate.Open();
    heard.Await(6);
    committer.Enqueue(ToldWrite(Durability::kAsync, heard, 3));
  }
  const auto list = heard.Await(0);
  EXPECT_EQ(list.size(), 8u) << "each exactly once";
  EXPECT_EQ(StatusOf(list, 1), absl::OkStatus());
  for (const int id : {0, 2, 3, kOnDisk, 1 + kOnDisk, 2 + kOnDisk, 3 + kOnDisk}) {
    EXPECT_EQ(ErrorReason(StatusOf(list, id)), reason::kStoreFailed) << id;
  }
  EXPECT_THAT(engine.changes(), ElementsAre(1, 2)) << "nothing is written after a failure";
  EXPECT_THAT(engine.covered(), ElementsAre(1)) << "nor synced";
}

TEST(CommitterTest, DoesNotWriteWhatIsRefusedAndAnswersItInItsTurn) {
  NotingEngine engine;
  Acknowledgements acknowledged;
  Committer committer(&engine, {.async_delay = kNever});
  engine.write_gate.Close();
  committer.Enqueue(WriteOf(Durability::kAsync, acknowledged.Of(0)));
  engine.write_gate.AwaitHeld();
  committer.Enqueue(WriteOf(Durability::kAsync, acknowledged.Of(1)));
  Committer::Write refused = WriteOf(Durability::kSync, acknowledged.Of(2));
  refused.refusal = Fenced("part");
  committer.Enqueue(std::move(refused));
  committer.Enqueue(WriteOf(Durability::kAsync, acknowledged.Of(3)));
  engine.write_gate.Open();
  EXPECT_THAT(acknowledged.Await(4), ElementsAre(Pair(0, absl::OkStatus()), Pair(1, absl::OkStatus()),
                                                 Pair(2, Fenced("part")), Pair(3, absl::OkStatus())));
  EXPECT_THAT(engine.changes(), ElementsAre(1, 2));
  EXPECT_THAT(engine.covered(), IsEmpty()) << "a refusal asks for no sync";
}

TEST(CommitterTest, ARefusalWaitsForTheSyncWritesBeforeIt) {
  NotingEngine engine;
  Acknowledgements heard;
  Committer committer(&engine, {.async_delay = kNever});
  engine.sync_gate.Close();
  committer.Enqueue(WriteOf(Durability::kSync, heard.Of(0)));
  engine.sync_gate.AwaitHeld();
  Committer::Write refused = ToldWrite(Durability::kSync, heard, 1);
  refused.refusal = Fenced("part");
  committer.Enqueue(std::move(refused));
  committer.Enqueue(WriteOf(Durability::kAsync, heard.Of(2)));
  EXPECT_THAT(heard.AwaitSuccesses(1), ElementsAre(2));
  engine.sync_gate.Open();
  EXPECT_THAT(heard.Await(3),
              ElementsAre(Pair(2, absl::OkStatus()), Pair(0, absl::OkStatus()), Pair(1, Fenced("part"))));
}

TEST(CommitterTest, WritesTheBackgroundInPartsThatOthersOvertake) {
  NotingEngine engine;
  Acknowledgements acknowledged;
  Committer committer(&engine, {.async_delay = kNever, .background_round_bytes = 200});
  engine.write_gate.Close();
  for (int i = 0; i < 6; ++i) {
    committer.EnqueueBackground(WriteOf(Durability::kAsync, acknowledged.Of(i), 100));
    if (i == 0) engine.write_gate.AwaitHeld();
  }
  committer.Enqueue(WriteOf(Durability::kAsync, acknowledged.Of(6)));
  engine.write_gate.Open();
  EXPECT_THAT(acknowledged.AwaitSuccesses(7), ElementsAre(0, 6, 1, 2, 3, 4, 5));
}

TEST(CommitterTest, TheBackgroundWaitsForASyncThatSomebodyWaitsFor) {
  NotingEngine engine;
  Acknowledgements heard;
  Committer committer(&engine, {.async_delay = kNever});
  engine.sync_gate.Close();
  committer.Enqueue(WriteOf(Durability::kSync, heard.Of(0)));
  engine.sync_gate.AwaitHeld();
  committer.EnqueueBackground(WriteOf(Durability::kAsync, heard.Of(1)));
  committer.Enqueue(WriteOf(Durability::kAsync, heard.Of(2)));
  EXPECT_THAT(heard.AwaitSuccesses(1), ElementsAre(2));
  engine.sync_gate.Open();
  EXPECT_THAT(heard.AwaitSuccesses(3), ElementsAre(2, 0, 1));
}

TEST(CommitterTest, TheBackgroundIsWrittenWhileASyncHangsThatNobodyWaitsFor) {
  NotingEngine engine;
  Acknowledgements heard;
  Committer committer(&engine, {.async_delay = absl::Milliseconds(1)});
  engine.sync_gate.Close();
  committer.Enqueue(WriteOf(Durability::kAsync, heard.Of(0)));
  engine.sync_gate.AwaitHeld();
  committer.EnqueueBackground(WriteOf(Durability::kAsync, heard.Of(1)));
  EXPECT_THAT(heard.AwaitSuccesses(2), ElementsAre(0, 1));
  engine.sync_gate.Open();
}

// Syncs without a gap between them, because each finds that the next one is wanted already. Of two markers
// the second is written after the round of the large write was handed over.
TEST(CommitterTest, TheBackgroundIsWrittenThoughEachSyncFindsTheNextOneWanted) {
  NotingEngine engine;
  Acknowledgements heard;
  constexpr int kSyncs = 8, kBackground = 100;
  std::atomic<int> num_syncs{0};
  Committer committer(&engine, {.async_delay = kNever});
  engine.during_sync = [&] {
    const int sync = ++num_syncs;
    if (sync == 1) committer.EnqueueBackground(WriteOf(Durability::kAsync, heard.Of(kBackground)));
    if (sync >= kSyncs) return;
    committer.Enqueue(WriteOf(Durability::kSync, nullptr, size_t{1} << 20));
    for (int i = 0; i < 2; ++i) {
      AwaitedWrite marker({}, Durability::kAsync);
      committer.Enqueue(std::move(marker.write));
      EXPECT_TRUE(marker.Wait().ok());
    }
    heard.Of(sync)(absl::OkStatus());
  };
  committer.Enqueue(WriteOf(Durability::kSync, nullptr));
  std::vector<int> order = heard.AwaitSuccesses(kSyncs);
  ASSERT_EQ(order.size(), size_t{kSyncs});
  order.resize(3);
  EXPECT_THAT(order, Contains(kBackground)) << "the third sync lets it pass at the latest";
}

TEST(CommitterTest, OnlyTheBackgroundWaitsWhileTheEngineIsBehind) {
  NotingEngine engine;
  Acknowledgements heard;
  Committer committer(&engine, {.async_delay = kNever});
  engine.is_behind = true;
  committer.EnqueueBackground(WriteOf(Durability::kAsync, heard.Of(0)));
  for (int i = 1; i <= 3; ++i) {
    committer.Enqueue(WriteOf(Durability::kAsync, heard.Of(i)));
    heard.Await(i);
  }
  EXPECT_THAT(heard.AwaitSuccesses(3), ElementsAre(1, 2, 3));
  engine.is_behind = false;
  EXPECT_THAT(heard.AwaitSuccesses(4), ElementsAre(1, 2, 3, 0));
}

// What is taken along with others before its time leaves nobody who would wake at that time: one thread is
// held in a sync that nobody awaits, the other has no reason to look again.
TEST(CommitterTest, TheBackgroundIsWrittenThoughTheEngineCaughtUpEarly) {
  for (int i = 0; i < 50 && !HasFailure(); ++i) {
    NotingEngine engine;
    Acknowledgements heard;
    Committer committer(&engine, {.async_delay = absl::Microseconds(1)});
    engine.sync_gate.Close();
    committer.Enqueue(WriteOf(Durability::kAsync, heard.Of(0)));
    engine.sync_gate.AwaitHeld();
    engine.is_behind = true;
    committer.EnqueueBackground(WriteOf(Durability::kAsync, heard.Of(1)));
    engine.AwaitAsked(1);
    engine.is_behind = false;
    committer.Enqueue(WriteOf(Durability::kAsync, heard.Of(2)));
    EXPECT_THAT(heard.AwaitSuccesses(3), UnorderedElementsAre(0, 1, 2));
    committer.EnqueueBackground(WriteOf(Durability::kAsync, heard.Of(3)));
    EXPECT_EQ(heard.AwaitSuccesses(4).size(), 4u);
    engine.sync_gate.Open();
  }
}

TEST(CommitterTest, EndsAlthoughTheEngineIsBehind) {
  NotingEngine engine;
  engine.is_behind = true;
  Acknowledgements heard;
  {
    Committer committer(&engine, {.async_delay = kNever});
    committer.EnqueueBackground(ToldWrite(Durability::kAsync, heard, 0));
  }
  EXPECT_THAT(heard.AwaitSuccesses(0), ElementsAre(0, kOnDisk));
}

TEST(CommitterTest, GivesRoomWhenLittleEnoughWaits) {
  NotingEngine engine;
  Committer committer(&engine,
                      {.async_delay = kNever, .max_waiting_bytes = 250, .background_round_bytes = 1});
  engine.write_gate.Close();
  for (int i = 0; i < 6; ++i) {
    committer.EnqueueBackground(WriteOf(Durability::kAsync, nullptr, 100));
    if (i == 0) engine.write_gate.AwaitHeld();
  }
  std::thread editor([&] {
    EXPECT_TRUE(committer.AwaitRoom().ok());
    EXPECT_GE(engine.changes().size(), 3u) << "two of the five that waited may go on waiting";
  });
  engine.write_gate.Open();
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
  const size_t num_syncs = engine.covered().size();
  committer.Drain();
  EXPECT_EQ(engine.covered().size(), num_syncs) << "nothing new, nothing to sync";
}

TEST(CommitterTest, WhatIsDrainedIsOnDisk) {
  NotingEngine engine;
  Acknowledgements heard;
  Committer committer(&engine, {.async_delay = kNever, .background_round_bytes = 1});
  for (int i = 0; i < 30; i += 3) {
    for (int j = 0; j < 2; ++j) committer.EnqueueBackground(ToldWrite(Durability::kAsync, heard, i + j));
    committer.Enqueue(ToldWrite(Durability::kAsync, heard, i + 2));
    committer.Drain();
    const std::vector<int> told = heard.AwaitSuccesses(0);
    EXPECT_THAT(told, IsSupersetOf({i + kOnDisk, i + 1 + kOnDisk, i + 2 + kOnDisk}));
  }
}

TEST(CommitterTest, WritesAndSyncsWhatWaitsBeforeItEnds) {
  NotingEngine engine;
  Acknowledgements acknowledged;
  {
    Committer committer(&engine, {.async_delay = kNever, .background_round_bytes = 1});
    engine.write_gate.Close();
    committer.Enqueue(WriteOf(Durability::kAsync, acknowledged.Of(0)));
    engine.write_gate.AwaitHeld();
    for (int i = 1; i < 5; ++i) committer.EnqueueBackground(WriteOf(Durability::kAsync, acknowledged.Of(i)));
    engine.write_gate.Open();
  }
  EXPECT_EQ(acknowledged.AwaitSuccesses(0).size(), 5u);
  EXPECT_THAT(engine.covered(), ElementsAre(5));
}

TEST(CommitterTest, EndsWhileASyncRunsWithAllWrittenAndSynced) {
  NotingEngine engine;
  Acknowledgements heard;
  auto committer = std::make_unique<Committer>(&engine, CommitterOptions{.async_delay = kNever});
  engine.sync_gate.Close();
  committer->Enqueue(ToldWrite(Durability::kSync, heard, 0));
  engine.sync_gate.AwaitHeld();
  committer->Enqueue(ToldWrite(Durability::kAsync, heard, 1));
  std::thread end([&] { committer.reset(); });
  heard.Await(1);
  engine.sync_gate.Open();
  end.join();
  EXPECT_THAT(heard.AwaitSuccesses(0), UnorderedElementsAre(0, 1, kOnDisk, 1 + kOnDisk));
  EXPECT_THAT(engine.covered(), ElementsAre(1, 2));
}

TEST(CommitterTest, TellsWhatNeededNoDiskToo) {
  NotingEngine engine;
  Acknowledgements heard;
  {
    Committer committer(&engine, {.async_delay = kNever});
    Committer::Write empty = ToldWrite(Durability::kAsync, heard, 0);
    empty.batch = EngineBatch();
    committer.Enqueue(std::move(empty));
  }
  EXPECT_THAT(heard.AwaitSuccesses(0), ElementsAre(0, kOnDisk));
  EXPECT_THAT(engine.covered(), IsEmpty());
}

// Editors, pages and drains at once, with syncs that become due all the time: each write is told each thing
// exactly once, whatever fails in between.
TEST(CommitterTest, TellsEverythingExactlyOnceWhateverHappens) {
  for (uint32_t seed = 0; seed < 40; ++seed) {
    SCOPED_TRACE(absl::StrCat("seed ", seed));
    NotingEngine engine;
    Acknowledgements heard;
    constexpr int kEditors = 3, kWrites = 60;
    {
      Committer committer(&engine, {.async_delay = absl::Microseconds(50), .background_round_bytes = 3});
      std::vector<std::thread> editors;
      for (int editor = 0; editor < kEditors; ++editor) {
        editors.emplace_back([&, editor] {
          std::mt19937 random(seed * kEditors + editor);
          for (int i = 0; i < kWrites; ++i) {
            const Durability durability = random() % 3 == 0 ? Durability::kSync : Durability::kAsync;
            Committer::Write write = ToldWrite(durability, heard, editor * kWrites + i);
            if (random() % 4 == 0) {
              committer.EnqueueBackground(std::move(write));
            } else {
              committer.Enqueue(std::move(write));
            }
            if (random() % 20 == 0) committer.Drain();
            if (seed % 4 == 1 && random() % 50 == 0) engine.AnswerWrites(StoreFailed("injected"));
            if (seed % 4 == 2 && random() % 50 == 0) engine.AnswerSyncs(StoreFailed("injected"));
          }
        });
      }
      for (std::thread& editor : editors) editor.join();
    }
    std::map<int, int> times;
    bool failed = false;
    for (const auto& [id, status] : heard.Await(0)) {
      ++times[id];
      if (id >= kOnDisk) {
        EXPECT_FALSE(failed && status.ok()) << id << " is on disk after something before it was not";
        failed |= !status.ok();
      }
    }
    EXPECT_EQ(times.size(), 2u * kEditors * kWrites);
    for (const auto& [id, count] : times) EXPECT_EQ(count, 1) << id;
    if (seed % 4 == 0 || seed % 4 == 3) {
      EXPECT_FALSE(failed);
    }
  }
}

}  // namespace
}  // namespace dynmesh::testing
