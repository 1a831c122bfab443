#include "core/spatial/spatial_index.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "core/mesh/error.h"
#include "tests/core/spatial/places.h"
#include "tests/support/count_down.h"
#include "tests/support/meshes.h"
#include "tests/support/random_edits.h"

namespace dynmesh::testing {
namespace {

TEST(FrameTest, BoxesThatMeetInOnePlaceStillMeet) {
  std::mt19937 rng(1);
  std::uniform_real_distribution<> uniform(-1, 1);
  for (double scale : {1e-300, 1.0, 1e300}) {
    const Frame frame(Box{{-scale, -scale, 0}, {scale, scale, scale}});
    for (int i = 0; i < 1000; ++i) {
      Box box{{uniform(rng) * scale, uniform(rng) * scale, uniform(rng)}, {9 * scale, 9 * scale, 1e308}};
      Box touching{{-1e308, -1e308, -1e308}, box.low};
      EXPECT_TRUE(Meet(frame.Round(box), frame.Round(touching)));
      touching.high[i % 3] = -8 * scale;  // a float tells these apart
      EXPECT_EQ(Meet(frame.Round(box), frame.Round(touching)), Meet(box, touching));
    }
  }
}

TEST(SpatialIndexTest, AnswersAreThoseOfBruteForce) {
  for (const NamedMesh& named : AllMeshes()) {
    SCOPED_TRACE(named.name);
    std::vector<SpatialIndex> indices = NewIndices();
    CatchUpAll(named.mesh, indices);
    ExpectSameAnswers(named.mesh, indices, 1, 40);
  }
}

TEST(SpatialIndexTest, AnEmptyMeshHasNothingAnywhere) {
  Mesh mesh;
  std::vector<SpatialIndex> indices = NewIndices();
  CatchUpAll(mesh, indices);
  ExpectSameAnswers(mesh, indices, 1, 5);
  AddVertices(mesh, 3);
  Add(mesh, ElementType::kTriangle, {0, 1, 2});
  Commit(mesh);
  CatchUpAll(mesh, indices);
  ExpectSameAnswers(mesh, indices, 2, 5);
}

TEST(SpatialIndexTest, KeptCurrentUnderRandomEditsItAnswersAsANewOne) {
  for (uint32_t seed = 0; seed < 4; ++seed) {
    SCOPED_TRACE(seed);
    Mesh mesh;
    ElementModel model;
    RandomEditor editor(mesh, model, seed, {.max_vertices = 40});
    std::vector<SpatialIndex> indices = NewIndices();
    for (int batch = 0; batch < 60; ++batch) {
      const int edits = 1 + editor.Uniform(batch % 10 == 0 ? 60 : 4);
      for (int i = 0; i < edits; ++i) editor.Edit();
      Commit(mesh);
      if (editor.Uniform(3) == 0) continue;  // an index may miss some revisions
      CatchUpAll(mesh, indices);
      ExpectSameAnswers(mesh, indices, seed * 100 + batch, 2);
      if (::testing::Test::HasFailure()) return;
    }
  }
}

TEST(SpatialIndexTest, ASlotThatIsUsedAgainIsFoundWhereItIsNow) {
  Mesh mesh = TetGrid(2, 2, 2);
  std::vector<SpatialIndex> indices = NewIndices();
  CatchUpAll(mesh, indices);
  const std::vector<VertexId> corners(mesh.Vertices(CellId(0)).begin(), mesh.Vertices(CellId(0)).end());
  ASSERT_TRUE(mesh.RemoveElement(CellId(0)).ok());
  Commit(mesh);
  AddVertices(mesh, 4);
  const Slot first = mesh.slots(EntityKind::kVertex).limit() - 4;
  EXPECT_EQ(Add(mesh, ElementType::kTetrahedron, {first, first + 1, first + 2, first + 3}), CellId(0));
  Commit(mesh);
  CatchUpAll(mesh, indices);
  ExpectSameAnswers(mesh, indices, 5, 40);
}

TEST(SpatialIndexTest, FewChangesAreEnteredAndManyArePackedAnew) {
  Mesh mesh = TetGrid(12, 12, 12);
  SpatialIndex cells(EntityKind::kCell);
  ASSERT_TRUE(cells.CatchUp(mesh, WorkMeter::Unlimited()).ok());
  const size_t live = mesh.NumLive(EntityKind::kCell);
  EXPECT_EQ(cells.num_entries(), live);
  const VertexId inner(6 * 13 * 13 + 6 * 13 + 6);
  ASSERT_TRUE(mesh.MoveVertex(inner, {6.1, 6.2, 6.3}).ok());
  Commit(mesh);
  CountDown meter(1000);
  ASSERT_TRUE(cells.CatchUp(mesh, meter).ok());
  EXPECT_EQ(cells.num_entries(), live + 24);
  const auto move_all = [&](double by) {
    for (Slot v = 0; v < mesh.NumLive(EntityKind::kVertex); ++v) {
      Point position = mesh.Position(VertexId(v));
      position[0] += by;
      ASSERT_TRUE(mesh.MoveVertex(VertexId(v), position).ok());
    }
    Commit(mesh);
    ASSERT_TRUE(cells.CatchUp(mesh, WorkMeter::Unlimited()).ok());
  };
  move_all(1);
  EXPECT_EQ(cells.num_entries(), live);
  for (int i = 0; i < 2000; ++i) {
    ASSERT_TRUE(mesh.MoveVertex(inner, {6.1, 6.2, 6 + 1e-4 * i}).ok());
    Commit(mesh);
    ASSERT_TRUE(cells.CatchUp(mesh, WorkMeter::Unlimited()).ok());
    ASSERT_LE(cells.num_entries(), 2 * (live + 1024));
  }
}

TEST(SpatialIndexTest, RolledBackEditsLeaveNoTrace) {
  Mesh mesh = HybridOfFour();
  std::vector<SpatialIndex> indices = NewIndices();
  CatchUpAll(mesh, indices);
  mesh.BeginBatch();
  ASSERT_TRUE(mesh.MoveVertex(VertexId(0), {50, 50, 50}).ok());
  ASSERT_TRUE(mesh.RemoveElement(CellId(1)).ok());
  mesh.Rollback();
  Add(mesh, ElementType::kWireEdge, {0, 7});
  Commit(mesh);
  CatchUpAll(mesh, indices);
  ExpectSameAnswers(mesh, indices, 6, 20);
}

TEST(SpatialIndexTest, AVertexMayMoveFarBeyondWhereTheIndexBegan) {
  Mesh mesh = TetGrid(2, 2, 2);
  std::vector<SpatialIndex> indices = NewIndices();
  CatchUpAll(mesh, indices);
  for (double far : {1e6, -1e140, 1e300}) {
    ASSERT_TRUE(mesh.MoveVertex(VertexId(26), {far, 2, 2}).ok());
    Commit(mesh);
    CatchUpAll(mesh, indices);
    const Box there{{far, 0, 0}, {far, 9, 9}};
    for (EntityKind kind : kEntityKinds) {
      SpatialSearch search(mesh, indices[Dimension(kind)], WorkMeter::Unlimited());
      EXPECT_EQ(*search.InBox(there), BruteInBox(mesh, kind, there));
    }
    SpatialSearch vertices(mesh, indices[0], WorkMeter::Unlimited());
    EXPECT_EQ(vertices.NearestVertices({far, 3, 2}, 2)->front().vertex, VertexId(26));
  }
}

/// Adds a row of vertices at x = first, first + 1, ... in steps of `step`.
void AddRow(Mesh& mesh, int first, int last, double step) {
  for (int i = first; i < last; ++i) ASSERT_TRUE(mesh.AddVertex({i * step, 0, 0}).ok());
  Commit(mesh);
}

int64_t StepsToFind(const Mesh& mesh, const SpatialIndex& vertices, const Point& place) {
  CountDown meter(1'000'000);
  EXPECT_EQ(SpatialSearch(mesh, vertices, meter).InBox({place, place})->size(), 1u);
  return 1'000'000 - meter.left();
}

TEST(SpatialIndexTest, WhatBeganEmptyIsPackedForWhatComes) {
  Mesh mesh;
  SpatialIndex vertices(EntityKind::kVertex);
  ASSERT_TRUE(vertices.CatchUp(mesh, WorkMeter::Unlimited()).ok());
  constexpr double kTiny = 1e-60;  // nothing where no frame is made for it
  AddRow(mesh, 0, 1000, kTiny);
  ASSERT_TRUE(vertices.CatchUp(mesh, WorkMeter::Unlimited()).ok());
  EXPECT_EQ(vertices.num_packings(), 2u);
  EXPECT_LT(StepsToFind(mesh, vertices, {500 * kTiny, 0, 0}), 100);
}

TEST(SpatialIndexTest, GrowthToTwiceTheSizePacksAnew) {
  Mesh mesh;
  AddRow(mesh, 0, 100, 0);
  ASSERT_TRUE(mesh.AddVertex({1000, 0, 0}).ok());
  Commit(mesh);
  SpatialIndex vertices(EntityKind::kVertex);
  for (int i = 0; i <= 102; ++i) {
    ASSERT_TRUE(vertices.CatchUp(mesh, WorkMeter::Unlimited()).ok());
    EXPECT_EQ(vertices.num_packings(), i < 102 ? 1u : 2u) << i;
    AddRow(mesh, i, i + 1, 1);
  }
}

TEST(SpatialIndexTest, GrowthFarBeyondItsBoundsPacksAnewButOnce) {
  Mesh mesh = TetGrid(2, 2, 2);
  SpatialIndex cells(EntityKind::kCell);
  const auto packings_with = [&](double far) {
    EXPECT_TRUE(mesh.MoveVertex(VertexId(26), {far, 2, 2}).ok());
    Commit(mesh);
    EXPECT_TRUE(cells.CatchUp(mesh, WorkMeter::Unlimited()).ok());
    return cells.num_packings();
  };
  EXPECT_EQ(packings_with(2), 1u);
  EXPECT_EQ(packings_with(7), 1u);
  EXPECT_EQ(packings_with(9), 2u);
  for (int i = 0; i < 10; ++i) {
    EXPECT_EQ(packings_with(2), 2u);
    EXPECT_EQ(packings_with(9), 2u);
  }
}

TEST(SpatialIndexTest, OneFarAwayTakesNoBitsFromTheOthers) {
  for (double far : {1e9, 1e20, 1e30}) {
    Mesh mesh;
    AddRow(mesh, 0, 10'000, 1);
    ASSERT_TRUE(mesh.AddVertex({far, far, far}).ok());
    Commit(mesh);
    SpatialIndex vertices(EntityKind::kVertex);
    ASSERT_TRUE(vertices.CatchUp(mesh, WorkMeter::Unlimited()).ok());
    EXPECT_LT(StepsToFind(mesh, vertices, {5000, 0, 0}), 1000);
    CountDown meter(1000);
    const auto nearest = SpatialSearch(mesh, vertices, meter).NearestVertices({5000.2, 0, 0}, 1);
    ASSERT_TRUE(nearest.ok()) << nearest.status();
    EXPECT_EQ(nearest->front().vertex, VertexId(5000));
  }
}

TEST(SpatialIndexTest, WhatIsInterruptedCanBeTriedAgain) {
  Mesh mesh = TetGrid(6, 6, 6);
  std::vector<SpatialIndex> indices = NewIndices();
  for (SpatialIndex& index : indices) {
    CountDown few(100);
    EXPECT_EQ(index.CatchUp(mesh, few), few.error());
    EXPECT_EQ(index.revision(), -1);
    EXPECT_EQ(few.charges_after_end(), 0);
  }
  CatchUpAll(mesh, indices);
  for (Slot v = 0; v < 20; ++v) ASSERT_TRUE(mesh.MoveVertex(VertexId(v), {-1.0 - v, 0.5, 0.25}).ok());
  Commit(mesh);
  for (SpatialIndex& index : indices) {
    for (int steps : {0, 5, 60, 600, 1200}) {
      CountDown few(steps);
      const bool done = index.CatchUp(mesh, few).ok();
      EXPECT_EQ(index.revision(), done ? mesh.revision() : 1);
    }
  }
  CatchUpAll(mesh, indices);
  ExpectSameAnswers(mesh, indices, 7, 40);
}

TEST(SpatialIndexTest, BytesAreWhatTheTreeTakes) {
  const Mesh mesh = TetGrid(16, 16, 16);
  SpatialIndex cells(EntityKind::kCell);
  EXPECT_LT(cells.memory_bytes(), 1000u);
  ASSERT_TRUE(cells.CatchUp(mesh, WorkMeter::Unlimited()).ok());
  const double each = double(cells.memory_bytes()) / mesh.NumLive(EntityKind::kCell);
  EXPECT_GT(each, sizeof(SpatialIndex::Entry));
  EXPECT_LT(each, SpatialIndex::kTypicalEntryBytes);
}

}  // namespace
}  // namespace dynmesh::testing
