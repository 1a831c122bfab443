// Sessions that begin with a mesh.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>
#include <memory>
#include <utility>

#include "core/delta/diff.h"
#include "tests/core/archive/archive_support.h"
#include "tests/session/medium.h"
#include "tests/session/session_support.h"

namespace dynmesh::testing {
namespace {

using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr absl::Time kCommitTime = absl::FromUnixSeconds(1'000'000'000);

/// A session that was edited at random, and what may be made of it.
class CreateFromTest : public ::testing::Test {
 protected:
  ~CreateFromTest() override {
    source_.reset();
    copy_.reset();
    daemon_.reset();
  }

  void Edit(Session& session, int count) {
    for (int i = 0; i < count; ++i) {
      const auto result = session.Apply(batches_.Next(), {.as_of_revision = session.revision()});
      result.ok() ? batches_.Applied(**result) : batches_.Refused();
    }
    EXPECT_TRUE(session.WaitUntilAcknowledged(session.revision()).ok());
  }

  static Mesh Copy(const Session& session) {
    Mesh copy;
    const absl::Status read = session.Read([&](const SessionView& view) {
      copy = view.mesh.Clone();
      return absl::OkStatus();
    });
    EXPECT_TRUE(read.ok()) << read;
    return copy;
  }

  SessionSeed SeedOf(const Session& session, SessionDurability durability) const {
    return {.name = "copy",
            .settings = {.durability = durability},
            .mesh = Copy(session),
            .commit_time = kCommitTime};
  }

  void MakeSource() {
    source_ = daemon_->NewSession("source", {.durability = SessionDurability::kNone});
    Edit(*source_, 60);
  }

  void MakeCopy(SessionDurability durability) {
    const auto info = daemon_->registry().CreateFrom(SeedOf(*source_, durability));
    ASSERT_TRUE(info.ok()) << info.status();
    EXPECT_EQ(info->revision, source_->revision());
    EXPECT_EQ(info->durable_revision, source_->revision());
    EXPECT_EQ(info->update_time, kCommitTime);
    EXPECT_EQ(info->settings.durability, durability);
    copy_ = *daemon_->registry().Find("copy");
  }

  void Restart() {
    source_.reset();
    copy_.reset();
    daemon_.reset();
    daemon_ = std::make_unique<Daemon>(Limits(), medium_.Open());
  }

  Refusal RefusalOfCopy(SessionSeed seed) {
    return RefusalOf(daemon_->registry().CreateFrom(std::move(seed)));
  }

  Medium medium_;
  std::unique_ptr<Daemon> daemon_ = std::make_unique<Daemon>(Limits(), medium_.Open());
  RandomBatches batches_{61};
  SessionPtr source_;
  SessionPtr copy_;
};

TEST_F(CreateFromTest, ItIsTheMeshToTheLastIdAndStampAndGoesOnAsThatWould) {
  MakeSource();
  MakeCopy(SessionDurability::kNone);
  ExpectIdentical(Copy(*copy_), Copy(*source_));
  EXPECT_NE(copy_->uid(), source_->uid());
  for (int i = 0; i < 20; ++i) {
    const std::vector<dynmesh::Edit> edits = batches_.Next();
    const ApplyOptions options{.as_of_revision = source_->revision()};
    const auto result = source_->Apply(edits, options);
    EXPECT_EQ(RefusalOf(copy_->Apply(edits, options)), RefusalOf(result));
    result.ok() ? batches_.Applied(**result) : batches_.Refused();
  }
  ExpectIdentical(Copy(*copy_), Copy(*source_));
}

TEST_F(CreateFromTest, DifferencesFromEarlierRevisionsAreTheSame) {
  MakeSource();
  const int64_t before = source_->revision();
  Edit(*source_, 10);
  MakeCopy(SessionDurability::kNone);
  const Mesh source = Copy(*source_), copy = Copy(*copy_);
  for (int64_t from = 0; from <= source.revision(); ++from) {
    EXPECT_TRUE(Diff(copy, from) == Diff(source, from)) << "from revision " << from;
  }
  RecordingSink sink(daemon_->workers(), RecordingSink::Acknowledge::kAtOnce);
  ASSERT_TRUE(sink.Follow(copy_, {}).ok());
  sink.AwaitRevision(copy_->revision());
  EXPECT_EQ(sink.mirror_checksum(), ChecksumOf(*source_));
  EXPECT_EQ(RefusalOf(copy_->MoveInHistory(HistoryMove::kUndo, {})).reason, reason::kNothingToUndo);
  const auto checked = copy_->Apply({AddSomeVertices(1)}, {.as_of_revision = before});
  EXPECT_TRUE(checked.ok()) << checked.status();
}

TEST_F(CreateFromTest, OneThatIsDurableIsThereAfterARestartAsAreItsEdits) {
  MakeSource();
  MakeCopy(SessionDurability::kSync);
  const Mesh at_first = Copy(*copy_);
  Restart();
  copy_ = *daemon_->registry().Find("copy");
  { const AccessGrant loaded = copy_->access().Acquire(AccessMode::kRead); }
  ExpectIdentical(Copy(*copy_), at_first);
  EXPECT_EQ(copy_->Info()->update_time, kCommitTime);
  Edit(*copy_, 20);
  const Mesh later = Copy(*copy_);
  Restart();
  copy_ = *daemon_->registry().Find("copy");
  { const AccessGrant loaded = copy_->access().Acquire(AccessMode::kRead); }
  ExpectIdentical(Copy(*copy_), later);
}

TEST_F(CreateFromTest, ARetryGetsTheFirstAnswerAfterARestartToo) {
  MakeSource();
  const auto seed = [&, mesh = Copy(*source_)] {
    return SessionSeed{.name = "copy", .mesh = mesh.Clone(), .request_id = "id", .fingerprint = 7};
  };
  const auto first = daemon_->registry().CreateFrom(seed());
  ASSERT_TRUE(first.ok()) << first.status();
  Edit(**daemon_->registry().Find("copy"), 5);
  EXPECT_EQ(daemon_->registry().CreateFrom(seed())->etag, first->etag);
  Restart();
  const auto again = daemon_->registry().CreateFrom(seed());
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->uid, first->uid);
  EXPECT_EQ(again->revision, first->revision);
  SessionSeed other = seed();
  other.fingerprint = 8;
  EXPECT_EQ(RefusalOfCopy(std::move(other)),
            (Refusal{absl::StatusCode::kInvalidArgument, reason::kRequestIdReused}));
}

TEST_F(CreateFromTest, ItStoresTheRelationsThatItsSettingsName) {
  MakeSource();
  ASSERT_TRUE(source_->StoreRelations({kStorableRelations[0], kStorableRelations[1]}, "").ok());
  SessionSeed seed = SeedOf(*source_, SessionDurability::kNone);
  seed.settings.stored_relations = {kStorableRelations[1]};
  const auto info = daemon_->registry().CreateFrom(std::move(seed));
  ASSERT_TRUE(info.ok()) << info.status();
  EXPECT_EQ(info->settings.stored_relations, std::vector<Relation>{kStorableRelations[1]});
}

TEST_F(CreateFromTest, DuplicatesAreTreatedAsInTheMesh) {
  Mesh mesh(MeshOptions{DuplicatePolicy::kRefuse, {}});
  const auto info = daemon_->registry().CreateFrom({.name = "copy", .mesh = std::move(mesh)});
  ASSERT_TRUE(info.ok()) << info.status();
  EXPECT_EQ(info->settings.duplicates, DuplicatePolicy::kRefuse);
  EXPECT_EQ((*daemon_->registry().Find("copy"))->duplicates(), DuplicatePolicy::kRefuse);
}

TEST_F(CreateFromTest, NamesAreAsOfAnySession) {
  MakeSource();
  SessionSeed taken = SeedOf(*source_, SessionDurability::kNone);
  taken.name = "source";
  EXPECT_EQ(RefusalOfCopy(std::move(taken)),
            (Refusal{absl::StatusCode::kAlreadyExists, reason::kSessionExists}));
  SessionSeed bad = SeedOf(*source_, SessionDurability::kNone);
  bad.name = "-";
  EXPECT_EQ(RefusalOfCopy(std::move(bad)),
            (Refusal{absl::StatusCode::kInvalidArgument, reason::kBadSessionName}));
}

TEST_F(CreateFromTest, AMeshThatIsMoreThanASessionMayHoldIsRefused) {
  MakeSource();
  Limits few;
  few.max_vertices = 2;
  Limits small;
  small.max_session_bytes = 1000;
  for (const auto& [limits, name] : {std::pair(few, "max_vertices"), std::pair(small, "max_session_bytes")}) {
    Daemon other(limits);
    const auto refused = other.registry().CreateFrom(SeedOf(*source_, SessionDurability::kDefault));
    EXPECT_EQ(RefusalOf(refused), (Refusal{absl::StatusCode::kResourceExhausted, reason::kLimitExceeded}));
    EXPECT_EQ(MetadataOf(refused.status(), "limit"), name);
    EXPECT_THAT(other.registry().ListAfter("", 10), IsEmpty());
  }
}

TEST_F(CreateFromTest, FromThenOnTheLimitsAreThoseOfTheDaemon) {
  Mesh mesh(MeshOptions{{}, MeshLimits{{1, 1, 1, 1}}});
  Limits limits;
  limits.max_vertices = 5;
  Daemon other(limits);
  ASSERT_TRUE(other.registry().CreateFrom({.name = "copy", .mesh = std::move(mesh)}).ok());
  const SessionPtr session = *other.registry().Find("copy");
  MustApply(*session, {AddSomeVertices(5)});
  EXPECT_EQ(RefusalOf(session->Apply({AddSomeVertices(1)}, {})).code, absl::StatusCode::kResourceExhausted);
}

TEST_F(CreateFromTest, WhileOneWaitsForTheDiskOthersAreMadeAndThoseOfItsNameWait) {
  MakeSource();
  medium_.Hold();
  auto first = std::async(std::launch::async, [&] {
    return daemon_->registry().CreateFrom(SeedOf(*source_, SessionDurability::kSync)).status();
  });
  auto second = std::async(std::launch::async, [&] {
    return daemon_->registry().CreateFrom(SeedOf(*source_, SessionDurability::kNone)).status();
  });
  daemon_->NewSession("other", {.durability = SessionDurability::kNone});
  medium_.Release();
  const absl::Status statuses[] = {first.get(), second.get()};
  EXPECT_NE(statuses[0].ok(), statuses[1].ok());
  const Refusal exists{absl::StatusCode::kAlreadyExists, reason::kSessionExists};
  EXPECT_EQ(RefusalOf(statuses[0].ok() ? statuses[1] : statuses[0]), exists);
}

TEST_F(CreateFromTest, WithoutAStoreNoneIsDurable) {
  Daemon other;
  const auto refused = other.registry().CreateFrom(
      {.name = "copy", .settings = {.durability = SessionDurability::kSync}, .mesh = Mesh()});
  EXPECT_EQ(RefusalOf(refused), (Refusal{absl::StatusCode::kFailedPrecondition, reason::kNoStore}));
}

TEST_F(CreateFromTest, WhatCannotBeStoredIsNotThereNorAfterARestart) {
  MakeSource();
  medium_.FailSyncs(absl::UnavailableError("the disk is full"));
  EXPECT_FALSE(daemon_->registry().CreateFrom(SeedOf(*source_, SessionDurability::kSync)).ok());
  EXPECT_THAT(daemon_->registry().ListAfter("", 10), SizeIs(1));  // the source
  medium_.FailSyncs(absl::OkStatus());
  Restart();
  EXPECT_THAT(daemon_->registry().ListAfter("", 10), IsEmpty());
}

}  // namespace
}  // namespace dynmesh::testing
