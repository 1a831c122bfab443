// What every store must do, whatever it is on.

#include <gtest/gtest.h>

#include "core/mesh/error.h"
#include "server/store/store_errors.h"
#include "tests/store/acknowledgements.h"
#include "tests/store/contents.h"
#include "tests/store/store_rig.h"

namespace dynmesh::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::Pair;

class ConformanceTest : public ::testing::TestWithParam<std::pair<const char*, RigMaker>> {
 protected:
  void SetUp() override { Reopen(); }

  void Reopen() {
    session_.reset();
    store_.reset();
    absl::StatusOr<std::unique_ptr<Store>> store = rig_->Open();
    ASSERT_TRUE(store.ok()) << store.status();
    store_ = *std::move(store);
  }

  SessionStore& Create(const std::string& name) {
    EXPECT_EQ(store_->CreateSession(name), absl::OkStatus());
    return OpenNamed(name);
  }
  SessionStore& OpenNamed(const std::string& name) {
    auto session = store_->OpenSession(name);
    EXPECT_EQ(session.status(), absl::OkStatus());
    session_ = *std::move(session);
    return *session_;
  }
  SessionStore& ReopenNamed(const std::string& name) {
    Reopen();
    return OpenNamed(name);
  }

  const std::unique_ptr<StoreRig> rig_ = GetParam().second();
  std::unique_ptr<Store> store_;
  std::unique_ptr<SessionStore> session_;
};

void Commit(SessionStore& session, int64_t revision, const std::map<PageKey, std::string>& pages) {
  auto writer = session.BeginCheckpoint(revision);
  ASSERT_EQ(writer.status(), absl::OkStatus());
  for (const auto& [page, bytes] : pages) EXPECT_EQ((*writer)->WritePage(page, bytes), absl::OkStatus());
  EXPECT_EQ((*writer)->Commit("manifest"), absl::OkStatus());
}

TEST_P(ConformanceTest, AnAppendedRecordIsReadAgain) {
  SessionStore& session = Create("part");
  EXPECT_EQ(AppendNow(session, 1, "one", Durability::kSync), absl::OkStatus());
  EXPECT_EQ(AppendNow(session, 2, std::string("t\0o", 3), Durability::kAsync), absl::OkStatus());
  EXPECT_EQ(AppendNow(session, 7, "", Durability::kSync), absl::OkStatus());
  const Records expected = {{1, "one"}, {2, std::string("t\0o", 3)}, {7, ""}};
  EXPECT_EQ(RecordsAfter(session, 0), expected);
  SessionStore& again = ReopenNamed("part");
  EXPECT_EQ(RecordsAfter(again, 0), expected);
  EXPECT_EQ(again.last_revision(), 7);
  EXPECT_EQ(again.durable_revision(), 7);
}

TEST_P(ConformanceTest, ReadingBeginsAfterARevision) {
  SessionStore& session = Create("part");
  for (int64_t revision : {1, 2, 300, 301}) EXPECT_TRUE(AppendNow(session, revision, "x").ok());
  EXPECT_THAT(RecordsAfter(session, 2), ElementsAre(Pair(300, "x"), Pair(301, "x")));
  EXPECT_EQ(RecordsAfter(session, 150), RecordsAfter(session, 2)) << "300 says what changed since 2";
  EXPECT_THAT(RecordsAfter(session, INT64_MAX), IsEmpty());
  EXPECT_EQ(RecordsAfter(session, -5).size(), 4u);
}

TEST_P(ConformanceTest, TheReadersErrorEndsReading) {
  SessionStore& session = Create("part");
  for (int64_t revision = 1; revision <= 3; ++revision) EXPECT_TRUE(AppendNow(session, revision, "x").ok());
  int calls = 0;
  const absl::Status status = session.ReadRecords(0, [&](int64_t revision, absl::string_view) {
    ++calls;
    return revision < 2 ? absl::OkStatus() : absl::CancelledError("enough");
  });
  EXPECT_EQ(status, absl::CancelledError("enough"));
  EXPECT_EQ(calls, 2);
}

TEST_P(ConformanceTest, ARevisionThatIsNotLaterIsRefused) {
  SessionStore& session = Create("part");
  EXPECT_TRUE(AppendNow(session, 5, "x").ok());
  for (int64_t revision : {INT64_MIN, int64_t{0}, int64_t{4}, int64_t{5}}) {
    EXPECT_EQ(ErrorReason(AppendNow(session, revision, "y")), reason::kBadArgument) << revision;
  }
  EXPECT_TRUE(AppendNow(session, 6, "z").ok()) << "a refusal is no failure";
  EXPECT_THAT(RecordsAfter(session, 0), ElementsAre(Pair(5, "x"), Pair(6, "z")));
}

TEST_P(ConformanceTest, SessionsAreListedByNameAndKeptApart) {
  for (const std::string name : {"b", "a", "c c", "a/b"}) {
    EXPECT_TRUE(AppendNow(Create(name), 1, "of " + name).ok());
  }
  EXPECT_EQ(ErrorReason(store_->CreateSession("a")), reason::kSessionExists);
  EXPECT_EQ(ErrorReason(store_->CreateSession("")), reason::kBadSessionName);
  EXPECT_EQ(ErrorReason(store_->CreateSession(std::string(kMaxNameBytes + 1, 'n'))), reason::kBadSessionName);
  Reopen();
  EXPECT_THAT(store_->ListSessions(), ElementsAre("a", "a/b", "b", "c c"));
  for (const std::string& name : store_->ListSessions()) {
    EXPECT_THAT(RecordsAfter(OpenNamed(name), 0), ElementsAre(Pair(1, "of " + name)));
  }
}

TEST_P(ConformanceTest, ADeletedSessionLeavesNothing) {
  SessionStore& session = Create("part");
  EXPECT_TRUE(AppendNow(session, 1, "old").ok());
  Commit(session, 1, {{4, "old"}});
  EXPECT_TRUE(session.PutValue("v", "old").ok());
  EXPECT_TRUE(store_->DeleteSession("part").ok());
  EXPECT_EQ(ErrorReason(AppendNow(session, 2, "late")), reason::kSessionDeleted);
  EXPECT_EQ(ErrorReason(store_->DeleteSession("part")), reason::kSessionNotFound);
  EXPECT_EQ(ErrorReason(store_->OpenSession("part").status()), reason::kSessionNotFound);
  EXPECT_THAT(store_->ListSessions(), IsEmpty());
  EXPECT_EQ(ContentsOf(Create("part")), SessionContents());
  EXPECT_EQ(ContentsOf(ReopenNamed("part")), SessionContents());
}

TEST_P(ConformanceTest, ANewOwnerFencesTheFormer) {
  Create("part");
  const std::unique_ptr<SessionStore> former = std::move(session_);
  EXPECT_TRUE(AppendNow(*former, 1, "x", Durability::kAsync).ok());
  const auto writer = former->BeginCheckpoint(1);
  EXPECT_TRUE((*writer)->WritePage(1, "never").ok());
  SessionStore& owner = OpenNamed("part");
  EXPECT_GT(owner.fencing_token(), former->fencing_token());
  EXPECT_EQ(owner.last_revision(), 1);
  EXPECT_EQ(AppendNow(*former, 2, "y").code(), absl::StatusCode::kAborted);
  EXPECT_EQ(ErrorReason(former->PutValue("v", "y")), reason::kFenced);
  EXPECT_EQ(ErrorReason((*writer)->Commit("m")), reason::kFenced);
  EXPECT_TRUE(AppendNow(owner, 2, "z").ok());
  Commit(owner, 2, {{2, "mine"}});
  EXPECT_THAT(ContentsOf(owner).pages, ElementsAre(Pair(2, "mine")));
}

TEST_P(ConformanceTest, ANewOwnerFindsOnDiskWhatTheFormerAppended) {
  EXPECT_TRUE(AppendNow(Create("part"), 1, "x", Durability::kAsync).ok());
  EXPECT_EQ(session_->durable_revision(), 0);
  EXPECT_EQ(OpenNamed("part").durable_revision(), 1);
  rig_->faults().Set(Fault::kFailedSync);  // of the store's end
  session_.reset();
  store_.reset();
  rig_->LosePower();
  rig_->faults().Set(Fault::kNone);
  EXPECT_THAT(RecordsAfter(ReopenNamed("part"), 0), ElementsAre(Pair(1, "x")));
}

TEST_P(ConformanceTest, ACheckpointKeepsThePagesThatItDoesNotMention) {
  SessionStore& session = Create("part");
  Commit(session, 3, {{1, "a"}, {2, "b"}, {UINT64_MAX, "c"}});
  auto writer = session.BeginCheckpoint(4);
  EXPECT_TRUE((*writer)->WritePage(2, "B").ok());
  EXPECT_TRUE((*writer)->WritePage(2, "BB").ok());
  EXPECT_TRUE((*writer)->DropPage(UINT64_MAX).ok());
  EXPECT_TRUE((*writer)->WritePage(9, "never").ok());
  EXPECT_TRUE((*writer)->DropPage(9).ok());
  EXPECT_TRUE((*writer)->DropPage(10).ok());
  EXPECT_TRUE((*writer)->Commit("second").ok());
  writer->reset();
  const SessionContents expected{4, "second", {{1, "a"}, {2, "BB"}}, {}};
  EXPECT_EQ(ContentsOf(session), expected);
  SessionStore& again = ReopenNamed("part");
  EXPECT_EQ(ContentsOf(again), expected);
  EXPECT_EQ(again.last_revision(), 4);
  Commit(again, 4, {{1, ""}});
  EXPECT_THAT(ContentsOf(again).pages, ElementsAre(Pair(1, ""), Pair(2, "BB")));
}

TEST_P(ConformanceTest, AnAbandonedCheckpointLeavesNothing) {
  SessionStore& session = Create("part");
  Commit(session, 1, {{1, "a"}, {2, "b"}});
  const SessionContents before = ContentsOf(session);
  {
    const auto writer = session.BeginCheckpoint(2);
    EXPECT_TRUE((*writer)->WritePage(1, "A").ok());
    EXPECT_TRUE((*writer)->DropPage(2).ok());
    EXPECT_EQ(ErrorReason(session.BeginCheckpoint(2).status()), reason::kCheckpointOpen);
  }
  EXPECT_EQ(ContentsOf(session), before);
  EXPECT_EQ(ContentsOf(ReopenNamed("part")), before);
}

TEST_P(ConformanceTest, ACheckpointThatACrashCutShortLeavesNothing) {
  SessionStore& session = Create("part");
  Commit(session, 1, {{1, "a"}, {2, "b"}});
  const SessionContents before = ContentsOf(session);
  auto writer = session.BeginCheckpoint(2);
  EXPECT_TRUE((*writer)->WritePage(1, "A").ok());
  EXPECT_TRUE((*writer)->WritePage(3, "C").ok());
  store_->OpenSession("part").IgnoreError();  // fences the writer, so it cannot tidy up
  writer->reset();
  SessionStore& again = ReopenNamed("part");
  EXPECT_EQ(ContentsOf(again), before);
  Commit(again, 2, {{2, "B"}});
  EXPECT_THAT(ContentsOf(again).pages, ElementsAre(Pair(1, "a"), Pair(2, "B")));
  EXPECT_THAT(ContentsOf(ReopenNamed("part")).pages, ElementsAre(Pair(1, "a"), Pair(2, "B")));
}

TEST_P(ConformanceTest, AppendsGoOnDuringACheckpoint) {
  SessionStore& session = Create("part");
  EXPECT_TRUE(AppendNow(session, 1, "x").ok());
  auto writer = session.BeginCheckpoint(1);
  for (int i = 0; i < 40; ++i) {
    EXPECT_TRUE((*writer)->WritePage(i, std::string(100000, 'p')).ok());
    EXPECT_TRUE(AppendNow(session, i + 2, "y", Durability::kAsync).ok());
  }
  EXPECT_TRUE((*writer)->Commit("m").ok());
  writer->reset();
  EXPECT_TRUE(session.TrimRecords(1).ok());
  SessionStore& again = ReopenNamed("part");
  EXPECT_EQ(ContentsOf(again).pages.size(), 40u);
  EXPECT_EQ(RecordsAfter(again, 1).size(), 40u);
}

TEST_P(ConformanceTest, TrimmedRecordsAreGone) {
  SessionStore& session = Create("part");
  for (int64_t revision = 1; revision <= 6; ++revision) EXPECT_TRUE(AppendNow(session, revision, "x").ok());
  EXPECT_EQ(ErrorReason(session.TrimRecords(1)), reason::kBadArgument) << "no checkpoint holds it";
  Commit(session, 4, {});
  EXPECT_TRUE(session.TrimRecords(3).ok());
  const auto check = [](SessionStore& each) {
    EXPECT_EQ(each.ReadRecords(2, [](int64_t, absl::string_view) { return absl::OkStatus(); }).code(),
              absl::StatusCode::kOutOfRange);
    EXPECT_THAT(RecordsAfter(each, 3), ElementsAre(Pair(4, "x"), Pair(5, "x"), Pair(6, "x")));
  };
  check(OpenNamed("part"));
  check(ReopenNamed("part"));
}

std::vector<int64_t> RevisionsOf(const Records& records) {
  std::vector<int64_t> revisions;
  for (const auto& [revision, bytes] : records) revisions.push_back(revision);
  return revisions;
}

TEST_P(ConformanceTest, RecordsThatAreKeptOutliveTrimming) {
  SessionStore& session = Create("part");
  for (int64_t revision = 1; revision <= 9; ++revision) EXPECT_TRUE(AppendNow(session, revision, "x").ok());
  Commit(session, 8, {});
  const RecordRange kept[] = {{5, 6}, {1, 3}, {2, 3}, {7, 20}};
  EXPECT_TRUE(session.TrimRecords(8, kept).ok());
  const auto read = [](SessionStore& each, RecordRange range) {
    Records records;
    EXPECT_TRUE(each.ReadRecords(range,
                                 [&](int64_t revision, absl::string_view bytes) {
                                   records.emplace_back(revision, bytes);
                                   return absl::OkStatus();
                                 })
                    .ok());
    return RevisionsOf(records);
  };
  SessionStore& again = ReopenNamed("part");
  EXPECT_THAT(read(again, {1, 3}), ElementsAre(2, 3));
  EXPECT_THAT(read(again, {5, 6}), ElementsAre(6));
  EXPECT_THAT(read(again, {7, INT64_MAX}), ElementsAre(8, 9));
  const auto ignore = [](int64_t, absl::string_view) { return absl::OkStatus(); };
  for (const RecordRange gone : {RecordRange{0, 1}, {0, 4}, {3, 5}, {1, 9}, {6, 7}}) {
    EXPECT_EQ(ErrorReason(again.ReadRecords(gone, ignore)), reason::kStoreTrimmed) << gone.after;
  }
  EXPECT_TRUE(session_->TrimRecords(8).ok());
  EXPECT_THAT(RevisionsOf(RecordsAfter(ReopenNamed("part"), 8)), ElementsAre(9));
  EXPECT_EQ(ErrorReason(session_->ReadRecords({1, 3}, ignore)), reason::kStoreTrimmed);
}

void CommitKeeping(SessionStore& session, int64_t revision, const std::map<PageKey, std::string>& pages,
                   absl::Span<const PageKey> dropped = {}) {
  auto writer = session.BeginCheckpoint(revision);
  ASSERT_EQ(writer.status(), absl::OkStatus());
  for (const auto& [page, bytes] : pages) EXPECT_EQ((*writer)->WritePage(page, bytes), absl::OkStatus());
  for (const PageKey page : dropped) EXPECT_EQ((*writer)->DropPage(page), absl::OkStatus());
  EXPECT_EQ((*writer)->Commit(absl::StrCat("of ", revision), FormerCheckpoint::kKeep), absl::OkStatus());
}

TEST_P(ConformanceTest, AFormerCheckpointIsReadUntilItIsDropped) {
  SessionStore& session = Create("part");
  CommitKeeping(session, 1, {{1, "a"}, {2, "b"}, {3, "c"}});
  CommitKeeping(session, 2, {{1, "A"}, {4, "d"}}, {{3}});
  CommitKeeping(session, 3, {{3, "C"}}, {{4, 2}});
  const std::vector<CheckpointContents> all = {{1, "of 1", {{1, "a"}, {2, "b"}, {3, "c"}}},
                                               {2, "of 2", {{1, "A"}, {2, "b"}, {4, "d"}}},
                                               {3, "of 3", {{1, "A"}, {3, "C"}}}};
  SessionContents expected{3, "of 3", all[2].pages, {}, {all[0], all[1]}};
  EXPECT_EQ(ContentsOf(session), expected);
  SessionStore& again = ReopenNamed("part");
  EXPECT_EQ(ContentsOf(again), expected);
  const std::vector<Checkpoint> checkpoints = again.ListCheckpoints().value();
  EXPECT_TRUE(again.DropCheckpoint(checkpoints[0].number).ok());
  expected.former = {all[1]};
  EXPECT_EQ(ContentsOf(again), expected);
  EXPECT_EQ(ErrorReason(again.DropCheckpoint(checkpoints[0].number)), reason::kCheckpointNotFound);
  EXPECT_EQ(ErrorReason(again.DropCheckpoint(checkpoints[2].number)), reason::kCheckpointNotFound)
      << "the last";
  for (const uint64_t number : {uint64_t{0}, checkpoints[0].number, checkpoints[2].number + 1, UINT64_MAX}) {
    const auto none =
        again.ReadCheckpoint(number, [](PageKey, absl::string_view) { return absl::OkStatus(); });
    EXPECT_EQ(ErrorReason(none.status()), reason::kCheckpointNotFound) << number;
  }
  SessionStore& later = ReopenNamed("part");
  EXPECT_EQ(ContentsOf(later), expected);
  Commit(later, 4, {{9, "i"}});
  EXPECT_EQ(ContentsOf(later),
            (SessionContents{4, "manifest", {{1, "A"}, {3, "C"}, {9, "i"}}, {}, {all[1]}}));
}

TEST_P(ConformanceTest, NoCheckpointIsDroppedWhileOneIsMade) {
  SessionStore& session = Create("part");
  CommitKeeping(session, 1, {{1, "a"}});
  CommitKeeping(session, 2, {{1, "A"}});
  const uint64_t first = session.ListCheckpoints().value().front().number;
  const auto writer = session.BeginCheckpoint(2);
  EXPECT_EQ(ErrorReason(session.DropCheckpoint(first)), reason::kCheckpointOpen);
}

TEST_P(ConformanceTest, ACheckpointBeyondTheRecordsReplacesThem) {
  SessionStore& session = Create("part");
  EXPECT_TRUE(AppendNow(session, 1, "x").ok());
  Commit(session, 10, {{1, "p"}});
  EXPECT_EQ(session.last_revision(), 10);
  EXPECT_EQ(session.durable_revision(), 10);
  EXPECT_TRUE(AppendNow(session, 11, "y").ok());
  SessionStore& again = ReopenNamed("part");
  EXPECT_EQ(ContentsOf(again), (SessionContents{10, "manifest", {{1, "p"}}, {{11, "y"}}}));
  EXPECT_EQ(ErrorReason(again.BeginCheckpoint(9).status()), reason::kBadArgument);
  Commit(again, 11, {});
}

TEST_P(ConformanceTest, ValuesAreKeptByName) {
  SessionStore& session = Create("part");
  EXPECT_EQ(*session.GetValue("settings"), absl::nullopt);
  EXPECT_TRUE(session.PutValue("settings", "one").ok());
  EXPECT_TRUE(session.PutValue("settings", "two").ok());
  EXPECT_TRUE(session.PutValue("", "empty name").ok());
  EXPECT_TRUE(session.PutValue("gone", "x").ok());
  EXPECT_TRUE(session.DeleteValue("gone").ok());
  SessionStore& again = ReopenNamed("part");
  EXPECT_EQ(*again.GetValue("settings"), "two");
  EXPECT_EQ(*again.GetValue(""), "empty name");
  EXPECT_EQ(*again.GetValue("gone"), absl::nullopt);
}

TEST_P(ConformanceTest, AppendsThatWaitForASlowDiskShareItsSync) {
  SessionStore& session = Create("part");
  Acknowledgements acknowledged;
  rig_->faults().Hold();
  const int before = rig_->faults().num_syncs();
  session.Append({1, "x"}, Durability::kSync, acknowledged.Of(1));
  ASSERT_TRUE(rig_->faults().AwaitHeldSync());
  for (int i = 2; i <= 40; ++i) session.Append({i, "x"}, Durability::kSync, acknowledged.Of(i));
  session.Append({41, "x"}, Durability::kAsync, acknowledged.Of(41));
  EXPECT_THAT(acknowledged.AwaitSuccesses(1), ElementsAre(41)) << "others wait until they are on disk";
  EXPECT_EQ(session.durable_revision(), 0);
  EXPECT_EQ(session.last_revision(), 41);
  rig_->faults().Release();
  EXPECT_EQ(acknowledged.AwaitSuccesses(41).size(), 41u);
  EXPECT_EQ(rig_->faults().num_syncs(), before + 2);
  EXPECT_TRUE(session.PutValue("later", "").ok());  // 41 has its turn after 40, which the test has heard of
  EXPECT_EQ(session.durable_revision(), 41);
}

TEST_P(ConformanceTest, WhatIsWrittenDuringASyncMayBeLostAndWhatWasBeforeMayNot) {
  SessionStore& session = Create("part");
  Acknowledgements acknowledged;
  rig_->faults().Hold();
  session.Append({1, "kept"}, Durability::kSync, acknowledged.Of(1));
  ASSERT_TRUE(rig_->faults().AwaitHeldSync());
  EXPECT_TRUE(AppendNow(session, 2, "lost", Durability::kAsync).ok()) << "though a sync hangs";
  rig_->faults().Release();
  EXPECT_THAT(acknowledged.AwaitSuccesses(1), ElementsAre(1));
  EXPECT_EQ(session.durable_revision(), 1);
  rig_->faults().Set(Fault::kFailedSync);  // of the store's end
  session_.reset();
  store_.reset();
  rig_->LosePower();
  rig_->faults().Set(Fault::kNone);
  EXPECT_THAT(RecordsAfter(ReopenNamed("part"), 0), ElementsAre(Pair(1, "kept")));
}

TEST_P(ConformanceTest, LossOfPowerTakesNothingThatWasSynced) {
  SessionStore& session = Create("part");
  for (int64_t revision = 1; revision <= 20; ++revision) {
    EXPECT_TRUE(
        AppendNow(session, revision, "x", revision % 5 == 0 ? Durability::kSync : Durability::kAsync).ok());
  }
  Commit(session, 20, {{1, "p"}});
  EXPECT_TRUE(AppendNow(session, 21, "y", Durability::kSync).ok());
  EXPECT_TRUE(AppendNow(session, 22, "lost", Durability::kAsync).ok());
  EXPECT_EQ(session.durable_revision(), 21);
  rig_->faults().Set(Fault::kFailedSync);  // of the store's end
  session_.reset();
  store_.reset();
  rig_->LosePower();
  rig_->faults().Set(Fault::kNone);
  const SessionContents found = ContentsOf(ReopenNamed("part"));
  EXPECT_EQ(found, (SessionContents{20, "manifest", {{1, "p"}}, {{21, "y"}}}));
}

constexpr Fault kFaults[] = {Fault::kFailedWrite, Fault::kTornWrite, Fault::kFullDisk, Fault::kFailedSync};

TEST_P(ConformanceTest, AFailureMakesTheStoreReadOnlyUntilItIsOpenedAgain) {
  int64_t revision = 0;
  Create("part");
  Create("other");
  for (const Fault fault : kFaults) {
    SCOPED_TRACE(static_cast<int>(fault));
    SessionStore& session = OpenNamed("part");
    EXPECT_TRUE(AppendNow(session, ++revision, "kept").ok());
    const Records kept = RecordsAfter(session, 0);
    rig_->faults().Set(fault);
    const absl::Status first = AppendNow(session, ++revision, std::string(5000, 'u'));
    rig_->faults().Set(Fault::kNone);
    const char* const reason = fault == Fault::kFullDisk ? reason::kStoreFull : reason::kStoreFailed;
    EXPECT_EQ(ErrorReason(first), reason) << first;
    EXPECT_EQ(ErrorReason(AppendNow(session, revision + 1, "late")), reason);
    EXPECT_EQ(ErrorReason(AppendNow(*store_->OpenSession("other").value(), revision, "x")), reason);
    EXPECT_EQ(ErrorReason(store_->CreateSession("third")), reason);
    EXPECT_EQ(ErrorReason(store_->status()), reason);
    Records read = RecordsAfter(session, 0);
    if (read.size() > kept.size()) read.pop_back();
    EXPECT_EQ(read, kept) << "it still reads";
    Records found = RecordsAfter(ReopenNamed("part"), 0);
    if (found.size() > kept.size()) {  // what was not acknowledged may be there, but whole
      EXPECT_EQ(found.back().second, std::string(5000, 'u'));
      found.pop_back();
    }
    EXPECT_EQ(found, kept);
    EXPECT_THAT(store_->ListSessions(), ElementsAre("other", "part"));
  }
}

TEST_P(ConformanceTest, AFailureDuringACheckpointLeavesTheOneBefore) {
  Create("part");
  for (const Fault fault : kFaults) {
    SCOPED_TRACE(static_cast<int>(fault));
    SessionStore& session = OpenNamed("part");
    Commit(session, session.last_revision() + 1, {{1, "a"}, {2, "b"}});
    const SessionContents before = ContentsOf(session);
    auto writer = session.BeginCheckpoint(before.checkpoint + 1);
    rig_->faults().Set(fault);
    (*writer)->WritePage(1, std::string(300000, 'A')).IgnoreError();
    EXPECT_FALSE((*writer)->Commit("never").ok());
    rig_->faults().Set(Fault::kNone);
    writer->reset();
    const SessionContents found = ContentsOf(ReopenNamed("part"));
    // After a failed sync the commit may be there, but whole.
    if (found.manifest == "never") {
      EXPECT_EQ(found.pages.at(1), std::string(300000, 'A'));
    } else {
      EXPECT_EQ(found, before);
    }
  }
}

TEST_P(ConformanceTest, RandomHistoriesAreReadAsTheyWereWritten) {
  for (int seed = 0; seed < 6; ++seed) {
    SCOPED_TRACE(absl::StrCat("seed ", seed));
    std::mt19937 random(seed);
    const std::unique_ptr<StoreRig> rig = GetParam().second();
    RandomAuthor author(rig.get(), &random);
    for (int sitting = 0; sitting < 4; ++sitting) {
      author.Write(40);
      EXPECT_EQ(ReadStore(*rig).value(), author.written());
    }
  }
}

TEST_P(ConformanceTest, AFlippedBitIsFoundOrHarmless) {
  int found = 0;
  for (int seed = 0; seed < 40; ++seed) {
    SCOPED_TRACE(absl::StrCat("seed ", seed));
    std::mt19937 random(seed);
    const std::unique_ptr<StoreRig> rig = GetParam().second();
    RandomAuthor author(rig.get(), &random);
    author.Write(20);
    author.Write(20);
    rig->FlipBit(random);
    const absl::StatusOr<StoreContents> contents = ReadStore(*rig);
    if (contents.ok()) {
      EXPECT_EQ(*contents, author.written());
    } else {
      EXPECT_EQ(ErrorReason(contents.status()), reason::kStoreDamaged) << contents.status();
      ++found;
    }
  }
  EXPECT_GT(found, 10);
}

INSTANTIATE_TEST_SUITE_P(Stores, ConformanceTest,
                         ::testing::Values(std::make_pair("Memory", MakeMemoryRig),
                                           std::make_pair("RocksDb", MakeRocksDbRig)),
                         [](const auto& instance) { return std::string(instance.param.first); });

}  // namespace
}  // namespace dynmesh::testing
