#include "core/spatial/spatial_search.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/mesh/error.h"
#include "core/spatial/containment.h"
#include "tests/core/spatial/places.h"
#include "tests/support/count_down.h"
#include "tests/support/meshes.h"

namespace dynmesh::testing {
namespace {

/// An index that has caught up, and searches in it.
class Searched {
 public:
  Searched(const Mesh& mesh, EntityKind kind) : mesh_(mesh), index_(kind) {
    EXPECT_TRUE(index_.CatchUp(mesh, WorkMeter::Unlimited()).ok());
  }
  SpatialSearch Search(WorkMeter& meter = WorkMeter::Unlimited()) const { return {mesh_, index_, meter}; }

 private:
  const Mesh& mesh_;
  SpatialIndex index_;
};

std::vector<Slot> SlotsOf(const std::vector<NearVertex>& vertices) {
  std::vector<Slot> slots;
  for (const NearVertex& near : vertices) slots.push_back(near.vertex.slot());
  return slots;
}

/// The grid with every coordinate mapped.
template <typename Fn>
Mesh Mapped(Mesh mesh, Fn fn) {
  mesh.slots(EntityKind::kVertex).live().ForEach([&](Slot slot) {
    Point position = mesh.Position(VertexId(slot));
    for (double& x : position) x = fn(x);
    EXPECT_TRUE(mesh.MoveVertex(VertexId(slot), position).ok());
  });
  Commit(mesh);
  return mesh;
}

TEST(SpatialSearchTest, SidesOfABoxBelongToIt) {
  const Mesh mesh = HexGrid(2, 2, 2);
  const Box box{{1, 1, 1}, {1, 1, 1}};
  for (EntityKind kind : kEntityKinds) {
    const size_t expected[] = {1, 6, 12, 8};
    EXPECT_EQ(Searched(mesh, kind).Search().InBox(box)->size(), expected[Dimension(kind)]);
  }
  const double beyond = std::nextafter(2.0, 3.0);
  EXPECT_THAT(*Searched(mesh, EntityKind::kVertex).Search().InBox({{beyond, 0, 0}, {9, 2, 2}}),
              ::testing::IsEmpty());
  EXPECT_EQ(Searched(mesh, EntityKind::kVertex).Search().InBox({{2, 0, 0}, {9, 2, 2}})->size(), 9u);
}

TEST(SpatialSearchTest, EqualDistancesGoById) {
  const Mesh mesh = HexGrid(4, 4, 4);
  const Searched searched(mesh, EntityKind::kVertex);
  const Point centre = {2, 2, 2};
  for (size_t count = 1; count < 130; ++count) {
    EXPECT_EQ(SlotsOf(*searched.Search().NearestVertices(centre, count)),
              SlotsOf(BruteNearest(mesh, centre, count)));
  }
}

TEST(SpatialSearchTest, AllOnOneSpotTheLowestIdsAreNearest) {
  Mesh mesh;
  for (int i = 0; i < 20'000; ++i) ASSERT_TRUE(mesh.AddVertex({1, 2, 3}).ok());
  Commit(mesh);
  const Searched searched(mesh, EntityKind::kVertex);
  EXPECT_THAT(SlotsOf(*searched.Search().NearestVertices({0, 0, 0}, 5)),
              ::testing::ElementsAre(0, 1, 2, 3, 4));
  CountDown meter(10'000);
  SpatialSearch search = searched.Search(meter);
  EXPECT_EQ(search.NearestVertices({1, 2, 3}, 5).status(), meter.error());
  EXPECT_EQ(meter.charges_after_end(), 0);
}

TEST(SpatialSearchTest, AMillionBoxesOnOneSpotCanBeLeft) {
  Mesh mesh;
  AddVertices(mesh, 4);
  for (int i = 0; i < 30'000; ++i) Add(mesh, ElementType::kTetrahedron, {0, 1, 2, 3});
  for (int i = 0; i < 30'000; ++i) Add(mesh, ElementType::kTriangle, {0, 1, 2});
  Commit(mesh);
  const Searched cells(mesh, EntityKind::kCell), faces(mesh, EntityKind::kFace);
  Point centre = {};
  for (Slot v = 0; v < 4; ++v) {
    for (int axis = 0; axis < 3; ++axis) centre[axis] += mesh.Position(VertexId(v))[axis] / 4;
  }
  EXPECT_EQ(*cells.Search().FindCell(centre), CellId(0));
  const auto ends = [](auto ask) {
    CountDown meter(20'000);
    EXPECT_EQ(ask(meter), meter.error());
    EXPECT_EQ(meter.charges_after_end(), 0);
  };
  const Box around{{-9, -9, -9}, {9, 9, 9}};
  ends([&](WorkMeter& meter) { return cells.Search(meter).FindCell(centre).status(); });
  ends([&](WorkMeter& meter) { return cells.Search(meter).InBox(around).status(); });
  ends([&](WorkMeter& meter) { return faces.Search(meter).InBox(around).status(); });
  ends([&](WorkMeter& meter) {
    return faces.Search(meter).CastRay({centre, {0, 0, 1}}, {RayTargets::kAnyFace, RayHits::kAll}).status();
  });
  ends(
      [&](WorkMeter& meter) { return faces.Search(meter).FindFace(mesh.Position(VertexId(0)), 0).status(); });
}

TEST(SpatialSearchTest, AFarVertexDoesNotMakeEachFaceACandidate) {
  Mesh mesh = TetGrid(10, 10, 10);
  SpatialIndex faces(EntityKind::kFace);
  ASSERT_TRUE(faces.CatchUp(mesh, WorkMeter::Unlimited()).ok());
  const auto steps = [&] {
    CountDown meter(1'000'000);
    const Point on_no_edge = {5.3, 5.4, 5};
    EXPECT_EQ(*SpatialSearch(mesh, faces, meter).FindFace(on_no_edge, 0), BruteFindFace(mesh, on_no_edge, 0));
    return 1'000'000 - meter.left();
  };
  const int64_t before = steps();
  ASSERT_TRUE(mesh.MoveVertex(VertexId(0), {-1e12, 0, 0}).ok());
  Commit(mesh);
  ASSERT_TRUE(faces.CatchUp(mesh, WorkMeter::Unlimited()).ok());
  EXPECT_LT(steps(), 2 * before + 1000);
}

TEST(SpatialSearchTest, TheIndexHasRoomForTheToleranceOfEachFace) {
  for (double at : {0.0, 1e6}) {
    Mesh mesh;
    for (const auto& [x, y] : {std::pair(0, 0), {100, 0}, {0, 100}, {1, 0}, {0, 1}}) {
      ASSERT_TRUE(mesh.AddVertex({at + x, at + y, at}).ok());
    }
    Add(mesh, ElementType::kTriangle, {0, 1, 2});
    Add(mesh, ElementType::kTriangle, {0, 3, 4});
    Commit(mesh);
    const Searched faces(mesh, EntityKind::kFace);
    for (double off = -2e-7; off < 2e-7; off += 1.3e-9) {
      for (const Point& p : {Point{at + 0.2, at + 0.2, at + off}, Point{at + 50, at + off, at}}) {
        EXPECT_EQ(*faces.Search().FindFace(p, 0), BruteFindFace(mesh, p, 0)) << off;
      }
    }
  }
}

TEST(SpatialSearchTest, NoScaleMakesAWrongFace) {
  for (double size : {1e-300, 1e-200, 1e-160, 1e-90, 1e-50, 1e50, 1e90, 1e160, 1e200, 1e300}) {
    const Mesh mesh = Mapped(HexGrid(2, 2, 2), [&](double x) { return (x - 1) * size; });
    const Searched faces(mesh, EntityKind::kFace);
    for (double x : {-0.75, -0.3, 0.2}) {
      const Point on = {x * size, 0.3 * size, size}, off = {x * size, 0.3 * size, 0.9 * size};
      const FaceId f = *faces.Search().FindFace(on, 0);
      ASSERT_TRUE(f.valid()) << size;
      EXPECT_TRUE(Contains(BoundsOf(mesh, f), on)) << size;
      EXPECT_FALSE(faces.Search().FindFace(off, 0)->valid()) << size;
      EXPECT_FALSE(faces.Search().FindFace(off, 0.09 * size)->valid()) << size;
      EXPECT_TRUE(faces.Search().FindFace(off, 0.11 * size)->valid()) << size;
    }
  }
}

/// How many steps fn(meter) takes.
template <typename Fn>
int64_t StepsOf(Fn fn) {
  CountDown meter(1'000'000);
  EXPECT_TRUE(fn(meter).ok());
  return 1'000'000 - meter.left();
}

TEST(SpatialSearchTest, ATestCostsMoreThanALook) {
  const Mesh hex = HexGrid(1, 1, 1), tet = OneTet();
  const Searched hexes(hex, EntityKind::kCell), tets(tet, EntityKind::kCell), faces(hex, EntityKind::kFace);
  EXPECT_EQ(StepsOf([&](WorkMeter& m) { return hexes.Search(m).FindCell({0.5, 0.5, 0.5}).status(); }), 101);
  EXPECT_EQ(
      StepsOf([&](WorkMeter& m) { return tets.Search(m).FindCell(tet.Position(VertexId(0))).status(); }), 11);
  const auto locate = [&](WorkMeter& m) { return faces.Search(m).FindFace({0.3, 0.4, 1}, 0).status(); };
  EXPECT_EQ(StepsOf(locate), 6 + kStepsToMeasure);
  const Ray ray{{0.3, 0.4, -1}, {0, 0, 1}};
  EXPECT_GE(StepsOf([&](WorkMeter& m) { return faces.Search(m).CastRay(ray, {}).status(); }), 20 + 1);
}

TEST(SpatialSearchTest, OfManyFacesOnOneSpotTheFirstHitIsOneResult) {
  Mesh mesh;
  AddVertices(mesh, 3);
  for (int i = 0; i < 1000; ++i) Add(mesh, ElementType::kTriangle, {0, 1, 2});
  Commit(mesh);
  Point centre = {};
  for (Slot v = 0; v < 3; ++v) {
    for (int axis = 0; axis < 3; ++axis) centre[axis] += mesh.Position(VertexId(v))[axis] / 3;
  }
  const Ray ray{{centre[0], centre[1], centre[2] - 1}, {0, 0, 1}};
  const Searched faces(mesh, EntityKind::kFace);
  CountDown meter(1'000'000);
  const auto hits = *faces.Search(meter).CastRay(ray, {RayTargets::kAnyFace, RayHits::kFirst});
  ASSERT_EQ(hits.size(), 1u);
  EXPECT_EQ(hits[0].face, FaceId(0));
  EXPECT_EQ(meter.bytes(), sizeof(RayHit));
}

TEST(SpatialSearchTest, ResultsAreChargedAsBytes) {
  const Mesh mesh = TetGrid(4, 4, 4);
  CountDown meter(1'000'000);
  const Searched vertices(mesh, EntityKind::kVertex), faces(mesh, EntityKind::kFace);
  const auto found = vertices.Search(meter).InBox({{0, 0, 0}, {2, 2, 2}});
  EXPECT_EQ(meter.bytes(), found->size() * sizeof(Slot));
  vertices.Search(meter).NearestVertices({0, 0, 0}, 10).IgnoreError();
  EXPECT_EQ(meter.bytes(), found->size() * sizeof(Slot) + 10 * sizeof(NearVertex));
}

TEST(SpatialSearchTest, ScaleAndPlaceDoNotMatter) {
  const auto expect_same = [](const Mesh& mesh) {
    std::vector<SpatialIndex> indices = NewIndices();
    CatchUpAll(mesh, indices);
    ExpectSameAnswers(mesh, indices, 3, 30);
  };
  const Mesh grid = TetGrid(3, 3, 3);
  expect_same(Mapped(grid.Clone(), [](double x) { return 5e8 + 0.01 * x; }));
  expect_same(Mapped(grid.Clone(), [](double x) { return 1e120 * (x - 1); }));
  expect_same(Mapped(grid.Clone(), [](double x) { return 1e-120 * x; }));
  expect_same(Mapped(grid.Clone(), [](double x) { return x * x * x * 1e-3 - 7; }));
}

TEST(SpatialSearchTest, ExtremeCoordinatesHarmNobody) {
  constexpr double kMax = std::numeric_limits<double>::max();
  constexpr double kMin = std::numeric_limits<double>::denorm_min();
  for (double size : {kMax, kMin}) {
    const Mesh mesh = Mapped(HexGrid(2, 2, 2), [&](double x) { return (x - 1) * size; });
    std::vector<SpatialIndex> indices = NewIndices();
    CatchUpAll(mesh, indices);
    const SpatialSearch vertices(mesh, indices[0], WorkMeter::Unlimited());
    const Box all{{-kMax, -kMax, -kMax}, {kMax, kMax, kMax}};
    EXPECT_EQ(SpatialSearch(vertices).InBox(all)->size(), 27u);
    EXPECT_EQ(SlotsOf(*SpatialSearch(vertices).NearestVertices({size, size, size}, 27)),
              SlotsOf(BruteNearest(mesh, {size, size, size}, 27)));
    EXPECT_TRUE(SpatialSearch(mesh, indices[3], WorkMeter::Unlimited()).FindCell({0, 0, 0})->valid());
    EXPECT_TRUE(SpatialSearch(mesh, indices[2], WorkMeter::Unlimited()).FindFace({kMax, kMax, 0}, 1).ok());
    for (double d : {kMax, kMin}) {
      EXPECT_TRUE(SpatialSearch(mesh, indices[2], WorkMeter::Unlimited())
                      .CastRay({{-kMax, 0, kMin}, {d, kMin, 0}}, {RayTargets::kAnyFace, RayHits::kAll})
                      .ok());
    }
  }
}

TEST(SpatialSearchTest, ARayLooksOnlyAsFarAsItsFirstHit) {
  const Mesh mesh = HexGrid(20, 20, 20);
  const Searched faces(mesh, EntityKind::kFace);
  const Ray ray{{-1, 10.3, 10.6}, {1, 0, 0}};
  CountDown first(1'000'000), all(1'000'000);
  EXPECT_EQ(faces.Search(first).CastRay(ray, {RayTargets::kAnyFace, RayHits::kFirst})->front().t, 1);
  EXPECT_EQ(faces.Search(all).CastRay(ray, {RayTargets::kAnyFace, RayHits::kAll})->size(), 21u);
  EXPECT_GT(first.left(), all.left());
  const auto surface = *faces.Search().CastRay(ray, {RayTargets::kSurface, RayHits::kAll});
  ASSERT_EQ(surface.size(), 2u);
  EXPECT_EQ(surface[1].t, 21);
}

TEST(SpatialSearchTest, HitsAreMeasuredInLengthsOfTheDirection) {
  const Mesh mesh = HexGrid(1, 1, 1);
  const Searched faces(mesh, EntityKind::kFace);
  for (double length : {1e-300, 0.3, 1.0, 1e300}) {
    const auto hits = *faces.Search().CastRay({{-1, 0.25, 0.5}, {length, 0, 0}}, {});
    ASSERT_EQ(hits.size(), 1u);
    EXPECT_DOUBLE_EQ(hits[0].t * length, 1.0);
  }
  EXPECT_THAT(*faces.Search().CastRay({{-1, 0.25, 0.5}, {-1, 0, 0}}, {}), ::testing::IsEmpty());
  EXPECT_EQ(faces.Search().CastRay({{0, 0.25, 0.5}, {1, 0, 0}}, {})->front().t, 0);
}

}  // namespace
}  // namespace dynmesh::testing
