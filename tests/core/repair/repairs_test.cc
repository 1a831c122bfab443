// Repairs of meshes made by hand, each broken in one way.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/edit/geometry.h"
#include "core/mesh/vector.h"
#include "core/repair/fill_holes.h"
#include "tests/core/repair/repair_support.h"
#include "tests/support/count_down.h"
#include "tests/support/oracle.h"

namespace dynmesh::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

/// Six times the volume inside of a closed surface that faces outwards.
double Enclosed(const Mesh& mesh) {
  double sum = 0;
  for (const auto& [id, element] : ModelOf(mesh).elements) {
    const auto& v = element.vertices;
    for (size_t k = 2; k < v.size(); ++k) {
      sum += Dot(mesh.Position(v[0]), Cross(mesh.Position(v[k - 1]), mesh.Position(v[k])));
    }
  }
  return sum;
}

// ---- Orient ----

TEST(OrientTest, AFlippedTriangleOfAClosedSurfaceIsTurnedBackAndKeepsItsId) {
  Mesh mesh = CubeSurface();
  mesh.BeginBatch();
  ASSERT_TRUE(mesh.RemoveElement(FaceId(3)).ok());
  Commit(mesh);
  mesh.BeginBatch();
  const EntityId flipped = Add(mesh, ElementType::kTriangle, {7, 6, 4});
  Commit(mesh);
  ASSERT_GT(CountTurns(mesh), 0);
  const RepairReport report = Repair(mesh, OrientStep{});
  EXPECT_THAT(Found(report, RepairFinding::kReversed), ElementsAre(flipped));
  EXPECT_EQ(CountTurns(mesh), 0);
  EXPECT_DOUBLE_EQ(Enclosed(mesh), 6);
}

TEST(OrientTest, AClosedSurfaceFacesOutwardsUnlessTheMajorityDecides) {
  Mesh inwards = Triangles({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                           {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}});  // all of them look inwards
  EXPECT_EQ(Repair(inwards, OrientStep{{.outward = false}}).Count(RepairFinding::kReversed), 0u);
  EXPECT_EQ(Repair(inwards, OrientStep{}).Count(RepairFinding::kReversed), 4u);
  EXPECT_DOUBLE_EQ(Enclosed(inwards), 1);
}

TEST(OrientTest, AMoebiusStripIsNamedAndLeftAlone) {
  Mesh mesh = MoebiusStrip(5);
  const ElementModel before = ModelOf(mesh);
  const RepairReport report = Repair(mesh, OrientStep{});
  EXPECT_THAT(Found(report, RepairFinding::kNotOrientable), ElementsAre(EntityId(FaceId(0))));
  EXPECT_EQ(ModelOf(mesh), before);
}

TEST(OrientTest, FacesOfAnEdgeWithThreeOfThemAreNotCompared) {
  Mesh mesh = Book(3);
  EXPECT_EQ(Repair(mesh, OrientStep{}).Count(RepairFinding::kReversed), 0u);
}

TEST(OrientTest, CellsOfEveryTypeGetPositiveVolume) {
  std::mt19937 rng(5);
  for (const Mesh& mesh : {TetGrid(2, 2, 2), HexGrid(2, 2, 2)}) {
    const double volume = TotalMeasure(mesh, EntityKind::kCell);
    Mesh reversed = RandomlyReversed(mesh, rng);
    ASSERT_LT(TotalMeasure(reversed, EntityKind::kCell), volume);
    EXPECT_GT(Repair(reversed, OrientStep{}).Count(RepairFinding::kReversed), 0u);
    EXPECT_DOUBLE_EQ(TotalMeasure(reversed, EntityKind::kCell), volume);
    EXPECT_EQ(CountTurns(reversed), 0);
  }
  for (const auto& shape : {std::vector<Slot>{0, 1, 2, 3, 4}, {0, 1, 3, 4, 5, 7}}) {  // pyramid and prism
    Mesh mesh = HexGrid(1, 1, 1);
    mesh.BeginBatch();
    ASSERT_TRUE(mesh.RemoveElement(CellId(0)).ok());
    const ElementType type = shape.size() == 5 ? ElementType::kPyramid : ElementType::kPrism;
    // Grid vertices are 0 1 / 2 3 below and 4 5 / 6 7 above.
    type == ElementType::kPyramid ? Add(mesh, type, {2, 3, 1, 0, 6}) : Add(mesh, type, {4, 5, 6, 0, 1, 2});
    Commit(mesh);
    const double volume = TotalMeasure(mesh, EntityKind::kCell);
    Repair(mesh, OrientStep{});
    EXPECT_DOUBLE_EQ(TotalMeasure(mesh, EntityKind::kCell), std::abs(volume));
  }
}

TEST(OrientTest, ReversedElementsKeepTheirAttributes) {
  Mesh mesh = OneTet();
  ASSERT_TRUE(mesh.AddAttribute({"tag", EntityKind::kCell, AttributeType::kInt32, 1}).ok());
  const int32_t tag = 42;
  ASSERT_TRUE(mesh.SetAttribute(0, 0, {reinterpret_cast<const uint8_t*>(&tag), sizeof(tag)}).ok());
  Commit(mesh);
  const bool positive = TotalMeasure(mesh, EntityKind::kCell) > 0;
  if (positive) {
    mesh.BeginBatch();
    for (int k = 0; k < 4; ++k) {
      Point mirrored = mesh.Position(VertexId(k));
      mirrored[0] = -mirrored[0];
      ASSERT_TRUE(mesh.MoveVertex(VertexId(k), mirrored).ok());
    }
    Commit(mesh);
  }
  const auto reversed = Found(Repair(mesh, OrientStep{}), RepairFinding::kReversed);
  ASSERT_THAT(reversed, SizeIs(1));
  EXPECT_EQ(*reinterpret_cast<const int32_t*>(mesh.attributes()[0].Row(reversed[0].slot).data()), tag);
  EXPECT_GT(TotalMeasure(mesh, EntityKind::kCell), 0);
}

// ---- Weld ----

TEST(WeldTest, TwoTetrahedraThatTouchGrowTogether) {
  Mesh mesh;
  for (const Point& p :
       {Point{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 1e-9}, {0, 1, 0}, {1, 0, 0}, {0, 0, -1}}) {
    ASSERT_TRUE(mesh.AddVertex(p).ok());
  }
  Add(mesh, ElementType::kTetrahedron, {0, 1, 2, 3});
  Add(mesh, ElementType::kTetrahedron, {4, 5, 6, 7});
  Commit(mesh);
  Mesh exact = mesh.Clone();
  EXPECT_EQ(Repair(exact, WeldStep{0}).Count(RepairFinding::kMerged), 2u);
  const RepairReport report = Repair(mesh, WeldStep{1e-6});
  EXPECT_THAT(Found(report, RepairFinding::kMerged),
              ElementsAre(EntityId(VertexId(4)), EntityId(VertexId(5)), EntityId(VertexId(6))));
  EXPECT_EQ(mesh.NumLive(EntityKind::kFace), 7u);
  EXPECT_EQ(mesh.Position(VertexId(0)), (Point{0, 0, 0}));
}

TEST(WeldTest, ElementsThatFoldOrBecomeEqualGoAndQuadsBecomeTriangles) {
  Mesh mesh;
  for (const Point& p :
       {Point{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 1.001, 0}, {0, 0, 0}, {1, 0, 0}, {1, 1, 0}}) {
    ASSERT_TRUE(mesh.AddVertex(p).ok());
  }
  const EntityId folded = Add(mesh, ElementType::kTriangle, {3, 4, 1});
  const EntityId quad = Add(mesh, ElementType::kQuad, {0, 2, 3, 4});
  const EntityId kept = Add(mesh, ElementType::kTriangle, {0, 1, 2});
  const EntityId equal = Add(mesh, ElementType::kTriangle, {7, 6, 5});
  Commit(mesh);
  const RepairReport report = Repair(mesh, WeldStep{0.01});
  EXPECT_THAT(Found(report, RepairFinding::kDegenerate), ElementsAre(folded));
  EXPECT_THAT(Found(report, RepairFinding::kShrunk), ElementsAre(quad));
  EXPECT_THAT(Found(report, RepairFinding::kDuplicate), ElementsAre(equal));
  EXPECT_TRUE(mesh.IsElement(kept));
  EXPECT_EQ(mesh.NumElements(EntityKind::kFace), 2u);
  EXPECT_TRUE(mesh.FindFace({VertexId(0), VertexId(2), VertexId(3)}).valid());
}

TEST(WeldTest, WhereDuplicatesAreRefusedTooTheFirstOneStays) {
  Mesh mesh({.duplicates = DuplicatePolicy::kRefuse, .limits = {}});
  for (int i = 0; i < 9; ++i) ASSERT_TRUE(mesh.AddVertex({double(i % 3), double(i % 3 == 1), 0}).ok());
  Add(mesh, ElementType::kTriangle, {0, 1, 2});
  Add(mesh, ElementType::kTriangle, {3, 4, 5});
  Add(mesh, ElementType::kTriangle, {8, 7, 6});
  Commit(mesh);
  const RepairReport report = Repair(mesh, WeldStep{0});
  EXPECT_EQ(report.Count(RepairFinding::kMerged), 6u);
  EXPECT_EQ(report.Count(RepairFinding::kDuplicate), 2u);
  EXPECT_EQ(mesh.NumElements(EntityKind::kFace), 1u);
}

TEST(WeldTest, AChainOfNearVerticesIsThinnedAndNotDrawnTogether) {
  Mesh mesh;
  for (int i = 0; i <= 10; ++i) ASSERT_TRUE(mesh.AddVertex({0.1 * i, 0, 0}).ok());
  for (Slot i = 0; i < 10; ++i) Add(mesh, ElementType::kWireEdge, {i, i + 1});
  Commit(mesh);
  Repair(mesh, WeldStep{0.15});
  EXPECT_EQ(mesh.NumElements(EntityKind::kEdge), 5u);
  EXPECT_NEAR(TotalMeasure(mesh, EntityKind::kEdge), 1, 1e-12);
}

TEST(WeldTest, CoordinatesOfAnySizeAreCompared) {
  for (const double far : {0.0, 1.0, 1e-300, 1e300}) {
    Mesh mesh;
    for (const double x : {far, far, -far, 0.0}) ASSERT_TRUE(mesh.AddVertex({x, x, x}).ok());
    Commit(mesh);
    EXPECT_EQ(Repair(mesh, WeldStep{0}).Count(RepairFinding::kMerged), far == 0 ? 3u : 1u) << far;
    Repair(mesh, WeldStep{1e305});
    EXPECT_EQ(mesh.NumLive(EntityKind::kVertex), 1u);
  }
}

TEST(WeldTest, AToleranceThatIsNoLengthIsRefused) {
  for (const double tolerance : {-1.0, std::nan(""), HUGE_VAL}) {
    Mesh mesh = OneTet();
    mesh.BeginBatch();
    const RepairStep step = WeldStep{tolerance};
    const auto status =
        RepairMesh(mesh, {&step, 1}, WorkMeter::Unlimited(), [](size_t, const RepairReport&) { FAIL(); });
    EXPECT_EQ(ErrorReason(status), reason::kBadArgument);
    EXPECT_EQ(GetErrorDetail(status)->Find("step"), "0");
    mesh.Rollback();
  }
}

// ---- Remove duplicates ----

TEST(RemoveDuplicatesTest, OneOfEachKindStaysAndDegenerateOnesGo) {
  Mesh mesh = TetWithDanglers();
  mesh.BeginBatch();
  Add(mesh, ElementType::kTetrahedron, {1, 0, 3, 2});
  Add(mesh, ElementType::kTriangle, {4, 1, 0});
  Add(mesh, ElementType::kTriangle, {1, 0, 4});
  Add(mesh, ElementType::kTriangle, {0, 1, 2});  // the tetrahedron's own face: one of both
  Add(mesh, ElementType::kTriangle, {0, 2, 1});
  Add(mesh, ElementType::kWireEdge, {5, 0});
  Add(mesh, ElementType::kWireEdge, {3, 3});
  Add(mesh, ElementType::kTriangle, {5, 5, 6});
  Commit(mesh);
  const RepairReport report = Repair(mesh, RemoveDuplicatesStep{});
  EXPECT_EQ(report.Count(RepairFinding::kDuplicate), 5u);
  EXPECT_EQ(report.Count(RepairFinding::kDegenerate), 2u);
  EXPECT_EQ(report.Count(RepairFinding::kIsolated), 0u);
  EXPECT_EQ(mesh.NumElements(EntityKind::kCell), 1u);
  EXPECT_EQ(mesh.NumElements(EntityKind::kFace), 2u);
  EXPECT_EQ(mesh.NumElements(EntityKind::kEdge), 1u);
  EXPECT_TRUE(mesh.IsElement(CellId(0)));
  mesh.slots(EntityKind::kFace).live().ForEach([&](Slot f) { EXPECT_FALSE(mesh.IsDuplicate(FaceId(f))); });
}

TEST(RemoveDuplicatesTest, ElementsOfTheSameVerticesInAnotherArrangementStay) {
  Mesh mesh;
  AddVertices(mesh, 8);
  Add(mesh, ElementType::kHexahedron, {0, 1, 2, 3, 4, 5, 6, 7});
  Add(mesh, ElementType::kHexahedron, {1, 0, 2, 3, 5, 4, 6, 7});
  const EntityId mirrored = Add(mesh, ElementType::kHexahedron, {4, 5, 6, 7, 0, 1, 2, 3});
  Add(mesh, ElementType::kQuad, {0, 1, 2, 3});
  Add(mesh, ElementType::kQuad, {0, 2, 1, 3});
  Commit(mesh);
  const RepairReport report = Repair(mesh, RemoveDuplicatesStep{});
  EXPECT_THAT(Found(report, RepairFinding::kDuplicate), ElementsAre(mirrored));
  EXPECT_EQ(mesh.NumElements(EntityKind::kFace), 2u);
}

TEST(RemoveDuplicatesTest, FlatElementsGoUpToAMeasureUnlessShapeDoesNotMatter) {
  const auto flat = [] {
    return Triangles({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {1, 1e-3, 0}, {1, 1, 0}},
                     {{0, 1, 2}, {0, 2, 3}, {0, 2, 4}});
  };
  Mesh any = flat(), exact = flat(), thin = flat();
  EXPECT_EQ(
      Repair(any, RemoveDuplicatesStep{{.max_measure = absl::nullopt}}).Count(RepairFinding::kDegenerate),
      0u);
  EXPECT_EQ(Repair(exact, RemoveDuplicatesStep{}).Count(RepairFinding::kDegenerate), 1u);
  EXPECT_EQ(Repair(thin, RemoveDuplicatesStep{{.max_measure = 0.002}}).Count(RepairFinding::kDegenerate), 2u);
}

TEST(RemoveDuplicatesTest, OneOfTwoEqualQuadsStaysThoughJustOneIsFlat) {
  Mesh mesh;
  for (const Point& p : {Point{0, 0, 0}, Point{1, 0, 0}, Point{0, 0, 0}, Point{0, 1, 0}}) {
    ASSERT_TRUE(mesh.AddVertex(p).ok());
  }
  Add(mesh, ElementType::kQuad, {0, 1, 2, 3});
  Add(mesh, ElementType::kQuad, {1, 2, 3, 0});
  Commit(mesh);
  EXPECT_EQ(Repair(mesh, RemoveDuplicatesStep{}).Count(RepairFinding::kDegenerate), 1u);
  EXPECT_EQ(mesh.NumElements(EntityKind::kFace), 1u);
}

TEST(RemoveDuplicatesTest, IsolatedVerticesGoWhenAskedFor) {
  Mesh mesh = TetWithDanglers();
  const RepairReport report = Repair(mesh, RemoveDuplicatesStep{{.isolated_vertices = true}});
  EXPECT_THAT(Found(report, RepairFinding::kIsolated), ElementsAre(EntityId(VertexId(6))));
}

// ---- Split ----

TEST(SplitNonManifoldTest, EachFanOfABowTieGetsAVertex) {
  Mesh mesh = BowTie();
  ASSERT_TRUE(mesh.AddAttribute({"tag", EntityKind::kVertex, AttributeType::kFloat64, 1}).ok());
  const double tag = 2.5;
  ASSERT_TRUE(mesh.SetAttribute(0, 0, {reinterpret_cast<const uint8_t*>(&tag), sizeof(tag)}).ok());
  Commit(mesh);
  const RepairReport report = Repair(mesh, SplitNonManifoldStep{});
  EXPECT_THAT(Found(report, RepairFinding::kSplit), ElementsAre(EntityId(VertexId(0))));
  const auto added = Found(report, RepairFinding::kAdded);
  ASSERT_THAT(added, SizeIs(1));
  EXPECT_EQ(mesh.Position(VertexId(added[0].slot)), mesh.Position(VertexId(0)));
  EXPECT_EQ(*reinterpret_cast<const double*>(mesh.attributes()[0].Row(added[0].slot).data()), tag);
  EXPECT_EQ(Euler(mesh), 2);  // two disks
  EXPECT_EQ(mesh.NumElements(EntityKind::kFace), 4u);
}

TEST(SplitNonManifoldTest, ThreeFacesOfAnEdgeBecomeThreeSheets) {
  Mesh mesh = Book(3);
  const RepairReport report = Repair(mesh, SplitNonManifoldStep{});
  EXPECT_EQ(report.Count(RepairFinding::kAdded), 4u);
  EXPECT_EQ(report.Count(RepairFinding::kStillNonManifold), 0u);
  EXPECT_EQ(Euler(mesh), 3);
}

TEST(SplitNonManifoldTest, TwoTetrahedraAtAVertexOrAnEdgeComeApart) {
  for (const int shared : {1, 2}) {
    Mesh mesh;
    AddVertices(mesh, 8 - shared);
    Add(mesh, ElementType::kTetrahedron, {0, 1, 2, 3});
    shared == 1 ? Add(mesh, ElementType::kTetrahedron, {0, 4, 5, 6})
                : Add(mesh, ElementType::kTetrahedron, {0, 1, 4, 5});
    Commit(mesh);
    const RepairReport report = Repair(mesh, SplitNonManifoldStep{});
    EXPECT_EQ(report.Count(RepairFinding::kSplit), uint64_t(shared));
    EXPECT_EQ(mesh.NumLive(EntityKind::kVertex), 8u);
    EXPECT_EQ(Euler(mesh), 2);
  }
}

TEST(SplitNonManifoldTest, ADanglingFaceAndAWireStayWithTheirCell) {
  for (auto make : {TetWithDanglers, OneTet, TwoHexes, HybridOfFour, Octahedron}) {
    Mesh mesh = make();
    const RepairReport report = Repair(mesh, SplitNonManifoldStep{});
    EXPECT_EQ(report.Count(RepairFinding::kSplit), 0u);
  }
}

TEST(SplitNonManifoldTest, ThreeCellsOnOneFaceComeApart) {
  Mesh mesh;
  AddVertices(mesh, 6);
  for (Slot apex : {3, 4, 5}) Add(mesh, ElementType::kTetrahedron, {0, 1, 2, apex});
  Commit(mesh);
  const RepairReport report = Repair(mesh, SplitNonManifoldStep{});
  EXPECT_EQ(report.Count(RepairFinding::kStillNonManifold), 0u);
  EXPECT_EQ(Euler(mesh), 3);
}

TEST(SplitNonManifoldTest, AnEdgeBetweenCellsThatHangTogetherAtBothEndsIsToldAndStays) {
  Mesh mesh = HexGrid(2, 2, 3);  // of the middle layer two opposite cells go
  mesh.BeginBatch();
  for (Slot c : {4, 7}) ASSERT_TRUE(mesh.RemoveElement(CellId(c)).ok());
  Commit(mesh);
  const RepairReport report = Repair(mesh, SplitNonManifoldStep{});
  EXPECT_EQ(report.Count(RepairFinding::kSplit), 0u);
  const EdgeId pinched = mesh.FindEdge(VertexId(13), VertexId(22));
  EXPECT_THAT(Found(report, RepairFinding::kStillNonManifold), ElementsAre(EntityId(pinched)));
}

// ---- Fill holes ----

TEST(FillHolesTest, ACubeWithAMissingSideIsClosedAndFacesOutwards) {
  Mesh mesh = CubeSurface();
  mesh.BeginBatch();
  for (Slot f : {2, 3}) ASSERT_TRUE(mesh.RemoveElement(FaceId(f)).ok());
  Commit(mesh);
  Mesh open = mesh.Clone();
  EXPECT_EQ(Repair(open, FillHolesStep{3}).Count(RepairFinding::kHoleTooLong), 1u);
  const RepairReport report = Repair(mesh, FillHolesStep{4});
  EXPECT_EQ(report.Count(RepairFinding::kFilled), 1u);
  EXPECT_EQ(report.Count(RepairFinding::kAdded), 2u);
  EXPECT_TRUE(mesh.Boundary(EntityKind::kEdge).empty());
  EXPECT_EQ(Euler(mesh), 2);
  EXPECT_EQ(CountTurns(mesh), 0);
  EXPECT_DOUBLE_EQ(Enclosed(mesh), 6);
}

TEST(FillHolesTest, OfFillingsOfOneAreaTheOneWithoutFlatTriangles) {
  Mesh mesh;
  constexpr Slot kSide = 5;  // vertices; the hole has collinear ones on each side
  for (Slot i = 0; i < kSide * kSide; ++i) {
    ASSERT_TRUE(mesh.AddVertex({double(i % kSide), double(i / kSide), 0}).ok());
  }
  for (Slot row = 0; row + 1 < kSide; ++row) {
    for (Slot column = 0; column + 1 < kSide; ++column) {
      if ((row == 1 || row == 2) && (column == 1 || column == 2)) continue;
      const Slot low = row * kSide + column, high = low + kSide;
      Add(mesh, ElementType::kTriangle, {low, low + 1, high});
      Add(mesh, ElementType::kTriangle, {low + 1, high + 1, high});
    }
  }
  Commit(mesh);
  const RepairReport report = Repair(mesh, FillHolesStep{8});
  EXPECT_EQ(report.Count(RepairFinding::kFilled), 1u);
  EXPECT_DOUBLE_EQ(TotalMeasure(mesh, EntityKind::kFace), 16);
  EXPECT_EQ(Repair(mesh, RemoveDuplicatesStep{}).Count(RepairFinding::kDegenerate), 0u);
}

/// A plane ring of 2 * n triangles between radius 1 and 2; concave star if `inner` alternates.
Mesh Annulus(int n, double inner_low) {
  Mesh mesh;
  for (int ring = 0; ring < 2; ++ring) {
    for (int i = 0; i < n; ++i) {
      const double angle = 2 * M_PI * i / n, radius = ring == 1 ? 2 : i % 2 ? inner_low : 1;
      EXPECT_TRUE(mesh.AddVertex({radius * std::cos(angle), radius * std::sin(angle), 0}).ok());
    }
  }
  for (Slot i = 0; i < Slot(n); ++i) {
    const Slot next = (i + 1) % n;
    Add(mesh, ElementType::kTriangle, {i, i + n, next});
    Add(mesh, ElementType::kTriangle, {next, i + n, next + n});
  }
  Commit(mesh);
  return mesh;
}

/// A triangle outside of an annulus, so that its outer rim has one edge more than its inner one.
void AddTooth(Mesh& mesh, int n) {
  mesh.BeginBatch();
  const VertexId tip = *mesh.AddVertex({4, 1, 0});
  Add(mesh, ElementType::kTriangle, {Slot(n + 1), Slot(n), tip.slot()});
  Commit(mesh);
}

TEST(FillHolesTest, AConcaveHoleIsFilledInsideItselfAndTheOuterRimIsAHoleToo) {
  Mesh mesh = Annulus(12, 0.4);
  Mesh all = mesh.Clone();
  const double around = TotalMeasure(mesh, EntityKind::kFace);
  const double inside = 12 * 0.5 * 0.4 * 1 * std::sin(M_PI / 6);
  AddTooth(mesh, 12);
  const double tooth = TotalMeasure(mesh, EntityKind::kFace) - around;
  const RepairReport report = Repair(mesh, FillHolesStep{12});
  EXPECT_EQ(report.Count(RepairFinding::kFilled), 1u);
  EXPECT_EQ(report.Count(RepairFinding::kHoleTooLong), 1u);
  EXPECT_NEAR(TotalMeasure(mesh, EntityKind::kFace), around + tooth + inside, 1e-9);
  EXPECT_EQ(CountTurns(mesh), 0);
  EXPECT_EQ(Repair(all, FillHolesStep{12}).Count(RepairFinding::kFilled), 2u);
  EXPECT_EQ(Euler(all), 2);
}

TEST(FillHolesTest, ALongHoleGetsAVertexInTheMiddle) {
  const int n = kMaxFlatHole + 2;
  Mesh mesh = Annulus(n, 1);
  AddTooth(mesh, n);
  const RepairReport report = Repair(mesh, FillHolesStep{size_t(n)});
  EXPECT_EQ(report.Count(RepairFinding::kFilled), 1u);
  EXPECT_EQ(report.Count(RepairFinding::kAdded), uint64_t(n + 1));
  const EntityId middle = report.Of(RepairFinding::kAdded).entities[0];
  EXPECT_EQ(middle.kind, EntityKind::kVertex);
  EXPECT_NEAR(mesh.Position(VertexId(middle.slot))[0], 0, 1e-12);
  EXPECT_EQ(Euler(mesh), 1);
}

TEST(FillHolesTest, WhyAHoleStaysIsSaid) {
  Mesh lone = Triangles({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}});
  EXPECT_EQ(Repair(lone, FillHolesStep{9}).Count(RepairFinding::kHoleFaceExists), 1u);
  Mesh bow_tie = BowTie();
  EXPECT_EQ(Repair(bow_tie, FillHolesStep{9}).Count(RepairFinding::kHoleBranches), 1u);
  Mesh turned = Triangles({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}}, {{0, 1, 2}, {1, 2, 3}});
  EXPECT_EQ(Repair(turned, FillHolesStep{9}).Count(RepairFinding::kHoleInconsistent), 1u);
  Mesh moebius = MoebiusStrip(5);
  const RepairReport report = Repair(moebius, FillHolesStep{100});
  EXPECT_EQ(report.Count(RepairFinding::kHoleInconsistent), 1u);
}

TEST(FillHolesTest, TheOutsideOfASolidIsNoHole) {
  for (auto make : {OneTet, TwoHexes, HybridOfFour}) {
    Mesh mesh = make();
    const std::string before = Describe(mesh);
    const RepairReport report = Repair(mesh, FillHolesStep{1000});
    report.ForEach([](RepairFinding finding, const RepairTally&) { ADD_FAILURE() << int(finding); });
  }
}

// ---- All of them ----

const std::vector<RepairStep>& EveryStep() {
  static const std::vector<RepairStep> steps = {RemoveDuplicatesStep{}, WeldStep{0.5}, SplitNonManifoldStep{},
                                                OrientStep{}, FillHolesStep{100}};
  return steps;
}

TEST(RepairMeshTest, EveryStepOnEveryMeshKeepsItSoundAndFindsNothingTheSecondTime) {
  for (auto& [name, mesh] : AllMeshes()) {
    SCOPED_TRACE(name);
    for (const RepairStep& step : EveryStep()) Repair(mesh, step);
  }
}

TEST(RepairMeshTest, ItEndsWhereverTheMeterSaysSoAndRollsBack) {
  Mesh mesh = HexGrid(6, 6, 6);
  const std::string before = Describe(mesh);
  const auto nothing = [](size_t, const RepairReport&) {};
  CountDown whole(1'000'000'000);
  mesh.BeginBatch();
  ASSERT_TRUE(RepairMesh(mesh, EveryStep(), whole, nothing).ok());
  mesh.Rollback();
  const int64_t steps = 1'000'000'000 - whole.left();
  EXPECT_GT(steps, 10 * int64_t{WorkMeter::kMaxCharge} / 2);
  EXPECT_GT(whole.bytes(), 0u);
  for (int64_t limit = 0; limit < steps; limit += 1 + steps / 12) {
    CountDown meter(limit);
    mesh.BeginBatch();
    const absl::Status status = RepairMesh(mesh, EveryStep(), meter, nothing);
    EXPECT_EQ(status.code(), absl::StatusCode::kCancelled);
    EXPECT_EQ(meter.charges_after_end(), 0);
    mesh.Rollback();
    ASSERT_EQ(Describe(mesh), before);
  }
}

}  // namespace
}  // namespace dynmesh::testing
