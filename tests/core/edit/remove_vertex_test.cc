// Vertices that go, with the hole filled: what is accepted leaves a sound mesh of the same topology, what is
// refused leaves the mesh alone.

#include "core/edit/remove_vertex.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "core/edit/apply_patch.h"
#include "core/edit/check_patch.h"
#include "core/edit/geometry.h"
#include "core/edit/ring_triangulation.h"
#include "core/edit/split.h"
#include "core/mesh/vector.h"
#include "tests/support/meshes.h"
#include "tests/support/measures.h"
#include "tests/support/oracle.h"

namespace dynmesh::testing {
namespace {

const PatchLimits kAnyShape = {.keep_orientation = false};

absl::Status RemoveVertex(Mesh& mesh, Slot v, const PatchLimits& limits = {}) {
  Patch patch;
  DYNMESH_RETURN_IF_ERROR(PlanRemoveVertex(mesh, VertexId(v), patch));
  DYNMESH_RETURN_IF_ERROR(CheckPatch(mesh, patch, limits));
  AppliedPatch applied;
  return ApplyPatch(mesh, patch, applied);
}

std::string ReasonAt(Mesh& mesh, Slot v) {
  const std::string before = Describe(mesh);
  mesh.BeginBatch();
  const std::string reason = ErrorReason(RemoveVertex(mesh, v, kAnyShape));
  mesh.Rollback();
  EXPECT_EQ(Describe(mesh), before);
  return reason;
}

/// n * n squares of two triangles each, in the plane z = 0.
Mesh Sheet(int n) {
  Mesh mesh;
  for (int j = 0; j <= n; ++j) {
    for (int i = 0; i <= n; ++i) EXPECT_TRUE(mesh.AddVertex({double(i), double(j), 0}).ok());
  }
  const auto at = [n](int i, int j) { return Slot(j * (n + 1) + i); };
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      Add(mesh, ElementType::kTriangle, {at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      Add(mesh, ElementType::kTriangle, {at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  Commit(mesh);
  return mesh;
}

TEST(RemoveVertexTest, OnEveryVertexOfEveryMeshItKeepsItSoundOrLeavesItAlone) {
  for (auto& [name, mesh] : AllMeshes()) {
    const std::string before = Describe(mesh);
    const int64_t euler = Euler(mesh);
    for (Slot v = 0; v < mesh.slots(EntityKind::kVertex).limit(); ++v) {
      SCOPED_TRACE(std::string(name) + " vertex " + std::to_string(v));
      const bool isolated = mesh.IncidentEdges(VertexId(v)).empty();
      mesh.BeginBatch();
      const absl::Status status = RemoveVertex(mesh, v, kAnyShape);
      if (status.ok()) {
        EXPECT_FALSE(mesh.IsLive(VertexId(v)));
        EXPECT_EQ(Euler(mesh), euler - isolated);
        ExpectEqualsOracle(mesh, ModelOf(mesh));
      } else {
        EXPECT_NE(ErrorReason(status), "") << status;
      }
      mesh.Rollback();
      ASSERT_EQ(Describe(mesh), before);
    }
  }
}

TEST(RemoveVertexTest, ASheetThinnedOutAtRandomKeepsItsAreaInsideAndItsSide) {
  Mesh mesh = Sheet(8);
  std::mt19937 rng(3);
  const double area = TotalMeasure(mesh, EntityKind::kFace);
  int removed = 0;
  for (int step = 0; step < 200; ++step) {
    const VertexId v(rng() % 81);
    if (!mesh.IsLive(v) || mesh.IsOnBoundary(v)) continue;
    mesh.BeginBatch();
    removed += RemoveVertex(mesh, v.slot()).ok();
    Commit(mesh);
    ASSERT_NEAR(TotalMeasure(mesh, EntityKind::kFace), area, 1e-9 * area) << "step " << step;
  }
  EXPECT_GT(removed, 30);
  ExpectEqualsOracle(mesh, ModelOf(mesh));
  mesh.slots(EntityKind::kFace).live().ForEach([&](Slot f) {
    const auto v = mesh.Vertices(FaceId(f));
    EXPECT_GT(AreaVector(ElementType::kTriangle,
                         {mesh.Position(v[0]), mesh.Position(v[1]), mesh.Position(v[2])})[2],
              0);
  });
}

TEST(RemoveVertexTest, AtAStraightBoundaryTheSheetKeepsItsShapeAndACornerGoes) {
  Mesh mesh = Sheet(2);
  mesh.BeginBatch();
  ASSERT_TRUE(RemoveVertex(mesh, 1).ok());  // in the middle of a side: three triangles become two
  EXPECT_EQ(mesh.NumElements(EntityKind::kFace), 7u);
  EXPECT_TRUE(mesh.FindEdge(VertexId(0), VertexId(2)).valid());
  EXPECT_DOUBLE_EQ(TotalMeasure(mesh, EntityKind::kFace), 4);
  ASSERT_TRUE(RemoveVertex(mesh, 2).ok());  // the corner beside it
  ExpectEqualsOracle(mesh, ModelOf(mesh));
  Mesh disk = Disk(5);
  disk.BeginBatch();
  ASSERT_TRUE(RemoveVertex(disk, 0, kAnyShape).ok());
  EXPECT_EQ(disk.NumElements(EntityKind::kFace), 3u);
  EXPECT_EQ(Euler(disk), 1);
  ExpectEqualsOracle(disk, ModelOf(disk));
}

TEST(RemoveVertexTest, ItUndoesASplitOfATetrahedronToTheLastVolume) {
  Mesh mesh = TetGrid(2, 2, 2);
  const double volume = TotalMeasure(mesh, EntityKind::kCell);
  const auto before = ModelOf(mesh).elements.size();
  mesh.BeginBatch();
  Patch patch;
  ASSERT_TRUE(PlanSplitElement(mesh, CellId(7), {}, patch).ok());
  AppliedPatch applied;
  ASSERT_TRUE(ApplyPatch(mesh, patch, applied).ok());
  ASSERT_TRUE(RemoveVertex(mesh, applied.new_vertices[0].slot()).ok());
  EXPECT_EQ(ModelOf(mesh).elements.size(), before);
  EXPECT_DOUBLE_EQ(TotalMeasure(mesh, EntityKind::kCell), volume);
  ASSERT_TRUE(RemoveVertex(mesh, 13).ok());  // the middle of all
  EXPECT_NEAR(TotalMeasure(mesh, EntityKind::kCell), volume, 1e-12);
  ExpectEqualsOracle(mesh, ModelOf(mesh));
}

TEST(RemoveVertexTest, TwoWiresBecomeOneThatLeadsWhereTheyDid) {
  Mesh mesh;
  AddVertices(mesh, 4);
  Add(mesh, ElementType::kWireEdge, {2, 1});
  Add(mesh, ElementType::kWireEdge, {1, 0});
  Add(mesh, ElementType::kWireEdge, {0, 3});
  Commit(mesh);
  EXPECT_EQ(ReasonAt(mesh, 2), reason::kBoundary);
  mesh.BeginBatch();
  ASSERT_TRUE(RemoveVertex(mesh, 1).ok());
  const EdgeId e = mesh.FindEdge(VertexId(0), VertexId(2));
  ASSERT_TRUE(e.valid());
  EXPECT_EQ(mesh.Vertices(e)[0], VertexId(2));
  ExpectEqualsOracle(mesh, ModelOf(mesh));
}

TEST(RemoveVertexTest, RefusalsSayWhy) {
  Mesh bow_tie = BowTie();
  EXPECT_EQ(ReasonAt(bow_tie, 0), reason::kNonManifoldVertex);
  Mesh book = Book(3);
  EXPECT_EQ(ReasonAt(book, 0), reason::kNonManifoldEdge);
  Mesh strip = MoebiusStrip(5);
  EXPECT_EQ(ReasonAt(strip, 0), reason::kNotSimplex);
  Mesh hexes = TwoHexes();
  EXPECT_EQ(ReasonAt(hexes, 0), reason::kNotSimplex);
  Mesh danglers = TetWithDanglers();
  EXPECT_EQ(ReasonAt(danglers, 0), reason::kElementInTheWay);
  EXPECT_EQ(ReasonAt(danglers, 5), reason::kBoundary);
  Mesh lone;
  AddVertices(lone, 3);
  Add(lone, ElementType::kTriangle, {0, 1, 2});
  Commit(lone);
  EXPECT_EQ(ReasonAt(lone, 0), reason::kWouldChangeTopology);
  Mesh large = Disk(kMaxRing + 1);
  EXPECT_EQ(ReasonAt(large, 0), reason::kTooManyElements);
}

TEST(RemoveVertexTest, ATriangleThatIsThereAlreadyIsNotMadeAgain) {
  Mesh tet;  // the surface of a tetrahedron
  AddVertices(tet, 4);
  for (auto [a, b, c] : {std::array<Slot, 3>{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}}) {
    Add(tet, ElementType::kTriangle, {a, b, c});
  }
  Commit(tet);
  EXPECT_EQ(ReasonAt(tet, 0), reason::kFaceExists);
  Mesh turned;
  AddVertices(turned, 4);
  Add(turned, ElementType::kTriangle, {0, 1, 2});
  Add(turned, ElementType::kTriangle, {0, 3, 2});
  Commit(turned);
  EXPECT_EQ(ReasonAt(turned, 0), reason::kInconsistentOrientation);
}

TEST(RemoveVertexTest, NewElementsTakeTheAttributesOfThoseWhosePlaceTheyTake) {
  Mesh mesh = Disk(5);
  const AttributeSpec spec{"tag", EntityKind::kFace, AttributeType::kInt32, 1};
  ASSERT_TRUE(mesh.AddAttribute(spec).ok());
  const int32_t tag = 7;
  mesh.slots(EntityKind::kFace).live().ForEach([&](Slot f) {
    const auto* bytes = reinterpret_cast<const uint8_t*>(&tag);
    ASSERT_TRUE(mesh.SetAttribute(0, f, {bytes, sizeof(tag)}).ok());
  });
  Commit(mesh);
  mesh.BeginBatch();
  ASSERT_TRUE(RemoveVertex(mesh, 0, kAnyShape).ok());
  int faces = 0;
  mesh.slots(EntityKind::kFace).live().ForEach([&](Slot f) {
    ++faces;
    EXPECT_EQ(*reinterpret_cast<const int32_t*>(mesh.attributes()[0].Row(f).data()), tag);
  });
  EXPECT_EQ(faces, 3);
}

TEST(RingTriangulationTest, ItIsTheBestOfAllThatThereAre) {
  std::mt19937 rng(11);
  for (int trial = 0; trial < 200; ++trial) {
    const size_t n = 3 + rng() % 5;
    std::vector<double> scores(n * n * n);
    for (double& score : scores)
      score = rng() % 8 == 0 ? RingTriangulation::kForbidden : -double(rng() % 100);
    const auto score = [&](const RingTriangulation::Triangle& t) {
      return scores[(t.i * n + t.k) * n + t.j];
    };
    for (const auto aim : {RingTriangulation::Aim::kBestWorst, RingTriangulation::Aim::kBestSum}) {
      const std::function<double(size_t, size_t)> brute = [&](size_t i, size_t j) {
        const bool worst = aim == RingTriangulation::Aim::kBestWorst;
        if (j < i + 2) return worst ? HUGE_VAL : 0.0;
        double best = RingTriangulation::kForbidden;
        for (size_t k = i + 1; k < j; ++k) {
          const double a = brute(i, k), b = brute(k, j), c = score({i, k, j});
          best = std::max(best, worst ? std::min({a, b, c}) : a + b + c);
        }
        return best;
      };
      RingTriangulation triangulation(n, aim);
      const bool found = triangulation.Find([](size_t, size_t) { return true; }, score);
      EXPECT_EQ(found, brute(0, n - 1) > RingTriangulation::kForbidden) << "trial " << trial;
      EXPECT_EQ(triangulation.score_found(), brute(0, n - 1)) << "trial " << trial;
      size_t triangles = 0;
      if (found) triangulation.ForEach([&](const RingTriangulation::Triangle&) { ++triangles; });
      EXPECT_EQ(triangles, found ? n - 2 : 0);
    }
  }
}

}  // namespace
}  // namespace dynmesh::testing
