// Repairs of a session: one revision or none, once for each request id, ended when nobody waits.

#include "server/session/repair_session.h"

#include <atomic>

#include "tests/session/session_support.h"
#include "tests/support/meshes.h"
#include "tests/support/oracle.h"

namespace dynmesh::testing {
namespace {

using ::testing::ElementsAre;

void Ignore(size_t) {}

/// Says stop at the n-th check.
class StopAt final : public StopSignal {
 public:
  explicit StopAt(int checks) : left_(checks) {}
  absl::Status Check() const override {
    return left_-- > 0 ? absl::OkStatus() : absl::CancelledError("enough");
  }

 private:
  mutable int left_;
};

class RepairSessionTest : public ::testing::Test {
 protected:
  /// A session that holds the elements of a mesh.
  SessionPtr SessionOf(const Mesh& mesh) {
    const SessionPtr session = daemon_.NewSession();
    MustApply(*session, EditsOf(mesh));
    return session;
  }

  static std::shared_ptr<const RepairOutcome> MustRepair(Session& session, const RepairRequest& request) {
    const auto outcome = RepairSession(session, request, StopSignal::Never(), Ignore);
    EXPECT_TRUE(outcome.ok()) << outcome.status();
    return outcome.ok() ? *outcome : nullptr;
  }

  Daemon daemon_;
};

TEST_F(RepairSessionTest, AllStepsAreOneRevisionThatFollowersSeeAndASecondRepairMakesNone) {
  const SessionPtr session = SessionOf(BowTie());
  RecordingSink sink(daemon_.workers(), RecordingSink::Acknowledge::kAtOnce);
  ASSERT_TRUE(sink.Follow(session, {}).ok());
  std::vector<size_t> done;
  const RepairRequest request{{RemoveDuplicatesStep{{.isolated_vertices = true}}, SplitNonManifoldStep{},
                               FillHolesStep{8}, OrientStep{}}};
  const auto outcome =
      RepairSession(*session, request, StopSignal::Never(), [&](size_t n) { done.push_back(n); });
  ASSERT_TRUE(outcome.ok()) << outcome.status();
  EXPECT_EQ((*outcome)->revision, 2);
  EXPECT_THAT(done, ElementsAre(0, 1, 2, 3, 4));
  ASSERT_EQ((*outcome)->reports.size(), 4u);
  EXPECT_EQ((*outcome)->reports[1].Count(RepairFinding::kSplit), 1u);
  EXPECT_EQ((*outcome)->reports[2].Count(RepairFinding::kFilled), 2u);
  EXPECT_EQ((*outcome)->checksum, ChecksumOf(*session));
  EXPECT_EQ((*outcome)->counts[0], session->num_live(EntityKind::kVertex));
  sink.AwaitRevision(2);
  EXPECT_EQ(sink.mirror_checksum(), ChecksumOf(*session));
  const auto again = MustRepair(*session, request);
  EXPECT_EQ(again->revision, 2);
  EXPECT_EQ(session->revision(), 2);
  EXPECT_EQ(again->checksum, (*outcome)->checksum);
}

TEST_F(RepairSessionTest, ADryRunTellsWhatWouldBeAndChangesNothing) {
  const SessionPtr session = SessionOf(BowTie());
  const Checksum before = ChecksumOf(*session);
  RepairRequest request{{SplitNonManifoldStep{}}};
  request.validate_only = true;
  const auto dry = MustRepair(*session, request);
  EXPECT_EQ(dry->revision, 1);
  EXPECT_EQ(dry->counts[0], 8u);
  EXPECT_EQ(ChecksumOf(*session), before);
  request.validate_only = false;
  EXPECT_EQ(MustRepair(*session, request)->checksum, dry->checksum);
}

TEST_F(RepairSessionTest, ARetryIsToldTheFirstAnswerAndAnotherRequestOfThatIdIsRefused) {
  const SessionPtr session = SessionOf(BowTie());
  RepairRequest request{{SplitNonManifoldStep{}}, 1, "once"};
  const auto first = MustRepair(*session, request);
  MustApply(*session, {AddSomeVertices(1)});
  EXPECT_EQ(MustRepair(*session, request), first);  // though the session is not at revision 1 any more
  EXPECT_EQ(session->revision(), 3);
  request.steps = {FillHolesStep{9}};
  EXPECT_EQ(RefusalOf(RepairSession(*session, request, StopSignal::Never(), Ignore)),
            (Refusal{absl::StatusCode::kInvalidArgument, reason::kRequestIdReused}));
}

TEST_F(RepairSessionTest, WhatIsRefusedOrEndedChangesNothing) {
  const SessionPtr session = SessionOf(HexGrid(12, 12, 12));
  const Checksum before = ChecksumOf(*session);
  RepairRequest request{{OrientStep{}, SplitNonManifoldStep{}, WeldStep{-1}}};
  const auto expect_refused = [&](absl::StatusCode code, const std::string& why, const StopSignal& stop) {
    const auto outcome = RepairSession(*session, request, stop, Ignore);
    EXPECT_EQ(RefusalOf(outcome), (Refusal{code, why})) << outcome.status();
    EXPECT_EQ(session->revision(), 1);
    EXPECT_EQ(ChecksumOf(*session), before);
  };
  expect_refused(absl::StatusCode::kInvalidArgument, reason::kBadArgument, StopSignal::Never());
  request.if_revision = 5;
  expect_refused(absl::StatusCode::kAborted, reason::kRevisionMismatch, StopSignal::Never());
  request.if_revision = absl::nullopt;
  request.steps = {WeldStep{1.5}, OrientStep{}};
  for (int checks : {0, 1, 5, 12}) expect_refused(absl::StatusCode::kCancelled, "", StopAt(checks));
  request.steps.assign(kMaxRepairSteps + 1, OrientStep{});
  expect_refused(absl::StatusCode::kInvalidArgument, reason::kBadArgument, StopSignal::Never());
}

TEST_F(RepairSessionTest, ASessionThatIsFullIsNotMadeLarger) {
  const auto fill = [](Session& session) {
    for (int i = 0; i < 400; ++i) MustApply(session, EditsOf(BowTie()));
  };
  const SessionPtr large = daemon_.NewSession("large");
  fill(*large);
  Limits limits;
  limits.max_session_bytes = large->Info()->memory_bytes + 20'000;
  Daemon small(limits);
  const SessionPtr session = small.NewSession();
  fill(*session);
  const int64_t revision = session->revision();
  RepairRequest request{{SplitNonManifoldStep{}}};
  const auto outcome = RepairSession(*session, request, StopSignal::Never(), Ignore);
  EXPECT_EQ(RefusalOf(outcome), (Refusal{absl::StatusCode::kResourceExhausted, reason::kLimitExceeded}));
  EXPECT_EQ(MetadataOf(outcome.status(), "limit"), "max_session_bytes");
  EXPECT_EQ(session->revision(), revision);
  EXPECT_EQ(MustRepair(*large, request)->reports[0].Count(RepairFinding::kSplit), 400u);
}

TEST_F(RepairSessionTest, ADeletedSessionIsNotRepaired) {
  const SessionPtr session = SessionOf(BowTie());
  ASSERT_TRUE(session->Delete("").ok());
  EXPECT_EQ(RefusalOf(RepairSession(*session, {{OrientStep{}}}, StopSignal::Never(), Ignore)),
            (Refusal{absl::StatusCode::kNotFound, reason::kSessionDeleted}));
}

}  // namespace
}  // namespace dynmesh::testing
