#include "server/session/history.h"

#include "core/mesh/validate.h"
#include "tests/session/session_support.h"
#include "tests/support/meshes.h"
#include "tests/support/oracle.h"

namespace dynmesh::testing {
namespace {

using ::testing::IsEmpty;

constexpr HistoryMove kUndo = HistoryMove::kUndo;
constexpr HistoryMove kRedo = HistoryMove::kRedo;

class HistoryTest : public ::testing::Test {
 protected:
  /// Fails the test when refused.
  HistoryResult Must(Session& session, HistoryMove move, uint32_t count = 1) {
    const auto result = session.MoveInHistory(move, {.count = count});
    EXPECT_TRUE(result.ok()) << result.status();
    EXPECT_EQ(ChecksumOf(session), (*result)->checksum);
    EXPECT_EQ((*result)->revision, session.revision());
    return **result;
  }

  void ExpectRefused(Session& session, HistoryMove move, const HistoryOptions& options,
                     const Refusal& refusal) {
    const int64_t revision = session.revision();
    EXPECT_EQ(RefusalOf(session.MoveInHistory(move, options)), refusal);
    EXPECT_EQ(session.revision(), revision);
  }

  static Refusal NoUndo() { return {absl::StatusCode::kFailedPrecondition, reason::kNothingToUndo}; }
  static Refusal NoRedo() { return {absl::StatusCode::kFailedPrecondition, reason::kNothingToRedo}; }

  Daemon daemon_;
};

TEST_F(HistoryTest, UndoAndRedoAreOneRevisionEach) {
  const SessionPtr session = daemon_.NewSession();
  std::vector<Checksum> checksums = {ChecksumOf(*session)};
  for (int i = 0; i < 4; ++i) {
    MustApply(*session, AddTet());
    checksums.push_back(ChecksumOf(*session));
  }
  const HistoryResult undone = Must(*session, kUndo, 3);
  EXPECT_EQ(undone.revision, 5);
  EXPECT_EQ(undone.count, 3u);
  EXPECT_EQ(undone.checksum, checksums[1]);
  EXPECT_EQ(undone.counts[3], 1u);
  EXPECT_EQ(undone.undoable_batches, 1u);
  EXPECT_EQ(undone.redoable_batches, 3u);
  EXPECT_EQ(Must(*session, kRedo, 2).checksum, checksums[3]);
  EXPECT_EQ(Must(*session, kUndo, 3).checksum, checksums[0]);
  EXPECT_EQ(Must(*session, kRedo, 4).checksum, checksums[4]);
  EXPECT_EQ(session->revision(), 8);
}

TEST_F(HistoryTest, HowMuchTheNextBatchNamesIsKnownBeforehand) {
  const SessionPtr session = daemon_.NewSession();
  EXPECT_EQ(session->num_history_items(kUndo), 0u);
  MustApply(*session, AddTet());  // 4 vertices, 6 edges, 4 faces, 1 cell
  EXPECT_EQ(session->num_history_items(kUndo), 15u);
  MustApply(*session, {MoveVerticesEdit{{0, 1}, {{5, 5, 5}, {6, 6, 6}}}});
  EXPECT_EQ(session->num_history_items(kUndo), 2u);
  EXPECT_EQ(session->num_history_items(kRedo), 0u);
  Must(*session, kUndo);
  EXPECT_EQ(session->num_history_items(kUndo), 15u);
  EXPECT_EQ(session->num_history_items(kRedo), 2u);
}

TEST_F(HistoryTest, NothingIsDoneWhenThereAreFewerBatches) {
  const SessionPtr session = daemon_.NewSession();
  ExpectRefused(*session, kUndo, {}, NoUndo());
  MustApply(*session, AddTet());
  ExpectRefused(*session, kUndo, {.count = 2}, NoUndo());
  ExpectRefused(*session, kRedo, {}, NoRedo());
  const auto refused = session->MoveInHistory(kUndo, {.count = 7});
  EXPECT_EQ(MetadataOf(refused.status(), "requested"), "7");
  EXPECT_EQ(MetadataOf(refused.status(), "available"), "1");
}

TEST_F(HistoryTest, ANewBatchForgetsWhatWasUndone) {
  const SessionPtr session = daemon_.NewSession();
  for (int i = 0; i < 3; ++i) MustApply(*session, AddTet());
  Must(*session, kUndo, 2);
  MustApply(*session, AddTet());
  ExpectRefused(*session, kRedo, {}, NoRedo());
  EXPECT_EQ(Must(*session, kUndo, 2).counts[3], 0u);
}

TEST_F(HistoryTest, BatchesWithoutEffectDoNotCount) {
  const SessionPtr session = daemon_.NewSession();
  for (int i = 0; i < 2; ++i) MustApply(*session, AddTet());
  Must(*session, kUndo);
  SwapEdgesEdit boundary;
  boundary.edges.ids = {0};
  ApplyOptions options;
  options.skip_refused = true;
  const std::vector<Edit> edits = {boundary};
  ASSERT_TRUE(session->Apply(edits, options).ok());
  EXPECT_EQ(session->revision(), 4);
  EXPECT_EQ(session->Info()->undoable_batches, 1u);
  EXPECT_EQ(Must(*session, kRedo).counts[3], 2u);
  EXPECT_EQ(Must(*session, kUndo, 2).counts[3], 0u);
}

TEST_F(HistoryTest, RefusedAndDryBatchesLeaveNoTrace) {
  const SessionPtr session = daemon_.NewSession();
  MustApply(*session, AddTet());
  Must(*session, kUndo);
  ASSERT_FALSE(session->Apply({RemoveVerticesEdit{{99}}}, {}).ok());
  MustApply(*session, AddTet(), {.validate_only = true});
  MustApply(*session, {});
  EXPECT_EQ(Must(*session, kRedo).counts[3], 1u);
}

TEST_F(HistoryTest, ValidateOnlyTellsTheResultAndChangesNothing) {
  const SessionPtr session = daemon_.NewSession();
  const Checksum empty = ChecksumOf(*session);
  MustApply(*session, AddTet());
  const auto result = session->MoveInHistory(kUndo, {.validate_only = true});
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ((*result)->revision, 1);
  EXPECT_EQ((*result)->checksum, empty);
  EXPECT_EQ((*result)->undoable_batches, 1u);
  EXPECT_EQ(session->revision(), 1);
  EXPECT_EQ(session->Info()->counts[3], 1u);
}

TEST_F(HistoryTest, ARetryGetsTheFirstAnswer) {
  const SessionPtr session = daemon_.NewSession();
  for (int i = 0; i < 3; ++i) MustApply(*session, AddTet());
  const HistoryOptions options = {.if_revision = 3, .request_id = "undo"};
  const auto first = session->MoveInHistory(kUndo, options);
  ASSERT_TRUE(first.ok()) << first.status();
  EXPECT_EQ(*session->MoveInHistory(kUndo, options), *first);
  EXPECT_EQ(session->revision(), 4);
  ExpectRefused(*session, kRedo, options, {absl::StatusCode::kInvalidArgument, reason::kRequestIdReused});
  ExpectRefused(*session, kUndo, {.if_revision = 3}, {absl::StatusCode::kAborted, reason::kRevisionMismatch});
}

TEST_F(HistoryTest, TheOldestBatchesAreForgotten) {
  Daemon daemon(Limits{.max_undo_batches = 3});
  const SessionPtr session = daemon.NewSession();
  for (int i = 0; i < 5; ++i) MustApply(*session, AddTet());
  EXPECT_EQ(session->Info()->undoable_batches, 3u);
  Must(*session, kUndo, 2);
  EXPECT_EQ(session->Info()->undoable_batches, 1u);
  EXPECT_EQ(session->Info()->redoable_batches, 2u);
  EXPECT_EQ(Must(*session, kUndo).counts[3], 2u);
  ExpectRefused(*session, kUndo, {}, NoUndo());
}

TEST_F(HistoryTest, NoMoreIsKeptThanTheBytesSay) {
  Daemon daemon(Limits{.max_undo_bytes = 8000});
  const SessionPtr session = daemon.NewSession();
  for (int i = 0; i < 30; ++i) MustApply(*session, AddTet());
  const uint32_t undoable = session->Info()->undoable_batches;
  EXPECT_GT(undoable, 0u);
  EXPECT_LT(undoable, 30u);
  EXPECT_LE(session->Info()->history_bytes, 8000u);
  MustApply(*session, {AddSomeVertices(100'000)});  // whose image has no room at all
  EXPECT_EQ(session->Info()->undoable_batches, 0u);
  EXPECT_EQ(session->Info()->history_bytes, 0u);
  MustApply(*session, AddTet());
  EXPECT_EQ(Must(*session, kUndo).counts[0], 100'120u);
}

TEST_F(HistoryTest, WhatIsUndoneCanBeRedoneAsFarAsItFits) {
  Daemon daemon(Limits{.max_undo_bytes = 100'000});
  const SessionPtr session = daemon.NewSession();
  MustApply(*session, AddTet());
  for (int i = 0; i < 2; ++i) MustApply(*session, {AddSomeVertices(3'000)});  // 12 kB to undo, 84 kB to redo
  const HistoryResult undone = Must(*session, kUndo, 3);
  EXPECT_EQ(undone.redoable_batches, 2u);
  EXPECT_EQ(Must(*session, kRedo, 2).counts[0], 3'004u);
  ExpectRefused(*session, kRedo, {}, NoRedo());
  EXPECT_LE(session->Info()->history_bytes, 100'000u);
}

TEST_F(HistoryTest, ItGivesWayToTheMesh) {
  constexpr uint64_t kMaxBytes = 1'000'000;
  Daemon daemon(Limits{.max_session_bytes = kMaxBytes});
  const SessionPtr session = daemon.NewSession();
  MustApply(*session, {AddSomeVertices(1'000)});
  ASSERT_EQ(session->Info()->undoable_batches, 1u);
  while (session->Apply({AddSomeVertices(1'000)}, {}).ok()) {
    const auto info = session->Info();
    ASSERT_LE(info->history_bytes + std::min(info->memory_bytes, kMaxBytes), kMaxBytes + 100'000);
  }
  EXPECT_GT(session->Info()->counts[0], 5'000u);
}

TEST_F(HistoryTest, WithoutRoomForBatchesNothingIsKept) {
  Daemon daemon(Limits{.max_undo_batches = 0});
  const SessionPtr session = daemon.NewSession();
  MustApply(*session, AddTet());
  ExpectRefused(*session, kUndo, {}, NoUndo());
  EXPECT_EQ(session->Info()->history_bytes, 0u);
}

TEST_F(HistoryTest, AnImportCannotBeUndone) {
  const SessionPtr session = daemon_.NewSession();
  Mesh mesh = OneTet();
  ASSERT_TRUE(session->Adopt(mesh).ok());
  ExpectRefused(*session, kUndo, {}, NoUndo());
  MustApply(*session, {RemoveElementsEdit{EntityKind::kCell, {0}}});
  EXPECT_EQ(Must(*session, kUndo).counts[3], 1u);
  ExpectRefused(*session, kUndo, {}, NoUndo());
}

TEST_F(HistoryTest, EditsThatAreNoListOfEditsAreUndoneToo) {
  const SessionPtr session = daemon_.NewSession();
  MustApply(*session, AddTet());
  const auto edit = [&](BatchEnding ending) {
    return session->EditMesh(
        [ending](Mesh& mesh) -> absl::StatusOr<BatchEnding> {
          DYNMESH_RETURN_IF_ERROR(mesh.RemoveElement(CellId(0)));
          return ending;
        },
        [](const Mesh&) { return LoggedRequest{}; });
  };
  ASSERT_TRUE(edit(BatchEnding::kRollBack).ok());
  EXPECT_EQ(session->Info()->undoable_batches, 1u);
  ASSERT_TRUE(edit(BatchEnding::kCommit).ok());
  EXPECT_EQ(session->Info()->undoable_batches, 2u);
  EXPECT_EQ(Must(*session, kUndo).counts[3], 1u);
  EXPECT_EQ(Must(*session, kUndo).counts[0], 0u);
}

class StopAtOnce : public StopSignal {
 public:
  absl::Status Check() const override { return absl::CancelledError("nobody waits"); }
};

TEST_F(HistoryTest, WhoGaveUpHasChangedNothing) {
  const SessionPtr session = daemon_.NewSession();
  MustApply(*session, AddTet());
  EXPECT_TRUE(absl::IsCancelled(session->MoveInHistory(kUndo, {}, StopAtOnce()).status()));
  EXPECT_EQ(session->revision(), 1);
  EXPECT_EQ(Must(*session, kUndo).counts[3], 0u);
}

TEST_F(HistoryTest, FollowersSeeItAsAnyOtherRevision) {
  const uint32_t seed = 77;
  SCOPED_TRACE(seed);
  const SessionPtr session = daemon_.NewSession();
  RecordingSink sink(daemon_.workers(), RecordingSink::Acknowledge::kAtOnce);
  ASSERT_TRUE(sink.Follow(session, {}).ok());
  RandomBatches batches(seed);
  std::mt19937 rng(seed);
  std::vector<Checksum> checksums = {ChecksumOf(*session)};
  for (int round = 0; round < 20; ++round) {
    const auto applied = session->Apply(batches.Next(), {});
    applied.ok() ? batches.Applied(**applied) : batches.Refused();
    const bool counts = session->Info()->undoable_batches == checksums.size();  // others had no effect
    if (counts) checksums.push_back(ChecksumOf(*session));
  }
  ASSERT_GT(checksums.size(), 5u);
  const uint32_t count = checksums.size() - 1;
  for (int round = 0; round < 10; ++round) {
    const uint32_t steps = 1 + rng() % count;
    EXPECT_EQ(Must(*session, kUndo, steps).checksum, checksums[count - steps]);
    sink.AwaitRevision(session->revision());
    EXPECT_EQ(sink.mirror_checksum(), ChecksumOf(*session));
    EXPECT_EQ(Must(*session, kRedo, steps).checksum, checksums.back());
  }
  sink.AwaitRevision(session->revision());
  EXPECT_EQ(sink.mirror_checksum(), checksums.back());
  EXPECT_TRUE(sink.error().ok()) << sink.error();
  const absl::Status sound = session->Read([](const SessionView& view) {
    EXPECT_THAT(Validate(view.mesh), IsEmpty());
    return absl::OkStatus();
  });
  EXPECT_TRUE(sound.ok());
}

TEST_F(HistoryTest, ConflictsNeedToKnowWhatWasRead) {
  const SessionPtr session = daemon_.NewSession();
  MustApply(*session, AddTet());
  const auto refused = session->Apply(AddTet(), {.conflict_policy = ConflictPolicy::kTouched});
  EXPECT_EQ(RefusalOf(refused), (Refusal{absl::StatusCode::kInvalidArgument, reason::kBadArgument}));
  EXPECT_EQ(MetadataOf(refused.status(), "field"), "as_of_revision");
}

TEST_F(HistoryTest, WhatIsUndoneConflictsWithWhoReadItBefore) {
  const SessionPtr session = daemon_.NewSession();
  MustApply(*session, AddTet());
  MustApply(*session, {MoveVerticesEdit{{0}, {{5, 5, 5}}}});
  Must(*session, kUndo);
  const auto refused = session->Apply({MoveVerticesEdit{{0}, {{6, 6, 6}}}},
                                      {.as_of_revision = 2, .conflict_policy = ConflictPolicy::kTouched});
  EXPECT_EQ(RefusalOf(refused), (Refusal{absl::StatusCode::kAborted, reason::kConflict}));
}

}  // namespace
}  // namespace dynmesh::testing
