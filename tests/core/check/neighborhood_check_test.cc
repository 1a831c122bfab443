#include "core/check/neighborhood_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "core/check/local_check.h"
#include "core/edit/transaction.h"
#include "core/mesh/error.h"
#include "tests/support/count_down.h"
#include "tests/support/meshes.h"
#include "tests/support/oracle.h"
#include "tests/support/random_edits.h"

namespace dynmesh {
namespace {

using ::dynmesh::testing::AllMeshes;
using ::dynmesh::testing::Book;
using ::dynmesh::testing::Commit;
using ::dynmesh::testing::CountDown;
using ::dynmesh::testing::Describe;
using ::dynmesh::testing::ElementModel;
using ::dynmesh::testing::ExpectEqualsOracle;
using ::dynmesh::testing::HexGrid;
using ::dynmesh::testing::ModelOf;
using ::dynmesh::testing::RandomEditor;
using ::dynmesh::testing::TetGrid;
using ::dynmesh::testing::TetWheel;
using ::testing::IsEmpty;

CheckSettings With(CheckKind check, Severity severity) {
  CheckSettings settings;
  EXPECT_TRUE(settings.Set(check, {severity, TraitsOf(check).default_threshold}).ok());
  return settings;
}

absl::StatusOr<BatchResult> Apply(Mesh& mesh, const Edit& edit, const CheckSettings& settings,
                                  BatchOptions options = {}) {
  NeighborhoodCheck checker(settings);
  options.checker = &checker;
  return ApplyBatch(mesh, {edit}, options);
}

std::string Metadata(const absl::Status& status, absl::string_view key) {
  const auto detail = GetErrorDetail(status);
  return detail ? std::string(detail->Find(key)) : "";
}

/// Vertex 13 is the one in the middle of a block of 2 * 2 * 2.
const MoveVerticesEdit kTurnOver{{13}, {{-3, -3, -3}}};

TEST(NeighborhoodCheckTest, ABatchThatInvertsACellIsRefusedAndChangesNothing) {
  Mesh mesh = TetGrid(2, 2, 2);
  const std::string before = Describe(mesh);
  const auto result = Apply(mesh, kTurnOver, With(CheckKind::kInverted, Severity::kReject));
  EXPECT_EQ(result.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(ErrorReason(result.status()), reason::kCheckFailed);
  EXPECT_EQ(Metadata(result.status(), "check"), "inverted");
  EXPECT_EQ(Metadata(result.status(), "kind"), "cell");
  EXPECT_FALSE(Metadata(result.status(), "ids").empty());
  EXPECT_EQ(Metadata(result.status(), "threshold"), "-1e-09");
  EXPECT_EQ(Metadata(result.status(), "value").substr(0, 1), "-");
  EXPECT_EQ(Describe(mesh), before);
  ExpectEqualsOracle(mesh, ModelOf(mesh));
}

TEST(NeighborhoodCheckTest, AWarningRidesOnTheResultAndNamesWhatIsBad) {
  Mesh mesh = TetGrid(2, 2, 2);
  const auto result = Apply(mesh, kTurnOver, With(CheckKind::kInverted, Severity::kWarn));
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(mesh.revision(), 2);
  ASSERT_EQ(result->warnings.size(), 1u);
  const BatchWarning& warning = result->warnings[0];
  EXPECT_EQ(warning.name, "inverted");
  EXPECT_EQ(warning.kind, EntityKind::kCell);
  std::vector<Slot> inverted;
  mesh.slots(EntityKind::kCell).live().ForEach([&](Slot c) {
    if (**MeasureEntity(mesh, CheckKind::kInverted, CellId(c), WorkMeter::Unlimited()) < -1e-9) {
      inverted.push_back(c);
    }
  });
  EXPECT_EQ(warning.ids, inverted);
  EXPECT_EQ(warning.count, inverted.size());
  EXPECT_EQ(warning.values.size(), inverted.size());
}

TEST(NeighborhoodCheckTest, WhatWasBadElsewhereNeverRefuses) {
  Mesh mesh = TetGrid(4, 2, 2);
  ASSERT_TRUE(ApplyBatch(mesh, {MoveVerticesEdit{{0}, {{1.5, 1.5, 1.5}}}}, {}).ok());
  const CheckSettings settings = With(CheckKind::kInverted, Severity::kReject);
  const Slot far = mesh.slots(EntityKind::kVertex).limit() - 1;
  EXPECT_TRUE(Apply(mesh, MoveVerticesEdit{{far}, {{4.1, 2.1, 2.1}}}, settings).ok());
  EXPECT_EQ(ErrorReason(Apply(mesh, MoveVerticesEdit{{0}, {{1.6, 1.6, 1.6}}}, settings).status()),
            reason::kCheckFailed);
  EXPECT_TRUE(Apply(mesh, MoveVerticesEdit{{0}, {{0, 0, 0}}}, settings).ok());
}

TEST(NeighborhoodCheckTest, RemovalsAreLookedAtToo) {
  Mesh mesh = HexGrid(2, 2, 1);  // taking two opposite cells leaves an edge of two fans
  const CheckSettings settings = With(CheckKind::kEdgeLink, Severity::kReject);
  const std::string before = Describe(mesh);
  const auto refused = Apply(mesh, RemoveElementsEdit{EntityKind::kCell, {0, 3}}, settings);
  EXPECT_EQ(Metadata(refused.status(), "check"), "edge_link");
  EXPECT_EQ(Metadata(refused.status(), "value"), "2");
  EXPECT_EQ(Describe(mesh), before);
  EXPECT_TRUE(Apply(mesh, RemoveElementsEdit{EntityKind::kCell, {0, 1}}, settings).ok());
  Mesh alone = testing::OneTet();
  EXPECT_EQ(ErrorReason(Apply(alone, RemoveElementsEdit{EntityKind::kCell, {0}},
                              With(CheckKind::kIsolatedVertex, Severity::kReject))
                            .status()),
            reason::kCheckFailed);
}

TEST(NeighborhoodCheckTest, ASecondPageIsWelcomeAndAThirdIsNot) {
  Mesh mesh = Book(1);
  const CheckSettings settings = With(CheckKind::kEdgeFaces, Severity::kReject);
  ASSERT_TRUE(ApplyBatch(mesh, {AddVerticesEdit{{{7, 7, 7}, {8, 8, 9}}}}, {}).ok());
  EXPECT_TRUE(Apply(mesh, AddElementsEdit{ElementType::kTriangle, {1, 0, 3}}, settings).ok());
  const auto third = Apply(mesh, AddElementsEdit{ElementType::kTriangle, {1, 0, 4}}, settings);
  EXPECT_EQ(Metadata(third.status(), "ids"), absl::StrCat(mesh.FindEdge(VertexId(0), VertexId(1)).slot()));
}

TEST(NeighborhoodCheckTest, ADryRunIsCheckedLikeTheBatch) {
  Mesh mesh = TetGrid(2, 2, 2);
  const std::string before = Describe(mesh);
  const BatchOptions dry{.dry_run = true};
  EXPECT_FALSE(Apply(mesh, kTurnOver, With(CheckKind::kInverted, Severity::kReject), dry).ok());
  EXPECT_EQ(Apply(mesh, kTurnOver, With(CheckKind::kInverted, Severity::kWarn), dry)->warnings.size(), 1u);
  EXPECT_EQ(Describe(mesh), before);
}

TEST(NeighborhoodCheckTest, WithoutChecksNobodyLooks) {
  Mesh mesh = TetGrid(2, 2, 2);
  EXPECT_THAT(Apply(mesh, kTurnOver, CheckSettings(), {.max_work = 0})->warnings, IsEmpty());
}

TEST(NeighborhoodCheckTest, CheckingAHugeStarIsRefusedByItsWork) {
  Mesh mesh = TetWheel(400);
  const std::string before = Describe(mesh);
  const MoveVerticesEdit move{{0}, {{0.1, 0.2, 0.3}}};
  const CheckSettings settings = With(CheckKind::kVertexLink, Severity::kWarn);
  const auto refused = Apply(mesh, move, settings, {.max_work = 500});
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(Metadata(refused.status(), "limit"), "max_batch_work");
  EXPECT_EQ(Describe(mesh), before);
  EXPECT_TRUE(Apply(mesh, move, settings, {.max_work = 100'000}).ok());
}

TEST(NeighborhoodCheckTest, CheckingEndsWhenTheMeterSaysSo) {
  Mesh mesh = TetGrid(6, 6, 6);
  const std::string before = Describe(mesh);
  MoveVerticesEdit move;
  for (Slot v = 0; v < mesh.NumLive(EntityKind::kVertex); ++v) move.vertices.push_back(v);
  move.positions.resize(move.vertices.size());
  const CheckSettings settings = With(CheckKind::kVertexLink, Severity::kWarn);
  CountDown meter(10'000);
  EXPECT_EQ(Apply(mesh, move, settings, {.meter = meter}).status(), CountDown::error());
  EXPECT_EQ(meter.charges_after_end(), 0);
  EXPECT_EQ(Describe(mesh), before);
  EXPECT_TRUE(Apply(mesh, move, settings).ok());
}

TEST(NeighborhoodCheckTest, ManyFindingsAreCountedAndTheFirstOnesNamed) {
  Mesh mesh;
  AddVerticesEdit vertices;
  for (int i = 0; i < 3000; ++i) vertices.positions.push_back({double(i), 0, 0});
  const auto result = Apply(mesh, vertices, With(CheckKind::kIsolatedVertex, Severity::kWarn));
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->warnings[0].ids.size(), kMaxWarnedIds);
  EXPECT_EQ(result->warnings[0].count, 3000u);
}

// ---- What is touched ----

using Values = std::map<std::pair<CheckKind, EntityId>, double>;

Values AllValues(const Mesh& mesh) {
  Values values;
  for (CheckKind check : AllChecks()) {
    if (!IsLocal(check)) continue;
    for (EntityKind kind : kEntityKinds) {
      mesh.slots(kind).live().ForEach([&](Slot slot) {
        const auto value = MeasureEntity(mesh, check, {kind, slot}, WorkMeter::Unlimited());
        if (value->has_value()) values[{check, {kind, slot}}] = **value;
      });
    }
  }
  return values;
}

bool IsSame(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

bool IsTouched(const EntitySlots& touched, EntityId id) {
  const auto& slots = touched[Dimension(id.kind)];
  return std::binary_search(slots.begin(), slots.end(), id.slot);
}

/// Fails the test unless all entities of which a check says something else than before are touched.
void ExpectChangesAreTouched(const Mesh& mesh, const Values& before) {
  const auto touched = mesh.Touched(WorkMeter::Unlimited());
  ASSERT_TRUE(touched.ok());
  for (const auto& [key, value] : AllValues(mesh)) {
    const auto& [check, id] = key;
    const auto it = before.find(key);
    if (it != before.end() && IsSame(it->second, value)) continue;
    // Of two equal cells the newer one is touched, and tells.
    if (check == CheckKind::kDuplicate && id.kind == EntityKind::kCell) continue;
    EXPECT_TRUE(IsTouched(*touched, id))
        << TraitsOf(check).name << " of " << EntityKindName(id.kind) << " " << id.slot;
  }
}

TEST(TouchedTest, EveryEntityOfWhichACheckSaysSomethingElseIsTouched) {
  for (uint32_t seed = 1; seed <= 30; ++seed) {
    SCOPED_TRACE(::testing::Message() << "seed " << seed);
    Mesh mesh;
    ElementModel model;
    RandomEditor editor(mesh, model, seed, {.max_vertices = 10});
    for (int edit = 0; edit < 30; ++edit) editor.Edit();
    Commit(mesh);
    for (int batch = 0; batch < 15; ++batch) {
      const Values before = AllValues(mesh);
      mesh.BeginBatch();
      for (int edit = 0; edit < 1 + batch % 4; ++edit) editor.Edit();
      ExpectChangesAreTouched(mesh, before);
      Commit(mesh);
    }
  }
}

/// Looks whether what operators change is touched.
class TouchChecker : public BatchChecker {
 public:
  explicit TouchChecker(const Mesh& mesh) : before_(AllValues(mesh)) {}
  absl::Status Check(const Mesh& mesh, WorkMeter&, std::vector<BatchWarning>&) override {
    ExpectChangesAreTouched(mesh, before_);
    return absl::OkStatus();
  }

 private:
  const Values before_;
};

TEST(TouchedTest, SoIsEveryEntityThatOperatorsChange) {
  std::mt19937 rng(3);
  for (auto& [name, mesh] : AllMeshes()) {
    SCOPED_TRACE(name);
    for (int round = 0; round < 12; ++round) {
      std::vector<Slot> edges;
      mesh.slots(EntityKind::kEdge).live().ForEach([&](Slot e) { edges.push_back(e); });
      std::shuffle(edges.begin(), edges.end(), rng);
      const EdgeNames some{{edges[0], edges[1]}, {}};
      const std::vector<Edit> operators = {SplitEdgesEdit{some, {}, {}, {}},
                                           CollapseEdgesEdit{some, {}, {}, {}}, SwapEdgesEdit{some, {}}};
      TouchChecker checker(mesh);
      const BatchOptions options{.skip_refused = true, .checker = &checker};
      EXPECT_TRUE(ApplyBatch(mesh, {operators[round % 3]}, options).ok());
    }
  }
}

TEST(TouchedTest, FarEntitiesAreNotTouchedAndLiveOnesOnlyAreNamed) {
  Mesh mesh = TetGrid(6, 2, 2);
  mesh.BeginBatch();
  ASSERT_TRUE(mesh.MoveVertex(VertexId(0), {-0.1, 0, 0}).ok());
  ASSERT_TRUE(mesh.RemoveElement(CellId(1)).ok());
  const EntitySlots touched = *mesh.Touched(WorkMeter::Unlimited());
  for (EntityKind kind : kEntityKinds) {
    EXPECT_FALSE(touched[Dimension(kind)].empty());
    EXPECT_LT(touched[Dimension(kind)].size(), mesh.NumLive(kind) / 5);
    for (Slot slot : touched[Dimension(kind)]) EXPECT_TRUE(mesh.IsLive({kind, slot}));
  }
  CountDown meter(3);
  EXPECT_EQ(mesh.Touched(meter).status(), CountDown::error());
  mesh.Rollback();
  mesh.BeginBatch();
  EXPECT_THAT((*mesh.Touched(WorkMeter::Unlimited()))[3], IsEmpty());
  mesh.Rollback();
}

}  // namespace
}  // namespace dynmesh
