#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <string>
#include <vector>

#include "core/check/local_check.h"
#include "core/check/report.h"
#include "tests/support/count_down.h"
#include "tests/support/meshes.h"
#include "tests/support/random_edits.h"

namespace dynmesh {
namespace {

using ::dynmesh::testing::BowTie;
using ::dynmesh::testing::CountDown;
using ::dynmesh::testing::ElementModel;
using ::dynmesh::testing::OneTet;
using ::dynmesh::testing::RandomEditor;
using ::dynmesh::testing::TetGrid;
using ::testing::ElementsAre;

/// Remembers the phases and how far each got.
class Phases : public ReportMonitor {
 public:
  void OnProgress(absl::string_view phase, uint64_t done, uint64_t total) override {
    EXPECT_LE(done, total);
    if (names_.empty() || names_.back() != phase) names_.emplace_back(phase);
  }
  const std::vector<std::string>& names() const { return names_; }

 private:
  std::vector<std::string> names_;
};

ReportOptions AllOn() {
  ReportOptions options;
  for (CheckKind check : AllChecks()) {
    EXPECT_TRUE(options.checks.Set(check, {Severity::kWarn, TraitsOf(check).default_threshold}).ok());
  }
  return options;
}

CheckReport ReportOf(const Mesh& mesh, const ReportOptions& options) {
  Phases phases;
  const auto report = CheckMesh(mesh, options, WorkMeter::Unlimited(), phases);
  EXPECT_TRUE(report.ok()) << report.status();
  return *report;
}

const Tally& TallyOf(const CheckReport& report, CheckKind check) {
  for (const Tally& tally : report.tallies) {
    if (tally.check == check) return tally;
  }
  ADD_FAILURE() << TraitsOf(check).name << " was not made";
  return report.tallies[0];
}

TEST(ReportTest, ABowTieIsFoundWithItsVertex) {
  const CheckReport report = ReportOf(BowTie(), AllOn());
  EXPECT_EQ(report.revision, 1);
  EXPECT_EQ(report.tallies.size(), size_t{kNumChecks});
  const Tally& links = TallyOf(report, CheckKind::kVertexLink);
  EXPECT_EQ(links.num_measured, 7u);
  EXPECT_EQ(links.num_bad, 1u);
  EXPECT_EQ(links.highest, 2);
  EXPECT_THAT(links.findings[0].slots, ElementsAre(0));
  EXPECT_THAT(links.findings[0].values, ElementsAre(2));
  EXPECT_EQ(TallyOf(report, CheckKind::kHoles).highest, 2);
  EXPECT_EQ(TallyOf(report, CheckKind::kHoles).num_bad, 1u);
  EXPECT_EQ(TallyOf(report, CheckKind::kComponents).num_bad, 0u);
}

TEST(ReportTest, OnlyWhatIsAskedForIsMade) {
  ReportOptions options;
  ASSERT_TRUE(options.checks.Set(CheckKind::kQuality, {Severity::kReject, 1}).ok());
  options.max_findings = 5;
  const Mesh mesh = TetGrid(2, 2, 2);
  const CheckReport report = ReportOf(mesh, options);
  ASSERT_EQ(report.tallies.size(), 1u);
  EXPECT_EQ(report.tallies[0].setting.severity, Severity::kReject);
  EXPECT_EQ(report.tallies[0].findings[3].slots.size(), 5u);
  EXPECT_EQ(report.tallies[0].findings[3].count, mesh.NumLive(EntityKind::kCell));
}

TEST(ReportTest, EveryValueOfRandomMeshesIsThatOfItsEntity) {
  for (uint32_t seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE(::testing::Message() << "seed " << seed);
    Mesh mesh;
    ElementModel model;
    RandomEditor editor(mesh, model, seed);
    for (int edit = 0; edit < 60; ++edit) editor.Edit();
    const CheckReport report = ReportOf(mesh, AllOn());
    for (const Tally& tally : report.tallies) {
      if (!IsLocal(tally.check)) continue;
      std::map<EntityId, double> bad, told;
      for (EntityKind kind : kEntityKinds) {
        mesh.slots(kind).live().ForEach([&](Slot slot) {
          const auto value = *MeasureEntity(mesh, tally.check, {kind, slot}, WorkMeter::Unlimited());
          if (value && Fails(tally.check, *value, tally.setting.threshold)) bad[{kind, slot}] = *value;
        });
        const Findings& findings = tally.findings[Dimension(kind)];
        for (size_t i = 0; i < findings.slots.size(); ++i)
          told[{kind, findings.slots[i]}] = findings.values[i];
      }
      EXPECT_EQ(told, bad) << TraitsOf(tally.check).name;
      EXPECT_EQ(tally.num_bad, bad.size());
    }
  }
}

TEST(ReportTest, ProgressGoesThroughAllKindsAndEndsWithTheWhole) {
  Phases phases;
  ASSERT_TRUE(CheckMesh(OneTet(), AllOn(), WorkMeter::Unlimited(), phases).ok());
  EXPECT_THAT(phases.names(), ElementsAre("vertex", "edge", "face", "cell", "topology"));
}

TEST(ReportTest, EndsWhereItsMeterSaysSo) {
  const Mesh mesh = TetGrid(2, 2, 2);
  for (int64_t steps : {0, 100, 3000}) {
    CountDown meter(steps);
    Phases phases;
    EXPECT_EQ(CheckMesh(mesh, AllOn(), meter, phases).status(), CountDown::error());
    EXPECT_EQ(meter.charges_after_end(), 0);
  }
}

}  // namespace
}  // namespace dynmesh
