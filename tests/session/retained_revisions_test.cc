#include "server/session/durability/retained_revisions.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <random>
#include <set>

#include "absl/strings/str_cat.h"
#include "core/mesh/error.h"

namespace dynmesh {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr RetainedRevisions::AnswersToKeep kNoAnswers = {0, 0};

absl::Time At(int64_t second) { return absl::FromUnixSeconds(second); }

/// Records of 10 bytes, revision r at second r.
void AddRecords(RetainedRevisions& retained, int64_t first, int64_t last) {
  for (int64_t revision = first; revision <= last; ++revision)
    retained.AddRecord({revision, 10, At(revision), /*has_answer=*/true});
}

/// From revision 0 to 100, with a checkpoint at each multiple of 10, whose pages are one revision later.
RetainedRevisions Hundred(const Retention& retention) {
  RetainedRevisions retained(retention);
  retained.Reset({{{1, 0, 0}}, {}, 0, {}});
  for (int64_t revision = 10; revision <= 100; revision += 10) {
    AddRecords(retained, revision - 9, revision);
    retained.AddCheckpoint({static_cast<uint64_t>(revision), revision, revision + 1});
  }
  AddRecords(retained, 101, 101);
  return retained;
}

TEST(RetainedRevisionsTest, ARevisionComesFromTheLastCheckpointThatIsNoLater) {
  const RetainedRevisions retained = Hundred({});
  EXPECT_EQ(retained.oldest(), 0);
  EXPECT_EQ(retained.FindSource(51)->checkpoint, 50u);
  EXPECT_EQ(retained.FindSource(51)->records.after, 50);
  EXPECT_EQ(retained.FindSource(51)->records.last, 51);
  EXPECT_EQ(retained.FindSource(50)->checkpoint, 40u) << "pages of checkpoint 50 are as late as 51";
  EXPECT_EQ(retained.FindSource(0)->checkpoint, 1u);
  EXPECT_EQ(ErrorReason(retained.FindSource(102).status()), reason::kRevisionInFuture);
}

TEST(RetainedRevisionsTest, WhatLiesBeforeTheCountIsSuperfluous) {
  RetainedRevisions retained = Hundred({.max_revisions = 30});
  const auto superfluous = retained.TakeSuperfluous(kNoAnswers, At(101));
  EXPECT_EQ(superfluous.records, 70) << "72 to 101 are wanted; 72 comes from checkpoint 70";
  EXPECT_EQ(retained.oldest(), 71);
  EXPECT_EQ(retained.FindSource(72)->checkpoint, 70u);
  EXPECT_EQ(retained.FindSource(71)->checkpoint, 70u);
  EXPECT_EQ(ErrorReason(retained.FindSource(70).status()), reason::kRevisionGone);
  EXPECT_THAT(superfluous.kept, IsEmpty());
}

TEST(RetainedRevisionsTest, SoIsWhatIsOlderOrOfMoreBytes) {
  RetainedRevisions by_age = Hundred({.max_age = absl::Seconds(30)});
  EXPECT_EQ(by_age.TakeSuperfluous(kNoAnswers, At(110)).records, 70) << "80 and later ones are 30 s old";
  RetainedRevisions by_bytes = Hundred({.max_bytes = 305});
  EXPECT_EQ(by_bytes.TakeSuperfluous(kNoAnswers, At(101)).records, 70);
  RetainedRevisions all_too_old = Hundred({.max_age = absl::Seconds(1)});
  EXPECT_EQ(all_too_old.TakeSuperfluous(kNoAnswers, At(1000)).records, 100);
  EXPECT_TRUE(all_too_old.FindSource(101).ok()) << "the last one can always be had";
}

TEST(RetainedRevisionsTest, RecordsStayForAnswers) {
  RetainedRevisions retained = Hundred({.max_revisions = 5});
  EXPECT_EQ(retained.TakeSuperfluous({50, 100000}, At(101)).records, 51);
  EXPECT_EQ(retained.TakeSuperfluous({50, 200}, At(101)).records, 81);
  EXPECT_EQ(retained.TakeSuperfluous(kNoAnswers, At(101)).records, 90);
}

TEST(RetainedRevisionsTest, OnlyRecordsWithAnswersCountAndTheLastOfThemStays) {
  RetainedRevisions retained({.max_revisions = 1});
  retained.Reset({{{1, 0, 0}}, {}, 0, {}});
  retained.AddRecord({1, 100, At(1), true});
  retained.AddRecord({2, 100, At(2), true});
  for (int64_t revision = 3; revision <= 50; ++revision) retained.AddRecord({revision, 100, At(revision)});
  retained.AddCheckpoint({2, 50, 50});
  EXPECT_EQ(retained.TakeSuperfluous({2, 1000}, At(50)).records, 0) << "edits without ids push nothing out";
  EXPECT_EQ(retained.TakeSuperfluous({1, 1000}, At(50)).records, 1);
  EXPECT_EQ(retained.TakeSuperfluous({1, 10}, At(50)).records, 1) << "be it as large as it may";
}

TEST(RetainedRevisionsTest, ASnapshotKeepsItsCheckpointAndRecords) {
  RetainedRevisions retained = Hundred({.max_revisions = 5});
  Snapshot snapshot;
  snapshot.name = "kept";
  snapshot.revision = 44;
  snapshot.checkpoint = 40;
  snapshot.checkpoint_revision = 40;
  retained.SetSnapshots({snapshot});
  const auto superfluous = retained.TakeSuperfluous(kNoAnswers, At(101));
  EXPECT_THAT(superfluous.checkpoints, ::testing::Not(::testing::Contains(40)));
  ASSERT_THAT(superfluous.kept, SizeIs(1));
  EXPECT_EQ(superfluous.kept[0].after, 40);
  EXPECT_EQ(superfluous.kept[0].last, 44);
  for (int64_t revision : {41, 44}) EXPECT_EQ(retained.FindSource(revision)->checkpoint, 40u) << revision;
  for (int64_t revision : {40, 45}) {
    EXPECT_EQ(ErrorReason(retained.FindSource(revision).status()), reason::kRevisionGone) << revision;
  }
  retained.SetSnapshots({});
  EXPECT_THAT(retained.TakeSuperfluous(kNoAnswers, At(101)).checkpoints, ElementsAre(40));
}

TEST(RetainedRevisionsTest, APinKeepsWhatIsBeingRead) {
  RetainedRevisions retained = Hundred({.max_revisions = 5});
  const RevisionSource source = *retained.FindSource(23);
  retained.Pin(source);
  retained.Pin(source);
  retained.Unpin(source);
  auto superfluous = retained.TakeSuperfluous(kNoAnswers, At(101));
  EXPECT_THAT(superfluous.checkpoints, ::testing::Not(::testing::Contains(20)));
  EXPECT_THAT(superfluous.kept, SizeIs(1));
  retained.Unpin(source);
  superfluous = retained.TakeSuperfluous(kNoAnswers, At(101));
  EXPECT_THAT(superfluous.checkpoints, ElementsAre(20));
  EXPECT_THAT(superfluous.kept, IsEmpty());
}

/// A store that does what it is told, and random work on it.
class ModelOfStore {
 public:
  explicit ModelOfStore(int seed) : random_(seed) { retained_.Reset({{{1, 0, 0}}, {}, 0, {}}); }

  void Step() {
    if (Below(10) == 0) MakeCheckpoint();
    if (Below(15) == 0) AddSnapshot();
    if (Below(20) == 0 && !snapshots_.empty()) {
      snapshots_.erase(snapshots_.begin() + Below(static_cast<uint32_t>(snapshots_.size())));
      retained_.SetSnapshots(snapshots_);
    }
    ++last_;
    const uint64_t bytes = 1 + Below(200);
    retained_.AddRecord({last_, bytes, At(last_)});
    records_[last_] = sizes_[last_] = bytes;
  }

  void Check() const {
    int64_t wanted = last_;
    uint64_t bytes = 0;
    for (int64_t revision = last_; revision > std::max<int64_t>(0, last_ - kRetention.max_revisions);
         --revision) {
      bytes += sizes_.at(revision);
      if (bytes > kRetention.max_bytes) break;
      wanted = revision;
    }
    ASSERT_LE(retained_.oldest(), wanted) << Dump();
    for (int64_t revision = retained_.oldest(); revision <= last_; ++revision) CheckSource(revision);
    for (const Snapshot& snapshot : snapshots_) CheckSource(snapshot.revision);
    EXPECT_LE(checkpoints_.size(), 11 + snapshots_.size()) << "those in between go";
  }

 private:
  std::string Dump() const {
    std::string text = absl::StrCat("last ", last_, " records from ", records_.begin()->first);
    for (const auto& [number, c] : checkpoints_)
      absl::StrAppend(&text, " C", number, "(", c.first, ",", c.second, ")");
    for (const auto& each : snapshots_) absl::StrAppend(&text, " S", each.revision, "@", each.checkpoint);
    return text;
  }

  static constexpr Retention kRetention = {.max_revisions = 60, .max_bytes = 4000};

  void MakeCheckpoint() {
    const int64_t head = last_ - Below(std::min<uint32_t>(4, static_cast<uint32_t>(last_ - last_head_) + 1));
    last_head_ = head;
    checkpoints_[++number_] = {head, last_};
    retained_.AddCheckpoint({number_, head, last_});
    const auto superfluous = retained_.TakeSuperfluous({20, 1000}, At(last_));
    for (uint64_t number : superfluous.checkpoints) ASSERT_EQ(checkpoints_.erase(number), 1u);
    std::erase_if(records_, [&](const auto& record) {
      return record.first <= superfluous.records &&
             std::none_of(superfluous.kept.begin(), superfluous.kept.end(), [&](const RecordRange& range) {
               return record.first > range.after && record.first <= range.last;
             });
    });
  }

  void AddSnapshot() {
    const int64_t revision = last_ - Below(static_cast<uint32_t>(last_ - retained_.oldest()) + 1);
    const RevisionSource source = *retained_.FindSource(revision);
    Snapshot snapshot;
    snapshot.name = absl::StrCat(++num_snapshots_);
    snapshot.revision = revision;
    snapshot.checkpoint = source.checkpoint;
    snapshot.checkpoint_revision = source.records.after;
    snapshots_.push_back(snapshot);
    retained_.SetSnapshots(snapshots_);
  }

  void CheckSource(int64_t revision) const {
    const absl::StatusOr<RevisionSource> source = retained_.FindSource(revision);
    ASSERT_TRUE(source.ok()) << source.status();
    const auto checkpoint = checkpoints_.find(source->checkpoint);
    ASSERT_NE(checkpoint, checkpoints_.end()) << revision;
    EXPECT_EQ(source->records.after, checkpoint->second.first);
    EXPECT_LE(checkpoint->second.second, revision) << "its pages are later";
    for (int64_t each = source->records.after + 1; each <= revision; ++each) {
      ASSERT_TRUE(records_.contains(each)) << each << " of " << revision;
    }
  }

  uint32_t Below(uint32_t end) { return random_() % end; }

  std::mt19937 random_;
  RetainedRevisions retained_{kRetention};
  std::map<uint64_t, std::pair<int64_t, int64_t>> checkpoints_ = {{1, {0, 0}}};
  std::map<int64_t, uint64_t> records_;
  std::map<int64_t, uint64_t> sizes_;  ///< of all records that there ever were
  std::vector<Snapshot> snapshots_;
  uint64_t number_ = 1;
  int num_snapshots_ = 0;
  int64_t last_ = 0;
  int64_t last_head_ = 0;
};

TEST(RetainedRevisionsTest, WhatIsWantedIsAlwaysThere) {
  for (int seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE(absl::StrCat("seed ", seed));
    ModelOfStore model(seed);
    for (int step = 0; step < 500; ++step) {
      model.Step();
      model.Check();
      if (::testing::Test::HasFatalFailure()) return;
    }
  }
}

TEST(SnapshotTest, AListIsReadAsItWasWritten) {
  std::vector<Snapshot> snapshots(2);
  snapshots[0] = {"a", 7, 3, 5, At(100), {"ann", "before the cut"}};
  snapshots[1].name = "b";
  snapshots[1].create_time = At(0);
  EXPECT_EQ(*DecodeSnapshots(EncodeSnapshots(snapshots)), snapshots);
  EXPECT_EQ(DecodeSnapshots(EncodeSnapshots({}))->size(), 0u);
}

TEST(SnapshotTest, BytesThatAreNoListAreRefused) {
  const std::string bytes = EncodeSnapshots({{"a", 7, 3, 5, At(100), {"ann", "message"}}});
  for (size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_EQ(DecodeSnapshots(absl::string_view(bytes).substr(0, size)).status().code(),
              absl::StatusCode::kDataLoss)
        << size;
  }
  EXPECT_EQ(DecodeSnapshots(bytes + "x").status().code(), absl::StatusCode::kDataLoss);
  std::string newer = bytes;
  newer[0] = 2;
  EXPECT_EQ(DecodeSnapshots(newer).status().code(), absl::StatusCode::kFailedPrecondition);
}

}  // namespace
}  // namespace dynmesh
