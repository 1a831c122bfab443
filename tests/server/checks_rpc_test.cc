#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "absl/strings/ascii.h"
#include "core/check/check.h"
#include "server/session/check_session.h"
#include "tests/server/server_support.h"
#include "tests/support/meshes.h"

namespace dynmesh::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::Not;

struct Report {
  grpc::Status status;
  int64_t revision = -1;
  std::vector<std::string> phases;
  std::map<v1::CheckKind, std::vector<Slot>> ids;
  std::map<v1::CheckKind, std::vector<double>> values;
  v1::CheckSummary summary;

  const v1::CheckTally& TallyOf(v1::CheckKind check) const {
    for (const v1::CheckTally& tally : summary.tallies()) {
      if (tally.setting().check() == check) return tally;
    }
    ADD_FAILURE() << v1::CheckKind_Name(check) << " was not made";
    return v1::CheckTally::default_instance();
  }
};

v1::CheckSetting Setting(v1::CheckKind check, v1::CheckSeverity severity = v1::CHECK_SEVERITY_REJECT) {
  v1::CheckSetting setting;
  setting.set_check(check);
  setting.set_severity(severity);
  return setting;
}

class ChecksRpcTest : public ServerTest {
 protected:
  ChecksRpcTest() { EXPECT_TRUE(CreateSession("mesh").ok()); }

  Report Check(v1::CheckSessionRequest request) {
    PatientContext context;
    request.set_session("mesh");
    const auto stream = checks().CheckSession(&context, request);
    Report report;
    v1::CheckSessionResponse response;
    while (stream->Read(&response)) {
      EXPECT_TRUE(report.revision == -1 || report.revision == response.revision());
      EXPECT_FALSE(report.summary.has_topology()) << "the summary is the last message";
      report.revision = response.revision();
      Take(response, report);
    }
    report.status = stream->Finish();
    return report;
  }

  grpc::Status UpdateChecks(const std::vector<v1::CheckSetting>& settings) {
    PatientContext context;
    v1::UpdateSessionRequest request;
    request.mutable_session()->set_name("mesh");
    for (const auto& setting : settings)
      *request.mutable_session()->mutable_settings()->add_checks() = setting;
    request.mutable_update_mask()->add_paths("settings.checks");
    v1::UpdateSessionResponse response;
    return sessions().UpdateSession(&context, request, &response);
  }

 private:
  static void Take(const v1::CheckSessionResponse& response, Report& report) {
    if (response.has_progress()) report.phases.push_back(response.progress().phase());
    if (response.has_summary()) report.summary = response.summary();
    if (!response.has_findings()) return;
    const auto ids = Array<Slot>(response.findings().ids());
    const auto values = Array<double>(response.findings().values());
    EXPECT_EQ(ids.size(), values.size());
    auto& all_ids = report.ids[response.findings().check()];
    auto& all_values = report.values[response.findings().check()];
    all_ids.insert(all_ids.end(), ids.begin(), ids.end());
    all_values.insert(all_values.end(), values.begin(), values.end());
  }
};

v1::ApplyEditsRequest MoveBatch(Slot vertex, const Point& to) {
  v1::ApplyEditsRequest batch = Batch("mesh");
  v1::MoveVertices* move = batch.add_edits()->mutable_move_vertices();
  move->set_ids(Bytes<Slot>({vertex}));
  move->set_positions(Bytes<Point>({to}));
  return batch;
}

TEST(CheckKindTest, NumbersOnTheWireAreThoseOfCore) {
  for (CheckKind check : AllChecks()) {
    const std::string name = v1::CheckKind_Name(static_cast<v1::CheckKind>(check));
    std::string expected = "CHECK_KIND_" + std::string(TraitsOf(check).name);
    for (char& c : expected) c = absl::ascii_toupper(c);
    EXPECT_EQ(name, expected);
  }
  EXPECT_EQ(v1::CheckKind_MAX, kNumChecks);
}

TEST_F(ChecksRpcTest, AReportTellsProgressFindingsAndTheWhole) {
  ASSERT_TRUE(Import("mesh", BowTie()).ok());
  const Report report = Check({});
  ASSERT_TRUE(report.status.ok()) << report.status.error_message();
  EXPECT_EQ(report.revision, 1);
  EXPECT_THAT(report.phases, Not(IsEmpty()));
  EXPECT_EQ(report.summary.tallies_size(), kNumChecks);
  EXPECT_THAT(report.ids.at(v1::CHECK_KIND_VERTEX_LINK), ElementsAre(0));
  EXPECT_THAT(report.values.at(v1::CHECK_KIND_VERTEX_LINK), ElementsAre(2));
  EXPECT_EQ(report.TallyOf(v1::CHECK_KIND_VERTEX_LINK).measured(), 7u);
  EXPECT_EQ(report.TallyOf(v1::CHECK_KIND_HOLES).bad(), 1u);
  EXPECT_EQ(report.summary.topology().surface().pieces(), 2u);
  EXPECT_EQ(report.summary.topology().surface().holes(), 2u);
  EXPECT_EQ(report.summary.topology().euler_characteristic(), 1);
}

TEST_F(ChecksRpcTest, OnlyTheChecksAskedForAreMadeWithTheirThresholds) {
  ASSERT_TRUE(Import("mesh", TetGrid(2, 2, 2)).ok());
  v1::CheckSessionRequest request;
  *request.add_checks() = Setting(v1::CHECK_KIND_MIN_DIHEDRAL);
  request.mutable_checks(0)->set_threshold(360);
  *request.add_checks() = Setting(v1::CHECK_KIND_QUALITY, v1::CHECK_SEVERITY_OFF);
  request.set_max_findings(3);
  const Report report = Check(request);
  ASSERT_EQ(report.summary.tallies_size(), 1);
  EXPECT_EQ(report.TallyOf(v1::CHECK_KIND_MIN_DIHEDRAL).bad(), 48u);
  EXPECT_NEAR(report.TallyOf(v1::CHECK_KIND_MIN_DIHEDRAL).lowest(), 45, 1e-9);
  EXPECT_EQ(report.TallyOf(v1::CHECK_KIND_MIN_DIHEDRAL).setting().threshold(), 360);
  EXPECT_EQ(report.TallyOf(v1::CHECK_KIND_MIN_DIHEDRAL).setting().severity(), v1::CHECK_SEVERITY_REJECT);
  EXPECT_EQ(report.ids.at(v1::CHECK_KIND_MIN_DIHEDRAL).size(), 3u);
}

TEST_F(ChecksRpcTest, ManyFindingsComeInPiecesThatFitAMessage) {
  const Mesh grid = HexGrid(32, 32, 32);
  ASSERT_TRUE(Import("mesh", grid, nullptr, 20'000).ok());
  v1::CheckSessionRequest request;
  *request.add_checks() = Setting(v1::CHECK_KIND_QUALITY);
  request.mutable_checks(0)->set_threshold(1);
  ASSERT_TRUE(Apply(MoveBatch(0, {-0.01, 0, 0})).ok());
  request.set_max_findings(kMaxFindings);
  *request.add_checks() = Setting(v1::CHECK_KIND_FACE_CELLS);
  request.mutable_checks(1)->set_threshold(0);
  const Report report = Check(request);
  ASSERT_TRUE(report.status.ok()) << report.status.error_message();
  EXPECT_EQ(report.ids.at(v1::CHECK_KIND_FACE_CELLS).size(), grid.NumLive(EntityKind::kFace));
  EXPECT_EQ(report.ids.at(v1::CHECK_KIND_QUALITY).size(), 1u);
}

TEST_F(ChecksRpcTest, SomeEntitiesAreLookedAtAlone) {
  ASSERT_TRUE(Import("mesh", BowTie()).ok());
  v1::CheckSessionRequest request;
  *request.mutable_selection() = SelectIds({1, 0});
  request.set_kind(v1::ENTITY_KIND_VERTEX);
  const Report report = Check(request);
  ASSERT_TRUE(report.status.ok()) << report.status.error_message();
  EXPECT_FALSE(report.summary.has_topology());
  EXPECT_EQ(report.TallyOf(v1::CHECK_KIND_VERTEX_LINK).measured(), 2u);
  *request.mutable_selection() = SelectIds({99});
  ExpectError(Check(request).status, grpc::NOT_FOUND, reason::kUnknownEntity, "ids", "99");
  request.set_kind(v1::ENTITY_KIND_UNSPECIFIED);
  ExpectError(Check(request).status, grpc::INVALID_ARGUMENT, reason::kBadEntityKind);
}

TEST_F(ChecksRpcTest, WhatIsAskedWrongIsRefused) {
  const auto refused = [&](v1::CheckSetting setting) {
    v1::CheckSessionRequest request;
    *request.add_checks() = setting;
    ExpectError(Check(request).status, grpc::INVALID_ARGUMENT, reason::kBadArgument, "field", "checks");
    ExpectError(UpdateChecks({setting}), grpc::INVALID_ARGUMENT, reason::kBadArgument, "field", "checks");
  };
  refused(Setting(v1::CHECK_KIND_UNSPECIFIED));
  refused(Setting(static_cast<v1::CheckKind>(99)));
  refused(Setting(v1::CHECK_KIND_QUALITY, static_cast<v1::CheckSeverity>(99)));
  for (double threshold : {-1.0, 2.0, std::nan(""), double{INFINITY}}) {
    v1::CheckSetting setting = Setting(v1::CHECK_KIND_QUALITY);
    setting.set_threshold(threshold);
    refused(setting);
  }
  v1::CheckSessionRequest request;
  request.set_max_findings(kMaxFindings + 1);
  ExpectError(Check(request).status, grpc::INVALID_ARGUMENT, reason::kBadArgument, "field", "max_findings");
  const v1::CheckSetting twice = Setting(v1::CHECK_KIND_QUALITY);
  ExpectError(UpdateChecks({twice, twice}), grpc::INVALID_ARGUMENT, reason::kBadArgument, "field", "checks");
  ExpectError(UpdateChecks({Setting(v1::CHECK_KIND_GENUS)}), grpc::INVALID_ARGUMENT, reason::kBadArgument,
              "field", "checks");
  EXPECT_EQ(GetSession("mesh").settings().checks_size(), 0);
}

TEST_F(ChecksRpcTest, ASessionThatIsNotThereHasNoReport) {
  ASSERT_TRUE(DeleteSession("mesh").ok());
  ExpectError(Check({}).status, grpc::NOT_FOUND, reason::kSessionNotFound);
}

TEST_F(ChecksRpcTest, SettingsAreToldAndHoldForTheNextBatch) {
  ASSERT_TRUE(Import("mesh", TetGrid(2, 2, 2)).ok());
  const v1::Session before = GetSession("mesh");
  ASSERT_TRUE(UpdateChecks({Setting(v1::CHECK_KIND_INVERTED)}).ok());
  v1::Session after = GetSession("mesh");
  ASSERT_EQ(after.settings().checks_size(), 1);
  EXPECT_EQ(after.settings().checks(0).check(), v1::CHECK_KIND_INVERTED);
  EXPECT_EQ(after.settings().checks(0).severity(), v1::CHECK_SEVERITY_REJECT);
  EXPECT_EQ(after.settings().checks(0).threshold(), -1e-9);
  EXPECT_NE(after.etag(), before.etag());
  EXPECT_EQ(after.revision(), 1);
  ExpectError(Apply(MoveBatch(13, {-3, -3, -3})), grpc::FAILED_PRECONDITION, reason::kCheckFailed, "check",
              "inverted");
  after = GetSession("mesh");
  EXPECT_EQ(after.revision(), 1);
  EXPECT_EQ(after.checksum().geometry(), before.checksum().geometry());
}

TEST_F(ChecksRpcTest, WarningsRideOnTheReply) {
  ASSERT_TRUE(Import("mesh", TetGrid(2, 2, 2)).ok());
  ASSERT_TRUE(UpdateChecks({Setting(v1::CHECK_KIND_INVERTED, v1::CHECK_SEVERITY_UNSPECIFIED)}).ok());
  const v1::ApplyEditsResponse response = MustApply(MoveBatch(13, {-3, -3, -3}));
  ASSERT_EQ(response.warnings_size(), 1);
  const v1::Warning& warning = response.warnings(0);
  EXPECT_EQ(warning.reason(), reason::kCheckFailed);
  EXPECT_EQ(warning.check(), v1::CHECK_KIND_INVERTED);
  EXPECT_EQ(warning.kind(), v1::ENTITY_KIND_CELL);
  EXPECT_EQ(warning.threshold(), -1e-9);
  const auto ids = Array<Slot>(warning.ids());
  const auto values = Array<double>(warning.values());
  ASSERT_EQ(ids.size(), warning.count());
  ASSERT_EQ(values.size(), ids.size());
  for (double value : values) EXPECT_LT(value, 0);
  const Report report = Check({});
  EXPECT_EQ(report.ids.at(v1::CHECK_KIND_INVERTED), ids);
}

TEST_F(ChecksRpcTest, AReportThatNobodyWantsEnds) {
  ASSERT_TRUE(Import("mesh", HexGrid(32, 32, 32), nullptr, 20'000).ok());
  PatientContext context;
  v1::CheckSessionRequest request;
  request.set_session("mesh");
  *request.add_checks() = Setting(v1::CHECK_KIND_FACE_CELLS);
  request.mutable_checks(0)->set_threshold(0);
  request.set_max_findings(kMaxFindings);  // more than is sent before it is read
  const auto stream = checks().CheckSession(&context, request);
  v1::CheckSessionResponse response;
  ASSERT_TRUE(stream->Read(&response));
  EXPECT_TRUE(response.has_progress());
  context.TryCancel();
  while (stream->Read(&response)) {
  }
  EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::CANCELLED);
  server().Drain(absl::ZeroDuration());  // returns although the report was not finished
}

TEST_F(ChecksRpcTest, OthersEditWhileAReportIsMade) {
  ASSERT_TRUE(Import("mesh", HexGrid(24, 24, 24), nullptr, 20'000).ok());
  PatientContext context;
  v1::CheckSessionRequest request;
  request.set_session("mesh");
  const auto stream = checks().CheckSession(&context, request);
  v1::CheckSessionResponse response;
  ASSERT_TRUE(stream->Read(&response));  // the copy is made
  EXPECT_EQ(MustApply(MoveBatch(0, {-0.5, 0, 0})).revision(), 2);
  bool has_summary = response.has_summary();
  do {
    EXPECT_EQ(response.revision(), 1);
    has_summary |= response.has_summary();
  } while (stream->Read(&response));
  EXPECT_TRUE(has_summary);
  EXPECT_TRUE(stream->Finish().ok());
}

}  // namespace
}  // namespace dynmesh::testing
