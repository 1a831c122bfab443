// Earlier revisions of sessions: listed, had again, gone back to, kept under names.

#include "server/session/revisions.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <thread>

#include "tests/core/archive/archive_support.h"
#include "tests/session/medium.h"
#include "tests/session/session_support.h"
#include "tests/support/meshes.h"

namespace dynmesh::testing {
namespace {

using ::testing::ElementsAre;

class RevisionsTest : public ::testing::Test {
 protected:
  ~RevisionsTest() override { daemon_.reset(); }

  void Restart(const SessionLogOptions& options = {}) {
    daemon_.reset();
    daemon_ = std::make_unique<Daemon>(Limits(), medium_.Open(), options);
  }

  SessionPtr Find(const std::string& name = "mesh") {
    const SessionPtr session = *daemon_->registry().Find(name);
    const absl::Status loaded = AwaitLoaded(*session);
    EXPECT_TRUE(loaded.ok()) << loaded;
    return session;
  }

  static Mesh Copy(Session& session) { return std::move(MeshAt(session, kLastRevision)->mesh); }

  static void MakeCheckpoint(Session& session) {
    const absl::Status written =
        session.log()->WriteCheckpoint([&](absl::FunctionRef<absl::Status(const Mesh&, absl::Time)> fn) {
          return session.Read([&](const SessionView& view) { return fn(view.mesh, view.commit_time); });
        });
    EXPECT_TRUE(written.ok()) << written;
  }

  /// Makes revisions at random, some checkpoints among them, and copies of what each is.
  void EditAtRandom(Session& session, int count) {
    for (int i = 0; i < count; ++i) {
      const auto result = session.Apply(batches_.Next(), {.as_of_revision = session.revision()});
      result.ok() ? batches_.Applied(**result) : batches_.Refused();
      copies_.insert_or_assign(session.revision(), Copy(session));
      if (i % 7 == 6) MakeCheckpoint(session);
    }
    EXPECT_TRUE(session.WaitUntilAcknowledged(session.revision()).ok());
  }

  static int64_t NumCheckpoints(Session& session) { return session.log()->store().ListCheckpoints()->size(); }

  Medium medium_;
  std::unique_ptr<Daemon> daemon_ = std::make_unique<Daemon>(Limits(), medium_.Open());
  RandomBatches batches_{41};
  std::map<int64_t, Mesh> copies_;
};

TEST_F(RevisionsTest, EachRevisionCanBeHadToTheLastStampAlsoAfterARestart) {
  const SessionPtr made = daemon_->NewSession();
  copies_.emplace(0, Copy(*made));  // the beginning is a revision like others
  EditAtRandom(*made, 60);
  for (int restarts = 0; restarts < 2; ++restarts) {
    const SessionPtr session = Find();
    for (const auto& [revision, copy] : copies_) {
      SCOPED_TRACE(revision);
      const absl::StatusOr<RecoveredRevision> then = MeshAt(*session, revision);
      ASSERT_TRUE(then.ok()) << then.status();
      ExpectIdentical(then->mesh, copy);
    }
    EXPECT_EQ(MeshAt(*session, kLastRevision)->mesh.revision(), session->revision());
    EXPECT_EQ(RefusalOf(MeshAt(*session, session->revision() + 1)),
              (Refusal{absl::StatusCode::kOutOfRange, reason::kRevisionInFuture}));
    Restart();
  }
}

TEST_F(RevisionsTest, GoingBackIsARevisionThatCanBeUndone) {
  const SessionPtr session = daemon_->NewSession();
  EditAtRandom(*session, 40);
  for (const auto& [revision, copy] : copies_) {
    SCOPED_TRACE(revision);
    const int64_t before = session->revision();
    const Checksum checksum = ChecksumOf(*session);
    const auto restored = session->RestoreTo(MeshAt(*session, revision)->mesh, {});
    ASSERT_TRUE(restored.ok()) << restored.status();
    EXPECT_EQ((*restored)->revision, before + 1);
    EXPECT_EQ((*restored)->checksum, copy.checksum());
    EXPECT_EQ(ChecksumOf(*session), copy.checksum());
    EXPECT_TRUE(session->MoveInHistory(HistoryMove::kUndo, {}).ok());
    EXPECT_EQ(ChecksumOf(*session), checksum);
  }
  const int64_t first = copies_.begin()->first;
  ASSERT_TRUE(session->RestoreTo(copies_.at(first), {}).ok());
  const Mesh last = Copy(*session);
  Restart();
  ExpectIdentical(Copy(*Find()), last);
}

TEST_F(RevisionsTest, ARetryOfGoingBackGetsTheFirstAnswerAlsoAfterARestart) {
  SessionPtr session = daemon_->NewSession();
  EditAtRandom(*session, 10);
  const int64_t target = copies_.begin()->first;
  const HistoryOptions options{.request_id = "back", .note = {"ann", "undo the cut"}, .target = "first"};
  const HistoryOptions other{.request_id = "back", .target = "second"};
  EXPECT_EQ(*session->FindRestoration(options), nullptr);
  const HistoryResult first = **session->RestoreTo(copies_.at(target), options);
  session = nullptr;
  for (int restarts = 0; restarts < 2; ++restarts) {
    session = Find();
    EXPECT_EQ((*session->FindRestoration(options))->revision, first.revision);
    EXPECT_EQ((*session->RestoreTo(copies_.at(target), options))->revision, first.revision);
    EXPECT_EQ(session->revision(), first.revision);
    EXPECT_EQ(RefusalOf(session->FindRestoration(other)),
              (Refusal{absl::StatusCode::kInvalidArgument, reason::kRequestIdReused}));
    session = nullptr;
    Restart();
  }
}

TEST_F(RevisionsTest, ARefusedReturnChangesNothing) {
  const SessionPtr session = daemon_->NewSession();
  EditAtRandom(*session, 10);
  const Mesh before = Copy(*session);
  const Mesh& then = copies_.begin()->second;
  EXPECT_EQ(RefusalOf(session->RestoreTo(then, {.if_revision = 1})),
            (Refusal{absl::StatusCode::kAborted, reason::kRevisionMismatch}));
  EXPECT_EQ(RefusalOf(session->RestoreTo(then, {.note = {std::string(kMaxAuthorBytes + 1, 'a'), ""}})),
            (Refusal{absl::StatusCode::kInvalidArgument, reason::kBadArgument}));
  const auto dry = session->RestoreTo(then, {.validate_only = true});
  EXPECT_EQ((*dry)->checksum, then.checksum());
  EXPECT_EQ((*dry)->revision, before.revision());
  ExpectIdentical(Copy(*session), before);
}

TEST_F(RevisionsTest, RevisionsAreListedWithWhoMadeThemAndHow) {
  SessionPtr session = daemon_->NewSession();
  Mesh mesh = ByDimension(TetGrid(2, 2, 2));
  ASSERT_TRUE(session->Adopt(mesh, {LoggedCall::kImport, {}, 0, {}, {"bob", "first mesh"}}).ok());
  const std::vector<Edit> move = {MoveVerticesEdit{{0}, {{0.25, 0, 0}}}};
  MustApply(*session, move, {.request_id = "r", .note = {"ann", "nudge"}});
  ASSERT_TRUE(session->MoveInHistory(HistoryMove::kUndo, {.note = {"ann", "no"}}).ok());
  ASSERT_TRUE(session->MoveInHistory(HistoryMove::kRedo, {}).ok());
  ASSERT_TRUE(session->RestoreTo(MeshAt(*session, 1)->mesh, {.note = {"eve", "all back"}}).ok());
  MakeCheckpoint(*session);
  ASSERT_TRUE(session->WaitUntilAcknowledged(session->revision()).ok());
  session = nullptr;
  for (int restarts = 0; restarts < 2; ++restarts) {
    const RevisionList list = *ListRevisions(*Find(), 0, 10);
    std::vector<std::string> lines;
    for (const RevisionInfo& each : list.revisions) {
      lines.push_back(absl::StrCat(each.revision, " ", static_cast<int>(each.call), " ", each.note.author,
                                   " ", each.note.message));
      EXPECT_GT(each.bytes, 0u);
      EXPECT_LT(absl::Now() - each.commit_time, absl::Minutes(10));
    }
    EXPECT_THAT(
        lines, ElementsAre("5 6 eve all back", "4 5  ", "3 2 ann no", "2 1 ann nudge", "1 7 bob first mesh"));
    EXPECT_EQ(list.oldest, 1);
    EXPECT_EQ(list.last, 5);
    EXPECT_EQ(list.revisions[3].request_id, "r");
    Restart();
  }
}

TEST_F(RevisionsTest, AnImportThatACrashCutShortIsForgotten) {
  daemon_->NewSession();
  daemon_.reset();
  {
    const std::unique_ptr<Store> store = medium_.Open();
    const Origin never{1, 10, absl::Now(), {LoggedCall::kImport, {}, 0, {}, {"bob", "never made"}}};
    ASSERT_TRUE((*store->OpenSession("mesh"))->PutValue(kOriginName, EncodeOrigin(never)).ok());
  }
  Restart();
  MustApply(*Find(), {AddVerticesEdit{{{0, 0, 0}}}}, {.note = {"ann", "made"}});
  Restart({.kept_answers = {0, 0}, .retention = {.max_revisions = 1}});
  const SessionPtr session = Find();
  const RevisionList list = *ListRevisions(*session, 0, 10);
  ASSERT_EQ(list.revisions.size(), 1u);
  EXPECT_EQ(list.revisions[0].call, LoggedCall::kEdit);
  EXPECT_EQ(list.revisions[0].note.author, "ann");
  MakeCheckpoint(*session);
  const RevisionList later = *ListRevisions(*session, 0, 10);
  for (const RevisionInfo& each : later.revisions) EXPECT_NE(each.note.author, "bob");
}

TEST_F(RevisionsTest, APageOfRevisionsEndsWhereTheNextBegins) {
  const SessionPtr session = daemon_->NewSession();
  EditAtRandom(*session, 30);
  std::vector<int64_t> listed;
  int64_t before = 0;
  for (RevisionList page = *ListRevisions(*session, before, 7); !page.revisions.empty();
       page = *ListRevisions(*session, before, 7)) {
    EXPECT_LE(page.revisions.size(), 7u);
    for (const RevisionInfo& each : page.revisions) listed.push_back(each.revision);
    before = listed.back();
  }
  std::vector<int64_t> expected;
  for (int64_t revision = session->revision(); revision > 0; --revision) expected.push_back(revision);
  EXPECT_EQ(listed, expected);
}

constexpr SessionLogOptions kShortMemory{.kept_answers = {5, 100000}, .retention = {.max_revisions = 10}};

TEST_F(RevisionsTest, RetentionLetsOldRevisionsGoAndTheirPages) {
  Restart(kShortMemory);
  SessionPtr session = daemon_->NewSession();
  EditAtRandom(*session, 100);
  MakeCheckpoint(*session);
  const int64_t last = session->revision();
  const int64_t oldest = ListRevisions(*session, 0, 1)->oldest;
  EXPECT_GT(oldest, last - 30);
  EXPECT_LE(oldest, last - 9);
  EXPECT_LE(NumCheckpoints(*session), 6);
  session = nullptr;
  for (int restarts = 0; restarts < 2; ++restarts) {
    session = Find();
    for (const auto& [revision, copy] : copies_) {
      SCOPED_TRACE(revision);
      const absl::StatusOr<RecoveredRevision> then = MeshAt(*session, revision);
      if (revision >= oldest) {
        ASSERT_TRUE(then.ok()) << then.status();
        ExpectIdentical(then->mesh, copy);
      } else {
        EXPECT_EQ(RefusalOf(then), (Refusal{absl::StatusCode::kOutOfRange, reason::kRevisionGone}));
      }
    }
    session = nullptr;
    Restart(kShortMemory);
  }
}

TEST_F(RevisionsTest, ASessionKeepsFewerRevisionsWhenItIsToldSo) {
  const SessionLogOptions no_answers{.kept_answers = {0, 0}};
  Restart(no_answers);
  SessionPtr session = daemon_->NewSession("mesh", {.retention = {.max_revisions = 1000}});
  EditAtRandom(*session, 60);
  EXPECT_LE(ListRevisions(*session, 0, 1)->oldest, copies_.begin()->first);
  EXPECT_EQ(session->Info()->settings.retention.max_revisions, 1000u);
  ASSERT_TRUE(session->Update({.retention = Retention{.max_revisions = 3}}, "").ok());
  session = nullptr;
  Restart(no_answers);
  session = Find();
  EXPECT_EQ(session->retention().max_revisions, 3u);
  EditAtRandom(*session, 14);
  EXPECT_GT(ListRevisions(*session, 0, 1)->oldest, session->revision() - 20);
}

TEST(RetentionTest, OfTwoLimitsTheSmallerOneCounts) {
  const Retention daemons{100, absl::ZeroDuration(), 1000};
  EXPECT_EQ((Retention{7, absl::Hours(1), 0}).Within(daemons), (Retention{7, absl::Hours(1), 1000}));
  EXPECT_EQ((Retention{700, absl::ZeroDuration(), 5}).Within(daemons),
            (Retention{100, absl::ZeroDuration(), 5}));
}

TEST_F(RevisionsTest, ASnapshotOutlivesRetentionAndRestarts) {
  Restart(kShortMemory);
  SessionPtr session = daemon_->NewSession();
  EditAtRandom(*session, 25);
  const int64_t revision = session->revision() - 2;
  const Snapshot made = *CreateSnapshot(*session, "before", revision, {"ann", "as it was"});
  EXPECT_EQ(made.revision, revision);
  EditAtRandom(*session, 60);
  EXPECT_GT(ListRevisions(*session, 0, 1)->oldest, revision);
  session = nullptr;
  for (int restarts = 0; restarts < 2; ++restarts) {
    session = Find();
    ASSERT_EQ(ListSnapshots(*session)->size(), 1u);
    EXPECT_EQ(ListSnapshots(*session)->front().note, (RevisionNote{"ann", "as it was"}));
    EXPECT_EQ(*FindSnapshotRevision(*session, "before"), revision);
    ExpectIdentical(MeshAt(*session, revision)->mesh, copies_.at(revision));
    session = nullptr;
    Restart(kShortMemory);
  }
  session = Find();
  const int64_t checkpoints = NumCheckpoints(*session);
  ASSERT_TRUE(DeleteSnapshot(*session, "before").ok());
  MakeCheckpoint(*session);
  EXPECT_LT(NumCheckpoints(*session), checkpoints + 1);
  EXPECT_EQ(RefusalOf(MeshAt(*session, revision)),
            (Refusal{absl::StatusCode::kOutOfRange, reason::kRevisionGone}));
  EXPECT_EQ(RefusalOf(FindSnapshotRevision(*session, "before")),
            (Refusal{absl::StatusCode::kNotFound, reason::kSnapshotNotFound}));
}

TEST_F(RevisionsTest, ASnapshotOfTheEmptySessionOutlivesAnImport) {
  SessionPtr session = daemon_->NewSession();
  ASSERT_EQ(CreateSnapshot(*session, "empty", 0, {})->revision, 0);
  Mesh mesh = ByDimension(TetGrid(2, 2, 2));
  ASSERT_TRUE(session->Adopt(mesh).ok());
  EditAtRandom(*session, 8);
  session = nullptr;
  for (int restarts = 0; restarts < 2; ++restarts) {
    session = Find();
    ASSERT_EQ(ListSnapshots(*session)->size(), 1u);
    const auto then = MeshAt(*session, 0);
    ASSERT_TRUE(then.ok()) << then.status();
    EXPECT_EQ(then->mesh.NumLive(EntityKind::kVertex), 0u);
    session = nullptr;
    Restart();
  }
}

TEST_F(RevisionsTest, BadSnapshotsAreRefused) {
  const SessionPtr session = daemon_->NewSession();
  EditAtRandom(*session, 5);
  ASSERT_TRUE(CreateSnapshot(*session, "a", 0, {}).ok());
  EXPECT_EQ(RefusalOf(CreateSnapshot(*session, "a", 0, {})),
            (Refusal{absl::StatusCode::kAlreadyExists, reason::kSnapshotExists}));
  for (const std::string& name : {std::string(), std::string("../x"), std::string(65, 'n')}) {
    EXPECT_EQ(RefusalOf(CreateSnapshot(*session, name, 0, {})),
              (Refusal{absl::StatusCode::kInvalidArgument, reason::kBadSnapshotName}));
  }
  EXPECT_EQ(RefusalOf(CreateSnapshot(*session, "b", session->revision() + 1, {})),
            (Refusal{absl::StatusCode::kOutOfRange, reason::kRevisionInFuture}));
  EXPECT_EQ(RefusalOf(CreateSnapshot(*session, "b", -1, {})),
            (Refusal{absl::StatusCode::kInvalidArgument, reason::kBadArgument}));
  EXPECT_EQ(RefusalOf(DeleteSnapshot(*session, "b")),
            (Refusal{absl::StatusCode::kNotFound, reason::kSnapshotNotFound}));
  EXPECT_EQ(ListSnapshots(*session)->size(), 1u);
}

TEST_F(RevisionsTest, ASessionThatIsNotKeptHasNoPast) {
  const SessionPtr session = daemon_->NewSession("mesh", {.durability = SessionDurability::kNone});
  MustApply(*session, {AddVerticesEdit{{{0, 0, 0}}}});
  const Refusal refusal{absl::StatusCode::kFailedPrecondition, reason::kNoHistory};
  EXPECT_EQ(RefusalOf(ListRevisions(*session, 0, 10)), refusal);
  EXPECT_EQ(RefusalOf(CreateSnapshot(*session, "a", 0, {})), refusal);
  EXPECT_EQ(RefusalOf(MeshAt(*session, kLastRevision)), (Refusal{absl::StatusCode::kOk, ""}))
      << "but a present";
  MustApply(*session, {AddVerticesEdit{{{0, 0, 1}}}});
  EXPECT_EQ(RefusalOf(MeshAt(*session, 1)), refusal);
}

TEST_F(RevisionsTest, PastAndPresentAreReadWhileOthersEditAndCheckpointsAreMade) {
  Restart(kShortMemory);
  const SessionPtr session = daemon_->NewSession();
  EditAtRandom(*session, 20);
  std::atomic<bool> done{false};
  std::thread editor([&] {
    for (int i = 0; i < 150; ++i) {
      MustApply(*session, {AddVerticesEdit{{{0, 0, double(i)}}}});
      if (i % 10 == 9) MakeCheckpoint(*session);
    }
    done = true;
  });
  int had = 0;
  while (!done || had == 0) {
    const int64_t revision = session->revision() - had % 12;
    const absl::StatusOr<RecoveredRevision> then = MeshAt(*session, revision);
    if (then.ok()) {
      EXPECT_EQ(then->mesh.revision(), revision);
      ++had;
    } else {
      EXPECT_EQ(ErrorReason(then.status()), reason::kRevisionGone) << then.status();
    }
    EXPECT_TRUE(ListRevisions(*session, 0, 5).ok());
  }
  editor.join();
}

}  // namespace
}  // namespace dynmesh::testing
