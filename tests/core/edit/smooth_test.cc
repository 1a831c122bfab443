// Smoothing: where vertices go, what stays, and that a batch of it leaves a sound mesh.

#include "core/edit/smooth.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "core/edit/geometry.h"
#include "core/edit/transaction.h"
#include "core/mesh/validate.h"
#include "core/mesh/vector.h"
#include "tests/support/meshes.h"
#include "tests/support/oracle.h"

namespace dynmesh::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

/// Moves every inner vertex by up to `extent` along each axis.
void Shake(Mesh& mesh, double extent, uint32_t seed) {
  std::mt19937 rng(seed);
  std::uniform_real_distribution<double> shift(-extent, extent);
  mesh.slots(EntityKind::kVertex).live().ForEach([&](Slot slot) {
    const VertexId v(slot);
    if (mesh.IsOnBoundary(v)) return;
    const Point to = mesh.Position(v) + Point{shift(rng), shift(rng), shift(rng)};
    EXPECT_TRUE(mesh.MoveVertex(v, to).ok());
  });
  Commit(mesh);
}

std::vector<Slot> AllVertices(const Mesh& mesh) {
  std::vector<Slot> slots;
  mesh.slots(EntityKind::kVertex).live().ForEach([&](Slot v) { slots.push_back(v); });
  return slots;
}

double LeastQuality(const Mesh& mesh) {
  double least = 1;
  mesh.slots(EntityKind::kCell).live().ForEach([&](Slot c) {
    std::vector<Point> points;
    for (VertexId v : mesh.Vertices(CellId(c))) points.push_back(mesh.Position(v));
    least =
        std::min(least, Orientation(mesh.Type(CellId(c)), points) * Quality(mesh.Type(CellId(c)), points));
  });
  return least;
}

absl::StatusOr<EditResult> Smooth(Mesh& mesh, const SmoothVerticesEdit& edit,
                                  const BatchOptions& options = {}) {
  DYNMESH_ASSIGN_OR_RETURN(BatchResult result, ApplyBatch(mesh, {Edit(edit)}, options));
  return result.results[0];
}

/// Six triangles round vertex 0, which is off the centre and above their plane.
Mesh Tent() {
  Mesh mesh;
  EXPECT_TRUE(mesh.AddVertex({0.5, 0, 0.25}).ok());
  for (int i = 0; i < 6; ++i) {
    const double angle = i * std::acos(0.5);
    EXPECT_TRUE(mesh.AddVertex({std::cos(angle), std::sin(angle), 0}).ok());
  }
  for (Slot i = 0; i < 6; ++i) Add(mesh, ElementType::kTriangle, {0, 1 + i, 1 + (i + 1) % 6});
  Commit(mesh);
  return mesh;
}

TEST(SmoothTest, LaplacianGoesToTheMeanOfTheNeighbours) {
  Mesh mesh = Tent();
  SmoothVerticesEdit edit{{0}, {.method = SmoothMethod::kLaplacian, .factor = 0.5}};
  ASSERT_TRUE(Smooth(mesh, edit).ok());
  EXPECT_NEAR(mesh.Position(VertexId(0))[0], 0.25, 1e-12);
  EXPECT_NEAR(mesh.Position(VertexId(0))[2], 0.125, 1e-12);
  edit.rule.factor = 1;
  ASSERT_TRUE(Smooth(mesh, edit).ok());
  for (double coordinate : mesh.Position(VertexId(0))) EXPECT_NEAR(coordinate, 0, 1e-12);
}

TEST(SmoothTest, BoundaryVerticesStayUnlessAskedFor) {
  Mesh mesh = TetGrid(2, 2, 2);
  const ElementModel before = ModelOf(mesh);
  std::vector<Slot> boundary;
  mesh.Boundary(EntityKind::kVertex).ForEach([&](Slot v) { boundary.push_back(v); });
  const auto stayed = Smooth(mesh, {boundary, {.method = SmoothMethod::kLaplacian}});
  ASSERT_TRUE(stayed.ok()) << stayed.status();
  EXPECT_EQ(stayed->num_moved, 0);
  EXPECT_EQ(ModelOf(mesh), before);
  const auto moved = Smooth(mesh, {boundary, {.method = SmoothMethod::kLaplacian, .move_boundary = true}});
  ASSERT_TRUE(moved.ok());
  EXPECT_GT(moved->num_moved, 0);
}

TEST(SmoothTest, TangentialMovesKeepFlatSidesFlatAndStraightEdgesStraight) {
  Mesh mesh = Disk(6);
  for (Slot i = 0; i < 6; ++i) {
    const double angle = i * std::acos(0.5);
    ASSERT_TRUE(mesh.MoveVertex(VertexId(1 + i), {std::cos(angle), std::sin(angle), 7}).ok());
  }
  ASSERT_TRUE(mesh.MoveVertex(VertexId(0), {0.3, 0.2, 7}).ok());
  Commit(mesh);
  const auto result =
      Smooth(mesh, {AllVertices(mesh),
                    {.method = SmoothMethod::kLaplacian, .move_boundary = true, .tangential = true},
                    3});
  ASSERT_TRUE(result.ok());
  EXPECT_GT(result->num_moved, 0);
  for (Slot v : AllVertices(mesh)) EXPECT_NEAR(mesh.Position(VertexId(v))[2], 7, 1e-12);
}

TEST(SmoothTest, TangentialMovesKeepSharpEdgesAndCornersOfSolids) {
  for (SmoothMethod method : {SmoothMethod::kLaplacian, SmoothMethod::kGuarded, SmoothMethod::kOptimizing}) {
    Mesh mesh = TetGrid(2, 2, 2);
    const Mesh before = mesh.Clone();
    const auto outside = [](const Point& p) { return p[0] < 0 || p[1] < 0 || p[2] < 0; };
    SmoothVerticesEdit edit;
    mesh.slots(EntityKind::kVertex).live().ForEach([&](Slot v) { edit.vertices.push_back(v); });
    edit.rule = {.method = method, .move_boundary = true, .tangential = true};
    edit.iterations = 3;
    ASSERT_TRUE(ApplyBatch(mesh, {edit}, {}).ok());
    for (Slot v : edit.vertices) {
      EXPECT_FALSE(outside(mesh.Position(VertexId(v)))) << v;
      int extremes = 0;
      for (double x : before.Position(VertexId(v))) extremes += x == 0 || x == 2;
      if (extremes >= 2) {
        EXPECT_EQ(mesh.Position(VertexId(v)), before.Position(VertexId(v))) << v;
      }
    }
  }
}

TEST(SmoothTest, GuardedAndOptimizingNeverLowerTheLeastQuality) {
  for (SmoothMethod method : {SmoothMethod::kGuarded, SmoothMethod::kOptimizing}) {
    for (uint32_t seed = 1; seed <= 5; ++seed) {
      SCOPED_TRACE(::testing::Message() << "seed " << seed << " method " << static_cast<int>(method));
      Mesh mesh = TetGrid(3, 3, 3);
      Shake(mesh, 0.2, seed);
      double least = LeastQuality(mesh);
      for (int round = 0; round < 3; ++round) {
        ASSERT_TRUE(Smooth(mesh, {AllVertices(mesh), {.method = method}}).ok());
        EXPECT_GE(LeastQuality(mesh), least - 1e-12);
        least = LeastQuality(mesh);
      }
      EXPECT_THAT(Validate(mesh), IsEmpty());
      ExpectEqualsOracle(mesh, ModelOf(mesh));
    }
  }
}

TEST(SmoothTest, OptimizingRescuesASliver) {
  Mesh mesh = TetGrid(2, 2, 2);
  const VertexId centre(13);
  ASSERT_TRUE(mesh.MoveVertex(centre, {1.9, 1.9, 1.98}).ok());
  Commit(mesh);
  const double before = LeastQuality(mesh);
  ASSERT_TRUE(Smooth(mesh, {{centre.slot()}, {.method = SmoothMethod::kOptimizing}, 20}).ok());
  EXPECT_GT(LeastQuality(mesh), 3 * before);
}

TEST(SmoothTest, LaplacianNeverTurnsOverUnlessAllowed) {
  // A vertex whose neighbours lie round a dent: their mean is outside of it.
  Mesh mesh;
  const Point corners[] = {{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0.5, 0.5, 0}, {0, 4, 0}, {0.25, 0.25, 0}};
  for (const Point& corner : corners) ASSERT_TRUE(mesh.AddVertex(corner).ok());
  for (Slot i = 0; i < 5; ++i) Add(mesh, ElementType::kTriangle, {i, (i + 1) % 5, 5});
  Commit(mesh);
  const SmoothVerticesEdit edit{{5}, {.method = SmoothMethod::kLaplacian}};
  Mesh guarded = mesh.Clone();
  ASSERT_TRUE(Smooth(guarded, edit).ok());
  EXPECT_LT(guarded.Position(VertexId(5))[0], 0.5);
  SmoothVerticesEdit anything = edit;
  anything.limits.keep_orientation = false;
  ASSERT_TRUE(Smooth(mesh, anything).ok());
  EXPECT_NEAR(mesh.Position(VertexId(5))[0], 1.7, 1e-12);
}

TEST(SmoothTest, RefusedBatchesChangeNothing) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  Mesh mesh = TetGrid(2, 2, 2);
  const std::string before = Describe(mesh);
  const SmoothVerticesEdit bad[] = {{{13}, {.factor = 0}},
                                    {{13}, {.factor = nan}},
                                    {{13}, {.factor = 1.5}},
                                    {{13}, {}, 0},
                                    {{13}, {}, kMaxSmoothIterations + 1},
                                    {{13}, {}, 1, {.min_quality = nan}},
                                    {{13, 99}, {}}};
  for (const SmoothVerticesEdit& edit : bad) {
    EXPECT_FALSE(Smooth(mesh, edit).ok());
    EXPECT_EQ(Describe(mesh), before);
  }
}

TEST(SmoothTest, GoneVerticesArePassedOverOnceWhereAskedFor) {
  Mesh mesh = TetGrid(2, 2, 2);
  Shake(mesh, 0.2, 7);
  BatchOptions options;
  options.skip_refused = true;
  const auto result = Smooth(mesh, {{99, 13}, {}, 3}, options);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_THAT(result->skipped, ElementsAre(0));
  EXPECT_EQ(result->num_moved, 1);
}

TEST(SmoothTest, EveryKindOfMeshIsSmoothedSoundly) {
  for (SmoothMethod method : {SmoothMethod::kLaplacian, SmoothMethod::kGuarded, SmoothMethod::kOptimizing}) {
    for (NamedMesh& named : AllMeshes()) {
      SCOPED_TRACE(named.name);
      const SmoothRule rule{.method = method, .move_boundary = true, .tangential = true};
      ASSERT_TRUE(Smooth(named.mesh, {AllVertices(named.mesh), rule, 2}).ok());
      EXPECT_THAT(Validate(named.mesh), IsEmpty());
      ExpectEqualsOracle(named.mesh, ModelOf(named.mesh));
    }
  }
}

}  // namespace
}  // namespace dynmesh::testing
