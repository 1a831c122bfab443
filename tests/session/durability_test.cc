// Sessions that outlive their daemon: a daemon ends, another one begins on the same medium.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>
#include <memory>
#include <optional>

#include "server/session/durability/manifest.h"
#include "server/session/repair_session.h"
#include "tests/core/archive/archive_support.h"
#include "tests/session/medium.h"
#include "tests/session/session_support.h"
#include "tests/support/meshes.h"

namespace dynmesh::testing {
namespace {

using ::testing::IsEmpty;

constexpr SessionDurability kSync = SessionDurability::kSync;

class DurabilityTest : public ::testing::Test {
 protected:
  ~DurabilityTest() override {
    medium_.Release();
    daemon_.reset();
  }

  void Restart(const SessionLogOptions& options = {}) {
    daemon_.reset();
    daemon_ = std::make_unique<Daemon>(Limits(), medium_.Open(), options);
  }

  /// The session of that name once it is loaded; null and a failed test if there is none.
  SessionPtr Find(const std::string& name = "mesh") {
    const absl::StatusOr<SessionPtr> found = daemon_->registry().Find(name);
    EXPECT_TRUE(found.ok()) << found.status();
    if (!found.ok()) return nullptr;
    const AccessGrant loaded = (*found)->access().Acquire(AccessMode::kRead);
    return *found;
  }

  static Mesh Copy(const Session& session) {
    std::optional<Mesh> copy;
    const absl::Status read = session.Read([&](const SessionView& view) {
      copy = view.mesh.Clone();
      return absl::OkStatus();
    });
    EXPECT_TRUE(read.ok()) << read;
    return copy.has_value() ? *std::move(copy) : Mesh();
  }

  static absl::Status WaitFor(Session& session, int64_t revision) {
    return session.WaitUntilAcknowledged(revision);
  }

  /// Applies random batches, some of which are undone again.
  static void EditAtRandom(Session& session, RandomBatches& batches, int count) {
    for (int i = 0; i < count; ++i) {
      const auto result = session.Apply(batches.Next(), {.as_of_revision = session.revision()});
      result.ok() ? batches.Applied(**result) : batches.Refused();
      if (i % 5 != 4) continue;
      EXPECT_TRUE(session.MoveInHistory(HistoryMove::kUndo, {}).ok());
      EXPECT_TRUE(session.MoveInHistory(HistoryMove::kRedo, {}).ok());
    }
    EXPECT_TRUE(WaitFor(session, session.revision()).ok());
  }

  Medium medium_;
  std::unique_ptr<Daemon> daemon_ = std::make_unique<Daemon>(Limits(), medium_.Open());
};

TEST_F(DurabilityTest, ASessionIsTheSameAfterARestart) {
  const SessionPtr before = daemon_->NewSession("mesh", {.durability = kSync});
  RandomBatches batches(31);
  EditAtRandom(*before, batches, 60);
  const Mesh mesh = Copy(*before);
  const SessionInfo info = *before->Info();
  EXPECT_EQ(info.durable_revision, info.revision);
  EXPECT_EQ(info.settings.durability, kSync);
  Restart();
  EXPECT_EQ((*daemon_->registry().ListAfter("", 10).begin())->state(), SessionState::kStored);
  const SessionPtr after = Find();
  ASSERT_NE(after, nullptr);
  ExpectIdentical(Copy(*after), mesh);
  EXPECT_EQ(after->state(), SessionState::kLoaded);
  EXPECT_EQ(after->Info()->uid, info.uid);
  EXPECT_EQ(after->Info()->create_time, absl::FromUnixMicros(absl::ToUnixMicros(info.create_time)));
  EXPECT_EQ(after->Info()->update_time, absl::FromUnixMicros(absl::ToUnixMicros(info.update_time)));
  EditAtRandom(*after, batches, 20);
}

TEST_F(DurabilityTest, CheckpointsAmongEditsChangeNothingOfWhatIsFound) {
  const SessionLogOptions often{.checkpoint_bytes = 3000, .kept_answers = {10, 1 << 20}};
  Restart(often);
  SessionPtr session = daemon_->NewSession("mesh", {.durability = SessionDurability::kAsync});
  RandomBatches batches(32);
  for (int round = 0; round < 6; ++round) {
    EditAtRandom(*session, batches, 50);
    const Mesh mesh = Copy(*session);
    session = nullptr;
    Restart(often);
    session = Find();
    ASSERT_NE(session, nullptr);
    ExpectIdentical(Copy(*session), mesh);
  }
}

TEST_F(DurabilityTest, ASessionWithoutDurabilityEndsWithItsDaemon) {
  daemon_->NewSession("mesh", {.durability = SessionDurability::kNone});
  Restart();
  EXPECT_EQ(RefusalOf(daemon_->registry().Find("mesh")),
            (Refusal{absl::StatusCode::kNotFound, reason::kSessionNotFound}));
}

TEST_F(DurabilityTest, WithAStoreSessionsAreKeptUnlessOneSaysOtherwise) {
  EXPECT_EQ(daemon_->NewSession("a")->Info()->settings.durability, kSync);
  Daemon without;
  EXPECT_EQ(without.NewSession("a")->Info()->settings.durability, SessionDurability::kNone);
  EXPECT_EQ(RefusalOf(without.registry().Create("b", {.durability = kSync}, "")),
            (Refusal{absl::StatusCode::kFailedPrecondition, reason::kNoStore}));
  EXPECT_EQ(without.registry().ListAfter("", 10).size(), 1u);
}

TEST_F(DurabilityTest, AnImportIsThereAfterARestart) {
  const SessionPtr session = daemon_->NewSession();
  Mesh mesh = ByDimension(TetGrid(3, 3, 3));
  const Mesh copy = mesh.Clone();
  ASSERT_TRUE(session->Adopt(mesh).ok());
  EXPECT_EQ(session->durable_revision(), 1);
  MustApply(*session, AddTet());
  EXPECT_TRUE(WaitFor(*session, 2).ok());
  const Mesh edited = Copy(*session);
  Restart();
  const SessionPtr after = Find();
  ASSERT_NE(after, nullptr);
  ExpectIdentical(Copy(*after), edited);
}

TEST_F(DurabilityTest, SettingsAreThereAfterARestart) {
  const Relation relation = kStorableRelations[1];
  const SessionPtr session = daemon_->NewSession("mesh", {.duplicates = DuplicatePolicy::kRefuse});
  CheckSettings checks;
  ASSERT_TRUE(checks.Set(CheckKind::kMinDihedral, {Severity::kWarn, 0.5}).ok());
  ASSERT_TRUE(
      session->Update({.stored_relations = std::vector<Relation>{relation}, .checks = checks}, "").ok());
  Restart();
  const SessionPtr after = Find();
  ASSERT_NE(after, nullptr);
  EXPECT_EQ(after->duplicates(), DuplicatePolicy::kRefuse);
  EXPECT_TRUE(after->checks() == checks);
  EXPECT_THAT(StoredRelationsOf(Copy(*after)), ::testing::ElementsAre(relation));
}

TEST_F(DurabilityTest, ADeletedSessionIsGoneAfterARestart) {
  daemon_->NewSession("mesh");
  daemon_->NewSession("other");
  ASSERT_TRUE(daemon_->registry().Delete("mesh", "").ok());
  Restart();
  ASSERT_EQ(daemon_->registry().ListAfter("", 10).size(), 1u);
  EXPECT_EQ(daemon_->registry().ListAfter("", 10)[0]->name(), "other");
}

TEST_F(DurabilityTest, ARetryGetsTheFirstAnswerAfterARestart) {
  const auto created = daemon_->registry().Create("mesh", {}, "create");
  ASSERT_TRUE(created.ok());
  const SessionPtr session = Find();
  const std::vector<Edit> edits = AddTet();
  const auto applied = MustApply(*session, edits, {.request_id = "apply", .report_lineage = true});
  const auto undone = *session->MoveInHistory(HistoryMove::kUndo, {.request_id = "undo"});
  const auto redone = *session->MoveInHistory(HistoryMove::kRedo, {.request_id = "redo"});
  const RepairRequest repair{.steps = {OrientStep{}, RemoveDuplicatesStep{{.isolated_vertices = true}}},
                             .request_id = "repair"};
  MustApply(*session, {AddSomeVertices(3)});
  const auto repaired = *RepairSession(*session, repair, StopSignal::Never(), [](size_t) {});
  const int64_t revision = session->revision();
  ASSERT_TRUE(WaitFor(*session, revision).ok());
  ASSERT_TRUE(session->Update({.checks = CheckSettings()}, "").ok());
  Restart();
  EXPECT_EQ(daemon_->registry().Create("mesh", {}, "create")->uid, created->uid);
  const SessionPtr after = Find();
  ASSERT_NE(after, nullptr);
  const auto again = MustApply(*after, edits, {.request_id = "apply", .report_lineage = true});
  EXPECT_EQ(again->revision, applied->revision);
  EXPECT_EQ(again->checksum, applied->checksum);
  ASSERT_EQ(again->results.size(), applied->results.size());
  for (size_t i = 0; i < applied->results.size(); ++i) {
    EXPECT_EQ(again->results[i].new_slots, applied->results[i].new_slots);
  }
  EXPECT_EQ((*after->MoveInHistory(HistoryMove::kUndo, {.request_id = "undo"}))->revision, undone->revision);
  EXPECT_EQ((*after->MoveInHistory(HistoryMove::kRedo, {.request_id = "redo"}))->checksum, redone->checksum);
  const auto repaired_again = *RepairSession(*after, repair, StopSignal::Never(), [](size_t) {});
  EXPECT_EQ(repaired_again->revision, repaired->revision);
  EXPECT_EQ(repaired_again->reports[1].Count(RepairFinding::kIsolated), 3u);
  EXPECT_EQ(after->revision(), revision) << "nothing was done twice";
  EXPECT_EQ(RefusalOf(after->Apply({AddSomeVertices(1)}, {.request_id = "apply"})),
            (Refusal{absl::StatusCode::kInvalidArgument, reason::kRequestIdReused}));
}

// ---- While the disk is slow, or fails ----

TEST_F(DurabilityTest, AnEditIsAcknowledgedWhenItIsStored) {
  const SessionPtr session = daemon_->NewSession();
  medium_.Hold();
  MustApply(*session, {AddSomeVertices(1)});
  EXPECT_EQ(session->revision(), 1);
  EXPECT_EQ(session->durable_revision(), 0);
  std::promise<absl::Status> acknowledged;
  session->AwaitAcknowledged(1, [&](const absl::Status& status) { acknowledged.set_value(status); });
  std::future<absl::Status> future = acknowledged.get_future();
  EXPECT_EQ(future.wait_for(std::chrono::seconds(0)), std::future_status::timeout);
  medium_.Release();
  EXPECT_TRUE(future.get().ok());
  EXPECT_EQ(session->durable_revision(), 1);
}

TEST_F(DurabilityTest, FollowersAreToldOfWhatIsDurableOnly) {
  const SessionPtr session = daemon_->NewSession();
  RecordingSink sink(daemon_->workers(), RecordingSink::Acknowledge::kAtOnce);
  ASSERT_TRUE(sink.Follow(session, {}).ok());
  MustApply(*session, AddTet());
  sink.AwaitRevision(1);
  medium_.Hold();
  MustApply(*session, AddTet());
  RecordingSink late(daemon_->workers(), RecordingSink::Acknowledge::kAtOnce);
  ASSERT_TRUE(late.Follow(session, {}).ok());
  EXPECT_EQ(session->revision(), 2);
  EXPECT_EQ(sink.mirror_revision(), 1);
  EXPECT_THAT(late.payloads(), IsEmpty());
  medium_.Release();
  sink.AwaitRevision(2);
  late.AwaitRevision(2);
  EXPECT_EQ(sink.mirror_checksum(), ChecksumOf(*session));
  EXPECT_EQ(late.mirror_checksum(), ChecksumOf(*session));
}

TEST_F(DurabilityTest, WhatCannotBeStoredIsNotAcknowledgedAndEndsEditing) {
  const SessionPtr session = daemon_->NewSession();
  const std::vector<Edit> kept = AddTet();
  MustApply(*session, kept, {.request_id = "kept"});
  ASSERT_TRUE(WaitFor(*session, 1).ok());
  const Mesh mesh = Copy(*session);
  medium_.Hold();
  MustApply(*session, AddTet(), {.request_id = "lost"});
  medium_.Fail(absl::UnavailableError("the disk is gone"));
  EXPECT_TRUE(absl::IsUnavailable(WaitFor(*session, 2)));
  const absl::Status refused = session->Apply(AddTet(), {}).status();
  EXPECT_FALSE(refused.ok());
  EXPECT_EQ(session->revision(), 2) << "nothing was added to what may be lost";
  EXPECT_FALSE(WaitFor(*session, MustApply(*session, AddTet(), {.request_id = "lost"})->revision).ok())
      << "a retry is not acknowledged either";
  EXPECT_TRUE(WaitFor(*session, MustApply(*session, kept, {.request_id = "kept"})->revision).ok())
      << "what was acknowledged before still is";
  EXPECT_TRUE(session->Info().ok()) << "it can still be read";
  medium_.Fail(absl::OkStatus());
  Restart();
  const SessionPtr after = Find();
  ASSERT_NE(after, nullptr);
  ExpectIdentical(Copy(*after), mesh);
  MustApply(*after, AddTet(), {.request_id = "lost"});
  EXPECT_TRUE(WaitFor(*after, 2).ok());
}

TEST_F(DurabilityTest, ADelayedSyncThatFailsIsToldToAllWhoWaitForIt) {
  const SessionPtr session = daemon_->NewSession("mesh", {.durability = SessionDurability::kAsync});
  RecordingSink sink(daemon_->workers(), RecordingSink::Acknowledge::kAtOnce);
  ASSERT_TRUE(sink.Follow(session, {}).ok());
  medium_.FailSyncs(absl::UnavailableError("the disk is gone"));
  MustApply(*session, AddTet());
  EXPECT_TRUE(WaitFor(*session, 1).ok()) << "it was written";
  std::promise<absl::Status> durable;
  session->AwaitDurable(1, [&](const absl::Status& status) { durable.set_value(status); });
  EXPECT_FALSE(durable.get_future().get().ok());
  EXPECT_FALSE(session->Apply(AddTet(), {}).ok()) << "nothing more is let in";
  EXPECT_EQ(session->revision(), 1);
  sink.follower().End(absl::CancelledError("the test is over"));
  sink.AwaitEnd().IgnoreError();
  EXPECT_EQ(sink.mirror_revision(), 0) << "nobody was told of what is not on disk";
  medium_.FailSyncs(absl::OkStatus());
}

TEST_F(DurabilityTest, AnImportThatCannotBeStoredLeavesTheSessionEmpty) {
  const SessionPtr session = daemon_->NewSession();
  medium_.Fail(absl::ResourceExhaustedError("the disk is full"));
  Mesh mesh = ByDimension(TetGrid(2, 2, 2));
  EXPECT_FALSE(session->Adopt(mesh).ok());
  EXPECT_EQ(session->revision(), 0);
  medium_.Fail(absl::OkStatus());
  Restart();
  const SessionPtr after = Find();
  ASSERT_NE(after, nullptr);
  EXPECT_EQ(after->revision(), 0);
  EXPECT_TRUE(after->Adopt(mesh).ok());
}

TEST_F(DurabilityTest, SettingsThatCannotBeStoredStayAsTheyWere) {
  const SessionPtr session = daemon_->NewSession("mesh", {.stored_relations = {kStorableRelations[1]}});
  MustApply(*session, AddTet());
  const SessionInfo before = *session->Info();
  medium_.Fail(absl::ResourceExhaustedError("the disk is full"));
  CheckSettings checks;
  ASSERT_TRUE(checks.Set(CheckKind::kMinDihedral, {Severity::kReject, 0.25}).ok());
  const SettingsUpdate update{.stored_relations = std::vector<Relation>{kStorableRelations[0]},
                              .checks = checks,
                              .retention = Retention{.max_revisions = 9}};
  EXPECT_FALSE(session->Update(update, "").ok());
  EXPECT_EQ(session->Info()->settings.stored_relations, before.settings.stored_relations);
  EXPECT_TRUE(session->checks() == before.settings.checks);
  EXPECT_EQ(session->retention(), before.settings.retention);
  medium_.Fail(absl::OkStatus());
}

// ---- What is found damaged ----

TEST_F(DurabilityTest, ADamagedSessionIsSetAsideAndOthersServe) {
  daemon_->NewSession("good");
  daemon_->NewSession("worse");
  MustApply(*daemon_->NewSession("bad"), AddTet());
  daemon_.reset();
  {
    const std::unique_ptr<Store> store = medium_.Open();
    ASSERT_TRUE((*store->OpenSession("bad"))->PutValue(kIdentityName, std::string("\x01", 1)).ok());
    auto records = *store->OpenSession("worse");
    std::promise<absl::Status> done;
    records->Append({1, std::string("\x01", 1)}, Durability::kSync,
                    [&](const absl::Status& s) { done.set_value(s); });
    ASSERT_TRUE(done.get_future().get().ok());
  }
  Restart();
  const auto damage = [&](const std::string& name) {
    const SessionPtr session = Find(name);
    EXPECT_EQ(session->state(), SessionState::kDamaged) << name;
    EXPECT_NE(session->Outline().state_message, "");
    return session->Info().status().code();
  };
  EXPECT_EQ(damage("bad"), absl::StatusCode::kDataLoss);
  EXPECT_EQ(damage("worse"), absl::StatusCode::kDataLoss);
  MustApply(*Find("good"), AddTet());
  EXPECT_EQ(daemon_->registry().ListAfter("", 10).size(), 3u);
  EXPECT_TRUE(daemon_->registry().Delete("bad", "").ok());
  EXPECT_TRUE(daemon_->registry().Delete("worse", "").ok());
  Restart();
  EXPECT_EQ(daemon_->registry().ListAfter("", 10).size(), 1u);
}

TEST_F(DurabilityTest, ASessionThatWasNotCreatedAsAWholeIsForgotten) {
  daemon_.reset();
  ASSERT_TRUE(medium_.Open()->CreateSession("half").ok());
  Restart();
  EXPECT_THAT(daemon_->registry().ListAfter("", 10), IsEmpty());
  daemon_->NewSession("half");
}

}  // namespace
}  // namespace dynmesh::testing
