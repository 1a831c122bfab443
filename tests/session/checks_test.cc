#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "core/check/local_check.h"
#include "server/session/check_session.h"
#include "tests/session/session_support.h"
#include "tests/support/meshes.h"
#include "tests/support/oracle.h"

namespace dynmesh::testing {
namespace {

using ::testing::ElementsAre;

CheckSettings With(CheckKind check, Severity severity) {
  CheckSettings settings;
  EXPECT_TRUE(settings.Set(check, {severity, TraitsOf(check).default_threshold}).ok());
  return settings;
}

/// Vertex 13 is the one in the middle of a block of 2 * 2 * 2.
std::vector<Edit> TurnOver() { return {MoveVerticesEdit{{13}, {{-3, -3, -3}}}}; }

std::string DescriptionOf(const Session& session) {
  return *session.ReadAs<std::string>(
      [](const SessionView& view) -> absl::StatusOr<std::string> { return Describe(view.mesh); });
}

/// Notes that progress was told.
class Counter : public ReportMonitor {
 public:
  void OnProgress(absl::string_view, uint64_t, uint64_t) override { ++reports_; }
  int reports() const { return reports_; }

 private:
  int reports_ = 0;
};

absl::StatusOr<CheckReport> Check(const Session& session, const CheckQuestion& question = {},
                                  const QueryTerms& terms = {}) {
  if (question.part.has_value()) return CheckPartOfSession(session, question, terms);
  Counter monitor;
  int64_t copied = -1;
  auto report = CheckWholeSession(session, question, terms, monitor, [&](int64_t r) { copied = r; });
  EXPECT_EQ(copied, session.revision());
  EXPECT_TRUE(!report.ok() || monitor.reports() > 0);
  return report;
}

const Tally& TallyOf(const CheckReport& report, CheckKind check) {
  for (const Tally& tally : report.tallies) {
    if (tally.check == check) return tally;
  }
  ADD_FAILURE() << TraitsOf(check).name << " was not made";
  return report.tallies[0];
}

/// Wants to stop after so many questions.
class StopAfter : public StopSignal {
 public:
  explicit StopAfter(int questions) : left_(questions) {}
  absl::Status Check() const override {
    return left_-- > 0 ? absl::OkStatus() : absl::CancelledError("stop");
  }

 private:
  mutable int left_;
};

TEST(ChecksTest, ASessionRefusesWhatItsSettingsRejectAndStaysAsItWas) {
  Daemon daemon;
  const SessionPtr session =
      daemon.NewSession("mesh", {.checks = With(CheckKind::kInverted, Severity::kReject)});
  MustApply(*session, EditsOf(TetGrid(2, 2, 2)));
  const std::string before = DescriptionOf(*session);
  const Checksum checksum = ChecksumOf(*session);
  for (bool validate_only : {false, true}) {
    const auto refused = session->Apply(TurnOver(), {.request_id = "a", .validate_only = validate_only});
    EXPECT_EQ(RefusalOf(refused), (Refusal{absl::StatusCode::kFailedPrecondition, reason::kCheckFailed}));
    EXPECT_EQ(MetadataOf(refused.status(), "check"), "inverted");
  }
  EXPECT_EQ(DescriptionOf(*session), before);
  EXPECT_EQ(ChecksumOf(*session), checksum);
  EXPECT_EQ(session->revision(), 1);
}

TEST(ChecksTest, AnUpdateChangesWhatIsCheckedAndTheEtagButNoRevision) {
  Daemon daemon;
  const SessionPtr session = daemon.NewSession();
  MustApply(*session, EditsOf(TetGrid(2, 2, 2)));
  const std::string etag = session->Info()->etag;
  const CheckSettings settings = With(CheckKind::kInverted, Severity::kWarn);
  ASSERT_TRUE(session->Update({.checks = settings}, etag).ok());
  EXPECT_EQ(session->Info()->settings.checks, settings);
  EXPECT_NE(session->Info()->etag, etag);
  EXPECT_EQ(session->revision(), 1);
  EXPECT_EQ(session->Update({.checks = CheckSettings()}, etag).code(), absl::StatusCode::kAborted);
  const auto warnings = WarningsOf(*MustApply(*session, TurnOver()));
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_EQ(warnings[0].warning, WarningKind::kCheckFailed);
  EXPECT_EQ(warnings[0].check, CheckKind::kInverted);
  EXPECT_EQ(warnings[0].ids.size(), warnings[0].values.size());
  ASSERT_TRUE(session->Update({.checks = CheckSettings()}, "").ok());
  EXPECT_TRUE(MustApply(*session, TurnOver())->warnings.empty());
}

TEST(ChecksTest, UpdatingRelationsLeavesChecksAlone) {
  Daemon daemon;
  const CheckSettings settings = With(CheckKind::kQuality, Severity::kWarn);
  const SessionPtr session = daemon.NewSession("mesh", {.checks = settings});
  ASSERT_TRUE(session->StoreRelations({kStorableRelations[0]}, "").ok());
  EXPECT_EQ(session->Info()->settings.checks, settings);
  ASSERT_TRUE(session->Update({.checks = CheckSettings()}, "").ok());
  EXPECT_EQ(session->Info()->stored_relations.size(), 1u);
}

TEST(ChecksTest, CreatingAgainWithOtherChecksIsAnotherRequest) {
  Daemon daemon;
  const SessionSettings settings{.checks = With(CheckKind::kQuality, Severity::kWarn)};
  ASSERT_TRUE(daemon.registry().Create("twice", settings, "id").ok());
  EXPECT_TRUE(daemon.registry().Create("twice", settings, "id").ok());
  EXPECT_EQ(RefusalOf(daemon.registry().Create("twice", {}, "id")),
            (Refusal{absl::StatusCode::kInvalidArgument, reason::kRequestIdReused}));
}

TEST(ChecksTest, AReportMakesAllChecksWithTheSettingsOfTheSession) {
  Daemon daemon;
  CheckSettings settings;
  ASSERT_TRUE(settings.Set(CheckKind::kMinDihedral, {Severity::kReject, 30}).ok());
  const SessionPtr session = daemon.NewSession("mesh", {.checks = settings});
  MustApply(*session, EditsOf(TetGrid(2, 2, 2)));
  const auto report = Check(*session);
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_EQ(report->revision, 1);
  EXPECT_EQ(report->tallies.size(), size_t{kNumChecks});
  EXPECT_EQ(TallyOf(*report, CheckKind::kMinDihedral).setting, (CheckSetting{Severity::kReject, 30}));
  EXPECT_EQ(TallyOf(*report, CheckKind::kQuality).setting.severity, Severity::kWarn);
  EXPECT_EQ(report->topology->shells.pieces, 1u);
}

TEST(ChecksTest, PartOfASessionIsCheckedInPlace) {
  Daemon daemon;
  const SessionPtr session = daemon.NewSession();
  MustApply(*session, EditsOf(BowTie()));
  CheckQuestion question;
  question.part = {EntityKind::kVertex, {std::vector<Slot>{3, 0}}};
  const auto report = Check(*session, question);
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_FALSE(report->topology.has_value());
  EXPECT_EQ(TallyOf(*report, CheckKind::kVertexLink).num_measured, 2u);
  EXPECT_THAT(TallyOf(*report, CheckKind::kVertexLink).findings[0].slots, ElementsAre(0));
  question.part->selection.which = std::vector<Slot>{77};
  EXPECT_EQ(RefusalOf(Check(*session, question)),
            (Refusal{absl::StatusCode::kNotFound, reason::kUnknownEntity}));
}

TEST(ChecksTest, NobodyGoesOnForACallerWhoIsGone) {
  Daemon daemon;
  const SessionPtr session = daemon.NewSession();
  MustApply(*session, EditsOf(TetGrid(6, 6, 6)));
  for (int questions : {0, 1, 5}) {
    StopAfter stop(questions);
    EXPECT_TRUE(absl::IsCancelled(Check(*session, {}, {stop}).status())) << questions;
  }
}

TEST(ChecksTest, ABatchWhoseChecksNobodyWaitsForIsRefused) {
  Daemon daemon;
  const SessionPtr session =
      daemon.NewSession("mesh", {.checks = With(CheckKind::kVertexLink, Severity::kWarn)});
  MustApply(*session, EditsOf(TetGrid(8, 8, 8)));
  std::vector<Edit> moves = {MoveVerticesEdit()};
  auto& move = std::get<MoveVerticesEdit>(moves[0]);
  for (Slot v = 0; v < session->num_live(EntityKind::kVertex); ++v) move.vertices.push_back(v);
  move.positions.resize(move.vertices.size());
  const Checksum before = ChecksumOf(*session);
  StopAfter stop(2);
  EXPECT_TRUE(absl::IsCancelled(session->Apply(moves, {}, stop).status()));
  EXPECT_EQ(ChecksumOf(*session), before);
  EXPECT_EQ(session->revision(), 1);
  EXPECT_TRUE(session->Apply(moves, {}).ok());
}

TEST(ChecksTest, ThousandsOfEqualCellsAreTooMuchWork) {
  constexpr int kMany = 6000;
  Daemon daemon;
  const SessionPtr session = daemon.NewSession();
  AddElementsEdit cells{ElementType::kTetrahedron, {}};
  for (int i = 0; i < kMany; ++i) {
    for (Slot k : {0, 1, 2, 3}) cells.vertices.push_back(kNewVertex | k);
  }
  MustApply(*session, {AddVerticesEdit{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}, cells});
  CheckQuestion question;
  question.checks = With(CheckKind::kDuplicate, Severity::kWarn);
  const auto refused = Check(*session, question);
  EXPECT_EQ(RefusalOf(refused), (Refusal{absl::StatusCode::kResourceExhausted, reason::kLimitExceeded}));
  EXPECT_EQ(MetadataOf(refused.status(), "limit"), "max_check_work");
  question.checks = With(CheckKind::kQuality, Severity::kWarn);
  EXPECT_TRUE(Check(*session, question).ok());
}

TEST(ChecksTest, FindingsCountAgainstWhatWaitsToBeRead) {
  Daemon daemon;
  const SessionPtr session = daemon.NewSession();
  MustApply(*session, EditsOf(TetGrid(6, 6, 6)));
  CheckQuestion question;
  question.checks.emplace();
  ASSERT_TRUE(question.checks->Set(CheckKind::kQuality, {Severity::kWarn, 1}).ok());
  question.max_findings = kMaxFindings;
  Lease lease(std::make_shared<Budget>("max_answer_bytes", 1000));
  EXPECT_EQ(MetadataOf(Check(*session, question, {StopSignal::Never(), &lease}).status(), "limit"),
            "max_answer_bytes");
  question.max_findings = 0;
  const auto counted = Check(*session, question, {StopSignal::Never(), &lease});
  ASSERT_TRUE(counted.ok()) << counted.status();
  EXPECT_EQ(TallyOf(*counted, CheckKind::kQuality).num_bad, session->num_live(EntityKind::kCell));
}

}  // namespace
}  // namespace dynmesh::testing
