// Sessions that nobody uses are unloaded, and are what they were when somebody uses them again. `now_` is the
// tests' own clock: it is hours ahead of what Find() sees.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <thread>

#include "server/session/repair_session.h"
#include "tests/core/archive/archive_support.h"
#include "tests/session/medium.h"
#include "tests/session/session_support.h"
#include "tests/support/meshes.h"

namespace dynmesh::testing {
namespace {

using ::testing::IsEmpty;

constexpr UnloadPolicy kWhateverIsIdle{.idle_timeout = absl::ZeroDuration()};

/// So that a test may say of a session what it was.
struct Memory {
  Mesh mesh;
  SessionInfo info;
};

class UnloadingTest : public ::testing::Test {
 protected:
  ~UnloadingTest() override {
    medium_.Release();
    daemon_.reset();
  }

  void Restart(const SessionLogOptions& options = {}) {
    daemon_.reset();
    daemon_ = std::make_unique<Daemon>(Limits(), medium_.Open(), options);
  }

  SessionRegistry& registry() { return daemon_->registry(); }

  /// The session of that name once it is loaded, or cannot be.
  SessionPtr Find(const std::string& name = "mesh") {
    const absl::StatusOr<SessionPtr> found = registry().Find(name);
    EXPECT_TRUE(found.ok()) << found.status();
    if (!found.ok()) return nullptr;
    const AccessGrant loaded = (*found)->access().Acquire(AccessMode::kRead);
    return *found;
  }

  /// The session as it is in the registry; does not use it.
  SessionPtr Look(const std::string& name = "mesh") {
    for (const SessionPtr& session : registry().ListAfter("", 100)) {
      if (session->name() == name) return session;
    }
    ADD_FAILURE() << "no session " << name;
    return nullptr;
  }
  SessionState StateOf(const std::string& name = "mesh") { return Look(name)->state(); }

  /// Waits until no task holds the session any more.
  void AwaitNobodyUses(const std::string& name = "mesh") {
    const absl::Time deadline = absl::Now() + kPatience;
    while (Look(name).use_count() > 2) {
      ASSERT_LT(absl::Now(), deadline) << name << " is in use";
      std::this_thread::yield();
    }
  }

  size_t Sweep(const UnloadPolicy& policy = kWhateverIsIdle) { return registry().UnloadIdle(now_, policy); }

  /// Sweeps until `name` is unloaded.
  void Unload(const std::string& name = "mesh") {
    const absl::Time deadline = absl::Now() + kPatience;
    while (Sweep(), StateOf(name) != SessionState::kStored) {
      ASSERT_LT(absl::Now(), deadline) << name << " stays loaded";
      std::this_thread::yield();
    }
  }

  static Memory Remember(const Session& session) {
    Memory memory{Mesh(), *session.Info()};
    const absl::Status read = session.Read([&](const SessionView& view) {
      memory.mesh = view.mesh.Clone();
      return absl::OkStatus();
    });
    EXPECT_TRUE(read.ok()) << read;
    return memory;
  }

  static void ExpectSame(const Session& session, const Memory& memory) {
    const Memory present = Remember(session);
    ExpectIdentical(present.mesh, memory.mesh);
    EXPECT_EQ(present.info.uid, memory.info.uid);
    EXPECT_EQ(present.info.etag, memory.info.etag);
    EXPECT_EQ(present.info.durable_revision, memory.info.durable_revision);
    EXPECT_EQ(present.info.create_time, memory.info.create_time);
    EXPECT_EQ(absl::ToUnixMicros(present.info.update_time), absl::ToUnixMicros(memory.info.update_time));
    EXPECT_EQ(present.info.settings.stored_relations, memory.info.settings.stored_relations);
    EXPECT_TRUE(present.info.settings.checks == memory.info.settings.checks);
  }

  static void EditAtRandom(Session& session, RandomBatches& batches, int count) {
    for (int i = 0; i < count; ++i) {
      const auto result = session.Apply(batches.Next(), {.as_of_revision = session.revision()});
      result.ok() ? batches.Applied(**result) : batches.Refused();
    }
    EXPECT_TRUE(session.WaitUntilAcknowledged(session.revision()).ok());
  }

  /// A session with one revision on disk, and nobody who has it.
  void NewIdleSession(const std::string& name, const SessionSettings& settings = {}) {
    Mesh mesh = ByDimension(TetGrid(3, 3, 3));
    ASSERT_TRUE(daemon_->NewSession(name, settings)->Adopt(mesh).ok());
    AwaitNobodyUses(name);
  }

  /// Makes `now_` when it was used last.
  void UseNow(const std::string& name) {
    const SessionPtr used = Look(name);
    now_ += absl::Seconds(2);
    EXPECT_EQ(Sweep({}), 0u);
  }

  Medium medium_;
  std::unique_ptr<Daemon> daemon_ = std::make_unique<Daemon>(Limits(), medium_.Open());
  absl::Time now_ = absl::Now() + absl::Hours(10);
};

// ---- What comes back ----

TEST_F(UnloadingTest, ASessionThatWasUnloadedIsTheSameWhenItIsUsedAgain) {
  const uint32_t seed = 57;
  SCOPED_TRACE(seed);
  SessionPtr session = daemon_->NewSession();
  RandomBatches batches(seed);
  for (int round = 0; round < 5; ++round) {
    EditAtRandom(*session, batches, 30);
    const Memory memory = Remember(*session);
    session = nullptr;
    Unload();
    session = Find();
    ASSERT_NE(session, nullptr);
    ExpectSame(*session, memory);
  }
  const Memory memory = Remember(*session);
  session = nullptr;
  Unload();
  Restart();
  ExpectIdentical(Remember(*Find()).mesh, memory.mesh);
}

TEST_F(UnloadingTest, WhatIsUnloadedIsListedAsItWasAndNotReadForIt) {
  SessionPtr session = daemon_->NewSession();
  MustApply(*session, AddTet());
  ASSERT_TRUE(session->WaitUntilAcknowledged(1).ok());
  ASSERT_TRUE(session->Update({.stored_relations = std::vector<Relation>{kStorableRelations[1]}}, "").ok());
  const SessionInfo info = *session->Info();
  session = nullptr;
  Unload();
  const SessionInfo outline = Look()->Outline();
  EXPECT_EQ(outline.state, SessionState::kStored);
  EXPECT_EQ(outline.uid, info.uid);
  EXPECT_EQ(outline.etag, info.etag);
  EXPECT_EQ(outline.revision, 1);
  EXPECT_EQ(outline.durable_revision, 1);
  EXPECT_EQ(outline.create_time, info.create_time);
  EXPECT_EQ(outline.update_time, info.update_time);
  EXPECT_EQ(outline.settings.stored_relations, info.settings.stored_relations);
  EXPECT_EQ(Look()->loaded_bytes(), 0u);
  EXPECT_EQ(Look()->num_live(EntityKind::kVertex), 4u) << "whoever asks can tell how much it is";
  EXPECT_EQ(StateOf(), SessionState::kStored);
}

TEST_F(UnloadingTest, SettingsStayAndEtagsStillFit) {
  SessionPtr session = daemon_->NewSession("mesh", {.duplicates = DuplicatePolicy::kRefuse});
  MustApply(*session, AddTet());
  ASSERT_TRUE(session->WaitUntilAcknowledged(1).ok());
  CheckSettings checks;
  ASSERT_TRUE(checks.Set(CheckKind::kMinDihedral, {Severity::kWarn, 0.5}).ok());
  const std::vector<Relation> relations{kStorableRelations[2]};
  ASSERT_TRUE(session->Update({.stored_relations = relations, .checks = checks}, "").ok());
  const Memory memory = Remember(*session);
  session = nullptr;
  Unload();
  session = Find();
  ExpectSame(*session, memory);
  EXPECT_EQ(session->duplicates(), DuplicatePolicy::kRefuse);
  EXPECT_TRUE(session->checks() == checks);
  EXPECT_TRUE(session->Update({.checks = CheckSettings()}, memory.info.etag).ok());
  EXPECT_EQ(RefusalOf(session->Update({.checks = checks}, memory.info.etag)),
            (Refusal{absl::StatusCode::kAborted, reason::kEtagMismatch}));
}

TEST_F(UnloadingTest, RetriesGetTheFirstAnswer) {
  const auto created = registry().Create("mesh", {}, "create");
  ASSERT_TRUE(created.ok());
  SessionPtr session = Find();
  ImportGate gate{Limits()};
  TestMonitor monitor;
  const auto import = [&] {
    const auto importer = *Importer::Start(session, gate, {.request_id = "import"});
    std::mt19937 rng(1);
    StageMesh(TetGrid(2, 2, 2), importer->staged(), rng);
    return importer->Finish(monitor);
  };
  ASSERT_EQ((*import()).outcome->revision, 1);
  const std::vector<Edit> edits = AddTet();
  const auto applied = MustApply(*session, edits, {.request_id = "apply"});
  const auto undone = *session->MoveInHistory(HistoryMove::kUndo, {.request_id = "undo"});
  MustApply(*session, {AddSomeVertices(3)});
  const RepairRequest repair{.steps = {RemoveDuplicatesStep{{.isolated_vertices = true}}},
                             .request_id = "repair"};
  const auto repaired = *RepairSession(*session, repair, StopSignal::Never(), [](size_t) {});
  const int64_t revision = session->revision();
  ASSERT_TRUE(session->WaitUntilAcknowledged(revision).ok());
  session = nullptr;
  Unload();
  EXPECT_EQ(registry().Create("mesh", {}, "create")->uid, created->uid);
  session = *registry().Find("mesh");
  EXPECT_EQ((*import()).outcome->revision, 1) << "an import that comes again need not wait";
  session = Find();
  const auto again = MustApply(*session, edits, {.request_id = "apply"});
  EXPECT_EQ(again->revision, applied->revision);
  EXPECT_EQ(again->results[0].new_slots, applied->results[0].new_slots);
  EXPECT_EQ((*session->MoveInHistory(HistoryMove::kUndo, {.request_id = "undo"}))->revision,
            undone->revision);
  EXPECT_EQ((*RepairSession(*session, repair, StopSignal::Never(), [](size_t) {}))->revision,
            repaired->revision);
  EXPECT_EQ(session->revision(), revision) << "nothing was done twice";
  EXPECT_EQ(RefusalOf(session->MoveInHistory(HistoryMove::kUndo, {})),
            (Refusal{absl::StatusCode::kFailedPrecondition, reason::kNothingToUndo}))
      << "what undoes batches is lost";
}

TEST_F(UnloadingTest, FollowersGoOnFromWhereTheyWereOnTheSameGrid) {
  const FollowOptions quantised{.position_bits = 8};
  NewIdleSession("mesh");
  std::map<int, QuantizationGrid> grids;
  {
    const SessionPtr session = Look();
    RecordingSink sink(daemon_->workers(), RecordingSink::Acknowledge::kAtOnce, Mirror::Geometry::kQuantized);
    ASSERT_TRUE(sink.Follow(session, quantised).ok());
    sink.AwaitRevision(1);
    grids = session->deltas().grids();
    ASSERT_EQ(grids.size(), 1u);
  }
  Unload();
  const SessionPtr session = *registry().Find("mesh");  // may still be loading
  RecordingSink late(daemon_->workers(), RecordingSink::Acknowledge::kByHand);
  ASSERT_TRUE(late.Follow(session, {.from_revision = 1, .session_uid = session->uid()}).ok());
  EXPECT_EQ(late.TakeOne()->revision, 1) << "it has everything";
  RecordingSink sink(daemon_->workers(), RecordingSink::Acknowledge::kAtOnce, Mirror::Geometry::kQuantized);
  ASSERT_TRUE(sink.Follow(session, quantised).ok());
  MustApply(*Find(), {AddVerticesEdit{{{100, 100, 100}}}});
  sink.AwaitRevision(2);
  EXPECT_EQ(late.TakeOne()->from_revision, 1);
  const std::map<int, QuantizationGrid> after = session->deltas().grids();
  ASSERT_EQ(after.size(), 1u);
  EXPECT_EQ(after.at(8).origin, grids.at(8).origin);
  EXPECT_EQ(after.at(8).step, grids.at(8).step);
}

TEST_F(UnloadingTest, WhatCannotBeReadAgainIsTriedAgain) {
  NewIdleSession("mesh");
  const Memory memory = Remember(*Look());
  Unload();
  medium_.FailReads(absl::UnavailableError("the disk does not answer"));
  EXPECT_EQ(Find()->Info().status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(Find()->Apply(AddTet(), {}).status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(Sweep(), 0u) << "there is nothing to unload";
  medium_.FailReads(absl::OkStatus());
  const absl::Time deadline = absl::Now() + kPatience;
  while (Find()->state() != SessionState::kLoaded) ASSERT_LT(absl::Now(), deadline);
  ExpectSame(*Find(), memory);
  MustApply(*Find(), AddTet());
}

TEST_F(UnloadingTest, WhatIsFoundDamagedCanOnlyBeDeleted) {
  NewIdleSession("mesh");
  Unload();
  medium_.FailReads(absl::DataLossError("the disk has forgotten"));
  EXPECT_EQ(Find()->state(), SessionState::kDamaged);
  medium_.FailReads(absl::OkStatus());
  EXPECT_EQ(Find()->Info().status().code(), absl::StatusCode::kDataLoss);
  EXPECT_EQ(Sweep(), 0u);
  EXPECT_TRUE(registry().Delete("mesh", "").ok());
  daemon_->NewSession("mesh");
}

TEST_F(UnloadingTest, AnUnloadedSessionCanBeDeletedAndItsNameIsFree) {
  for (const bool used : {false, true}) {
    NewIdleSession("mesh");
    Unload();
    if (used) Find();
    EXPECT_EQ(*registry().Delete("mesh", ""), 1);
    EXPECT_EQ(daemon_->NewSession("mesh")->revision(), 0);
    EXPECT_TRUE(registry().Delete("mesh", "").ok());
  }
  Restart();
  EXPECT_THAT(registry().ListAfter("", 10), IsEmpty());
}

// ---- What is unloaded, and when ----

TEST_F(UnloadingTest, OneIsUnloadedWhenNobodyHasUsedItForTheTimeout) {
  const UnloadPolicy half_an_hour{.idle_timeout = absl::Minutes(30)};
  NewIdleSession("mesh");
  UseNow("mesh");
  AwaitNobodyUses();
  now_ += absl::Minutes(30) - absl::Nanoseconds(1);
  EXPECT_EQ(Sweep(half_an_hour), 0u);
  UseNow("mesh");
  AwaitNobodyUses();
  now_ += absl::Minutes(30) - absl::Nanoseconds(1);
  EXPECT_EQ(Sweep(half_an_hour), 0u);
  now_ += absl::Nanoseconds(1);
  EXPECT_EQ(Sweep({}), 0u) << "nobody wants it";
  EXPECT_EQ(Sweep(half_an_hour), 1u);
  EXPECT_EQ(StateOf(), SessionState::kStored);
  EXPECT_EQ(Sweep(half_an_hour), 0u);
}

TEST_F(UnloadingTest, WhoIsListedIsNotUsed) {
  NewIdleSession("mesh");
  now_ = absl::Now() + absl::Minutes(30);
  EXPECT_EQ(registry().ListAfter("", 10).size(), 1u);
  EXPECT_EQ(Sweep({.idle_timeout = absl::Minutes(30)}), 1u);
}

TEST_F(UnloadingTest, AClockThatIsSetBackUnloadsNothingTooEarly) {
  NewIdleSession("mesh");
  UseNow("mesh");
  AwaitNobodyUses();
  now_ -= absl::Hours(5);
  EXPECT_EQ(Sweep({.idle_timeout = absl::Minutes(1)}), 0u);
  now_ += absl::Minutes(1);
  EXPECT_EQ(Sweep({.idle_timeout = absl::Minutes(1)}), 1u) << "nor hours too late";
}

TEST_F(UnloadingTest, TheLeastRecentlyUsedGoUntilTheRestFits) {
  for (const char* name : {"a", "b", "c", "d"}) NewIdleSession(name);
  for (const char* name : {"c", "a", "d", "b"}) UseNow(name);
  now_ += absl::Seconds(2);
  for (const char* name : {"a", "b", "c", "d"}) AwaitNobodyUses(name);
  EXPECT_EQ(Sweep({}), 0u);  // measures
  uint64_t bytes = 0;
  for (const char* name : {"b", "d"}) bytes += Look(name)->loaded_bytes();
  ASSERT_GT(bytes, 0u);
  EXPECT_EQ(Sweep({.max_loaded_bytes = bytes + 1}), 2u);
  EXPECT_EQ(StateOf("c"), SessionState::kStored);
  EXPECT_EQ(StateOf("a"), SessionState::kStored);
  EXPECT_EQ(Sweep({.max_loaded_bytes = bytes}), 0u);
  EXPECT_EQ(Sweep({.max_loaded_bytes = bytes - 1}), 1u);
  EXPECT_EQ(StateOf("d"), SessionState::kStored);
  EXPECT_EQ(StateOf("b"), SessionState::kLoaded);
}

TEST_F(UnloadingTest, TheBudgetSparesWhoWasUsedAMomentAgo) {
  NewIdleSession("mesh");
  UseNow("mesh");
  AwaitNobodyUses();
  now_ += absl::Milliseconds(900);
  EXPECT_EQ(Sweep({.max_loaded_bytes = 1}), 0u);
  now_ += absl::Milliseconds(100);
  EXPECT_EQ(Sweep({.max_loaded_bytes = 1}), 1u);
}

TEST_F(UnloadingTest, TheBudgetCountsMeshIndicesHistoryAndAnswers) {
  NewIdleSession("mesh");
  SessionPtr session = Find();
  const uint64_t empty = session->loaded_bytes();
  EXPECT_GE(empty, session->Info()->memory_bytes);
  MustApply(*session, {AddSomeVertices(2000)}, {.request_id = "id"});
  ASSERT_TRUE(session->WaitUntilAcknowledged(2).ok());
  const SessionInfo info = *session->Info();
  ASSERT_GT(info.history_bytes, 0u);
  session = nullptr;
  AwaitNobodyUses();
  EXPECT_EQ(Sweep({}), 0u);
  const uint64_t answer_bytes = 2000 * sizeof(Slot);
  EXPECT_GE(Look()->loaded_bytes(), info.memory_bytes + info.history_bytes + answer_bytes);
}

TEST_F(UnloadingTest, NoneIsUnloadedThatSomebodyHas) {
  NewIdleSession("held");
  NewIdleSession("followed");
  const SessionPtr held = Find("held");
  RecordingSink sink(daemon_->workers(), RecordingSink::Acknowledge::kAtOnce);
  ASSERT_TRUE(sink.Follow(Find("followed"), {}).ok());
  sink.AwaitRevision(1);
  for (int i = 0; i < 3; ++i) {
    now_ += absl::Hours(1);
    EXPECT_EQ(Sweep(), 0u);
    EXPECT_EQ(Sweep({.max_loaded_bytes = 1}), 0u);
  }
  MustApply(*held, AddTet());
  EXPECT_EQ(Find("held"), held);
  MustApply(*Find("followed"), AddTet());
  sink.AwaitRevision(2);
}

TEST_F(UnloadingTest, NoneIsUnloadedBeforeItsEditsAreOnDisk) {
  SessionPtr made = daemon_->NewSession("mesh", {.durability = SessionDurability::kAsync});
  const std::weak_ptr<Session> session = made;
  medium_.Hold();
  MustApply(*made, AddTet());
  const Memory memory = Remember(*made);
  made = nullptr;
  AwaitNobodyUses();
  EXPECT_EQ(Sweep(), 0u);
  EXPECT_FALSE(session.expired());
  medium_.Release();
  Unload();
  EXPECT_TRUE(session.expired());
  ExpectIdentical(Remember(*Find()).mesh, memory.mesh);
}

TEST_F(UnloadingTest, WhatCannotBeReadAgainStaysLoaded) {
  NewIdleSession("none", {.durability = SessionDurability::kNone});
  SessionPtr failed = daemon_->NewSession("failed");
  medium_.Hold();
  MustApply(*failed, AddTet());
  medium_.Fail(absl::UnavailableError("the disk is gone"));
  EXPECT_FALSE(failed->WaitUntilAcknowledged(1).ok());
  failed = nullptr;
  AwaitNobodyUses("failed");
  EXPECT_EQ(Sweep(), 0u);
  EXPECT_EQ(Look("failed")->revision(), 1);
  medium_.Fail(absl::OkStatus());
}

TEST_F(UnloadingTest, AnEmptySessionHoldsNothingAndStays) {
  daemon_->NewSession();
  AwaitNobodyUses();
  EXPECT_EQ(Sweep(), 0u);
}

TEST_F(UnloadingTest, NothingIsUnloadedWhileTheDaemonDrains) {
  NewIdleSession("mesh");
  registry().Drain();
  EXPECT_EQ(Sweep(), 0u);
  RecordingSink late(daemon_->workers(), RecordingSink::Acknowledge::kAtOnce);
  EXPECT_EQ(RefusalOf(late.Follow(Find(), {})),
            (Refusal{absl::StatusCode::kUnavailable, reason::kShuttingDown}));
}

// ---- Checkpoints ----

/// The revision of the checkpoint that is on the medium.
int64_t LastCheckpoint(Medium& medium) {
  const std::unique_ptr<Store> store = medium.Open();
  return (*store->OpenSession("mesh"))->ListCheckpoints()->back().revision;
}

TEST_F(UnloadingTest, ACheckpointComesFirstWhereThereIsMuchLog) {
  for (const uint64_t checkpoint_bytes : {uint64_t{1} << 30, uint64_t{80'000}}) {
    Restart({.checkpoint_bytes = checkpoint_bytes});
    SessionPtr session = daemon_->NewSession();
    MustApply(*session, {AddSomeVertices(1000)});  // some 24 KB
    ASSERT_TRUE(session->WaitUntilAcknowledged(1).ok());
    const Memory memory = Remember(*session);
    session = nullptr;
    Unload();
    ExpectSame(*Find(), memory);
    daemon_.reset();
    EXPECT_EQ(LastCheckpoint(medium_), checkpoint_bytes > 1'000'000 ? 0 : 1);
    Restart();
    ASSERT_TRUE(registry().Delete("mesh", "").ok());
  }
}

TEST_F(UnloadingTest, ACheckpointThatFailsIsTriedOnceAndKeepsNobodyLoaded) {
  Restart({.checkpoint_bytes = 80'000});
  SessionPtr session = daemon_->NewSession();
  MustApply(*session, {AddSomeVertices(1000)});
  ASSERT_TRUE(session->WaitUntilAcknowledged(1).ok());
  const Memory memory = Remember(*session);
  session = nullptr;
  medium_.Fail(absl::ResourceExhaustedError("the disk is full"));
  Unload();
  ExpectIdentical(Remember(*Find()).mesh, memory.mesh);
  medium_.Fail(absl::OkStatus());
}

}  // namespace
}  // namespace dynmesh::testing
