// Splits, collapses and swaps against the oracle: whatever is accepted leaves a sound mesh of the same
// topology, whatever is refused leaves the mesh alone.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>
#include <random>

#include "core/edit/apply_patch.h"
#include "core/edit/check_patch.h"
#include "core/edit/collapse.h"
#include "core/edit/geometry.h"
#include "core/edit/split.h"
#include "core/edit/swap.h"
#include "tests/support/measures.h"
#include "tests/support/meshes.h"
#include "tests/support/oracle.h"

namespace dynmesh::testing {
namespace {

using Plan = std::function<absl::Status(const Mesh&, EntityId, Patch&)>;

/// Lengths, areas and volumes of all elements of a kind, without their signs.
double Total(const Mesh& mesh, EntityKind kind) {
  double total = 0;
  mesh.slots(kind).live().ForEach([&](Slot slot) {
    const EntityId id{kind, slot};
    if (!mesh.IsElement(id)) return;
    std::vector<Point> points;
    for (VertexId v : mesh.VerticesOf(id)) points.push_back(mesh.Position(v));
    total += std::abs(Measure(mesh.Type(id), points));
  });
  return total;
}

/// Cells that are flat, folded or turned against the template.
int NumInverted(const Mesh& mesh) {
  int inverted = 0;
  mesh.slots(EntityKind::kCell).live().ForEach([&](Slot c) {
    std::vector<Point> points;
    for (VertexId v : mesh.Vertices(CellId(c))) points.push_back(mesh.Position(v));
    inverted += Orientation(mesh.Type(CellId(c)), points) != 1;
  });
  return inverted;
}

absl::Status Carry(Mesh& mesh, const Plan& plan, EntityId id, const PatchLimits& limits = {}) {
  Patch patch;
  DYNMESH_RETURN_IF_ERROR(plan(mesh, id, patch));
  DYNMESH_RETURN_IF_ERROR(CheckPatch(mesh, patch, limits));
  AppliedPatch applied;
  return ApplyPatch(mesh, patch, applied);
}

const PatchLimits kAnyShape = {.keep_orientation = false};

struct Operator {
  const char* name;
  EntityKind kind;
  Plan plan;
};

std::vector<Operator> AllOperators() {
  const auto edge = [](EntityId id) { return EdgeId(id.slot); };
  return {
      {"split edge", EntityKind::kEdge,
       [=](const Mesh& m, EntityId id, Patch& p) {
         return PlanSplitEdge(m, edge(id), {.parameter = 0.3}, p);
       }},
      {"collapse to the first end", EntityKind::kEdge,
       [=](const Mesh& m, EntityId id, Patch& p) {
         return PlanCollapseEdge(m, edge(id), {.parameter = 0}, p);
       }},
      {"collapse to the second end", EntityKind::kEdge,
       [=](const Mesh& m, EntityId id, Patch& p) {
         return PlanCollapseEdge(m, edge(id), {.parameter = 1}, p);
       }},
      {"collapse to the middle", EntityKind::kEdge,
       [=](const Mesh& m, EntityId id, Patch& p) {
         return PlanCollapseEdge(m, edge(id), {.parameter = 0.5}, p);
       }},
      {"swap edge", EntityKind::kEdge,
       [=](const Mesh& m, EntityId id, Patch& p) { return PlanSwapEdge(m, edge(id), p); }},
      {"swap face", EntityKind::kFace,
       [](const Mesh& m, EntityId id, Patch& p) { return PlanSwapFace(m, FaceId(id.slot), p); }},
      {"split cell", EntityKind::kCell,
       [](const Mesh& m, EntityId id, Patch& p) { return PlanSplitElement(m, id, {}, p); }},
      {"split face", EntityKind::kFace,
       [](const Mesh& m, EntityId id, Patch& p) { return PlanSplitElement(m, id, {}, p); }},
      {"split wire", EntityKind::kEdge,
       [](const Mesh& m, EntityId id, Patch& p) { return PlanSplitElement(m, id, {}, p); }},
  };
}

TEST(OperatorsTest, OnEveryEntityOfEveryMeshTheyKeepItSoundOrLeaveItAlone) {
  for (auto& [name, mesh] : AllMeshes()) {
    const std::string before = Describe(mesh);
    const int64_t euler = Euler(mesh);
    for (const Operator& op : AllOperators()) {
      for (Slot slot = 0; slot < mesh.slots(op.kind).limit(); ++slot) {
        if (!mesh.IsLive({op.kind, slot})) continue;
        SCOPED_TRACE(std::string(op.name) + " " + std::to_string(slot) + " of " + name);
        mesh.BeginBatch();
        const absl::Status status = Carry(mesh, op.plan, {op.kind, slot}, kAnyShape);
        if (status.ok()) {
          EXPECT_EQ(Euler(mesh), euler);
          ExpectEqualsOracle(mesh, ModelOf(mesh));
        } else {
          EXPECT_NE(ErrorReason(status), "") << status;
        }
        mesh.Rollback();
        ASSERT_EQ(Describe(mesh), before);
      }
    }
  }
}

/// Meshes with a geometry: no cell is inverted.
std::vector<NamedMesh> Solids() {
  std::vector<NamedMesh> meshes;
  meshes.push_back({"tetrahedra", TetGrid(3, 3, 3)});
  meshes.push_back({"hexahedra", HexGrid(3, 3, 3)});
  return meshes;
}

TEST(OperatorsTest, ThousandsInARowKeepTopologyVolumeAndOrientation) {
  const auto operators = AllOperators();
  for (auto& [name, mesh] : Solids()) {
    std::mt19937 rng(7);
    const int64_t euler = Euler(mesh);
    const double volume = Total(mesh, EntityKind::kCell);
    std::map<std::string, int> accepted;
    mesh.BeginBatch();
    for (int step = 0; step < 4000; ++step) {
      const bool crowded = mesh.NumLive(EntityKind::kCell) > 800;
      const Operator& op = operators[crowded ? 1 + rng() % 4 : rng() % operators.size()];
      const EntityId id(op.kind, rng() % mesh.slots(op.kind).limit());
      if (!mesh.IsLive(id)) continue;
      const absl::Status status = Carry(mesh, op.plan, id);
      accepted[op.name] += status.ok();
      if (op.name == std::string("swap face") || op.name == std::string("swap edge")) {
        ASSERT_EQ(NumInverted(mesh), 0) << op.name << " of " << name << " at step " << step;
      }
      if (step % 200 == 199) {
        ASSERT_EQ(Euler(mesh), euler);
        ASSERT_EQ(NumInverted(mesh), 0) << name << " at step " << step;
        ExpectEqualsOracle(mesh, ModelOf(mesh));
        ASSERT_TRUE(mesh.Commit().ok());
        mesh.BeginBatch();
      }
    }
    for (const char* needed : {"split edge", "collapse to the middle", "split cell"}) {
      EXPECT_GT(accepted[needed], 10) << needed << " of " << name;
    }
    EXPECT_LT(Total(mesh, EntityKind::kCell), volume * (1 + 1e-9))
        << name;  // collapses may cut corners of a box
  }
}

TEST(OperatorsTest, SplitsAndSwapsKeepTheVolumeExactly) {
  const auto operators = AllOperators();
  for (auto& [name, mesh] : Solids()) {
    std::mt19937 rng(9);
    const double volume = Total(mesh, EntityKind::kCell);
    int swaps = 0;
    mesh.BeginBatch();
    for (int step = 0; step < 1500; ++step) {
      const Operator& op = operators[std::array<int, 4>{0, 4, 5, 6}[rng() % (step < 300 ? 4 : 3)]];
      if (op.kind == EntityKind::kEdge && op.name == std::string("split edge") && step > 300) continue;
      const EntityId id(op.kind, rng() % mesh.slots(op.kind).limit());
      if (!mesh.IsLive(id)) continue;
      swaps += Carry(mesh, op.plan, id).ok() && step > 300;
    }
    EXPECT_GT(swaps, 20) << name;
    EXPECT_NEAR(Total(mesh, EntityKind::kCell), volume, 1e-12 * volume) << name;
    EXPECT_EQ(NumInverted(mesh), 0);
    ExpectEqualsOracle(mesh, ModelOf(mesh));
  }
}

/// The reason with which an operator on the edge of two vertices is refused; "" when it is not.
std::string ReasonAt(Mesh& mesh, const Plan& plan, Slot a, Slot b) {
  const EdgeId e = mesh.FindEdge(VertexId(a), VertexId(b));
  EXPECT_TRUE(e.valid());
  mesh.BeginBatch();
  const std::string reason = ErrorReason(Carry(mesh, plan, e, kAnyShape));
  mesh.Rollback();
  return reason;
}

TEST(OperatorsTest, RefusalsSayWhy) {
  const auto operators = AllOperators();
  const Plan& collapse = operators[1].plan;
  const Plan& swap = operators[4].plan;
  Mesh tet = OneTet();
  EXPECT_EQ(ReasonAt(tet, swap, 0, 1), reason::kBoundary);
  EXPECT_EQ(ReasonAt(tet, collapse, 0, 1), reason::kWouldChangeTopology);
  Mesh book = Book(5);
  EXPECT_EQ(ReasonAt(book, swap, 0, 1), reason::kNonManifoldEdge);
  EXPECT_EQ(ReasonAt(book, swap, 0, 3), reason::kBoundary);
  Mesh hexes = TwoHexes();
  EXPECT_EQ(ReasonAt(hexes, swap, 4, 5), reason::kNotSimplex);
  Mesh wheel = TetWheel(5);
  EXPECT_EQ(ReasonAt(wheel, swap, 0, 1), "");
  EXPECT_EQ(ReasonAt(wheel, swap, 0, 2), reason::kBoundary);
  Mesh three = TetWheel(3);
  EXPECT_EQ(ReasonAt(three, swap, 0, 1), "");
  Mesh grid = TetGrid(2, 2, 2);  // its middle vertex is 13, with diagonals to the corners 0 and 26
  EXPECT_EQ(ReasonAt(grid, collapse, 13, 26), "");
  Mesh tall = TetGrid(1, 1, 3);
  EXPECT_EQ(ReasonAt(tall, collapse, 4, 11), reason::kBoundary);
  EXPECT_EQ(ReasonAt(hexes, collapse, 0, 1), "");
  Mesh surface = Octahedron();
  EXPECT_EQ(ReasonAt(surface, collapse, 0, 1), "");
  EXPECT_EQ(ReasonAt(surface, swap, 0, 1), "");
  Mesh danglers = TetWithDanglers();
  EXPECT_EQ(ReasonAt(danglers, operators[0].plan, 0, 1), "");
}

TEST(OperatorsTest, EveryRefusalNamesWhatStandsInTheWay) {
  for (auto& [name, mesh] : AllMeshes()) {
    for (const Operator& op : AllOperators()) {
      for (Slot slot = 0; slot < mesh.slots(op.kind).limit(); ++slot) {
        mesh.BeginBatch();
        const absl::Status status = Carry(mesh, op.plan, {op.kind, slot});
        mesh.Rollback();
        if (status.ok()) continue;
        const auto detail = GetErrorDetail(status);
        ASSERT_TRUE(detail) << status;
        EXPECT_NE(detail->Find("kind"), "") << status;
        EXPECT_NE(detail->Find("ids"), "") << status;
      }
    }
  }
}

/// A mesh of these vertices and elements.
Mesh MeshOf(const std::vector<Point>& points,
            const std::vector<std::pair<ElementType, std::vector<Slot>>>& elements) {
  Mesh mesh;
  for (const Point& p : points) EXPECT_TRUE(mesh.AddVertex(p).ok());
  for (const auto& [type, slots] : elements) {
    std::vector<VertexId> vertices(slots.begin(), slots.end());
    EXPECT_TRUE(mesh.AddElement(type, vertices).ok());
  }
  Commit(mesh);
  return mesh;
}

TEST(OperatorsTest, SwapsAtAFlatCellTurnNothingOver) {
  constexpr ElementType kTet = ElementType::kTetrahedron;
  const std::vector<Point> points = {{0, 0, -1}, {0, 0, 1},   {1, 0, 0},
                                     {-1, 0, 0}, {0, -20, 0}, {0.3, -0.3, 0}};
  Mesh ring = MeshOf(
      points, {{kTet, {0, 1, 2, 3}}, {kTet, {0, 1, 3, 4}}, {kTet, {0, 1, 4, 5}}, {kTet, {0, 1, 5, 2}}});
  ring.BeginBatch();
  ASSERT_TRUE(Carry(ring, AllOperators()[4].plan, ring.FindEdge(VertexId(0), VertexId(1))).ok());
  EXPECT_EQ(NumInverted(ring), 0);
  EXPECT_TRUE(ring.FindEdge(VertexId(3), VertexId(5)).valid());
  const std::vector<Point> two = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {2, 2, 0}, {0.3, 0.3, -1}};
  for (bool flat_first : {false, true}) {
    Mesh pair = flat_first ? MeshOf(two, {{kTet, {0, 1, 2, 3}}, {kTet, {0, 2, 1, 4}}})
                           : MeshOf(two, {{kTet, {0, 2, 1, 4}}, {kTet, {0, 1, 2, 3}}});
    pair.BeginBatch();
    const FaceId between = pair.FindFace({VertexId(0), VertexId(1), VertexId(2)});
    EXPECT_EQ(ErrorReason(Carry(pair, AllOperators()[5].plan, between)), reason::kWouldInvert) << flat_first;
  }
}

TEST(OperatorsTest, ACollapseThatWouldMakeTwoElementsEqualIsRefused) {
  constexpr ElementType kTet = ElementType::kTetrahedron;
  const std::vector<Point> points = {{0, 0, 1}, {0.2, 0.2, 0.3}, {1, 0, 0}, {0, 1, 0}, {-1, -1, 0}};
  Mesh solid = MeshOf(points, {{kTet, {1, 0, 2, 3}},
                               {kTet, {1, 0, 3, 4}},
                               {kTet, {1, 0, 4, 2}},
                               {kTet, {1, 2, 3, 4}},
                               {kTet, {0, 2, 3, 4}}});
  for (int op : {1, 2})
    EXPECT_EQ(ReasonAt(solid, AllOperators()[op].plan, 0, 1), reason::kLinkCondition) << op;
  Mesh surface = MeshOf({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {{ElementType::kQuad, {1, 0, 2, 3}},
                                                                       {ElementType::kTriangle, {1, 0, 3}},
                                                                       {ElementType::kTriangle, {0, 2, 3}}});
  EXPECT_EQ(ReasonAt(surface, AllOperators()[1].plan, 0, 1), reason::kLinkCondition);
}

TEST(OperatorsTest, DuplicateCellsCollapseTogether) {
  Mesh mesh = TetGrid(2, 2, 2);
  mesh.BeginBatch();
  const EntityId copy = *mesh.AddElement(ElementType::kTetrahedron, mesh.Vertices(CellId(0)));
  ASSERT_TRUE(mesh.Commit().ok());
  ASSERT_TRUE(mesh.FindTwin(CellId(copy.slot)).valid());
  const EdgeId e = mesh.FindEdge(VertexId(13), VertexId(26));
  ASSERT_EQ(mesh.Vertices(CellId(0))[3], VertexId(13));
  Patch patch;
  ASSERT_TRUE(PlanCollapseEdge(mesh, e, {.origin = VertexId(26)}, patch).ok());
  AppliedPatch applied;
  mesh.BeginBatch();
  EXPECT_TRUE(ApplyPatch(mesh, patch, applied).ok());
  EXPECT_FALSE(mesh.IsLive(VertexId(13)));
  ExpectEqualsOracle(mesh, ModelOf(mesh));
}

TEST(OperatorsTest, DuplicatesOfAFaceStandInItsWayToo) {
  Mesh mesh;
  for (const Point& p : std::vector<Point>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.3, 0.3, 1}, {0.3, 0.3, -1}}) {
    ASSERT_TRUE(mesh.AddVertex(p).ok());
  }
  Add(mesh, ElementType::kTetrahedron, {0, 1, 2, 3});
  Add(mesh, ElementType::kTetrahedron, {0, 2, 1, 4});
  const EntityId first = Add(mesh, ElementType::kTriangle, {0, 1, 2});
  const EntityId second = Add(mesh, ElementType::kTriangle, {0, 1, 2});
  ASSERT_TRUE(mesh.RemoveElement(first).ok());
  Commit(mesh);
  ASSERT_TRUE(mesh.IsDuplicate(second) && mesh.IsLive(first));
  mesh.BeginBatch();
  EXPECT_EQ(ErrorReason(Carry(mesh, AllOperators()[5].plan, first)), reason::kElementInTheWay);
  EXPECT_EQ(ErrorReason(Carry(mesh, AllOperators()[7].plan, second)), reason::kElementInTheWay);
}

TEST(OperatorsTest, WhereARingAndItsFaceAreThereNoEdgeCanBeSwapped) {
  Mesh mesh = TetWheel(3);
  Add(mesh, ElementType::kTriangle, {2, 3, 4});
  Commit(mesh);
  EXPECT_EQ(ReasonAt(mesh, AllOperators()[4].plan, 0, 1), reason::kFaceExists);
}

TEST(OperatorsTest, AttributesOfSplitVerticesLieBetweenAndElementsInheritTheirs) {
  Mesh mesh = OneTet();
  mesh.BeginBatch();
  ASSERT_TRUE(mesh.AddAttribute({"heat", EntityKind::kVertex, AttributeType::kFloat64, 1}).ok());
  ASSERT_TRUE(mesh.AddAttribute({"part", EntityKind::kCell, AttributeType::kInt32, 1}).ok());
  const double heat[] = {10, 20};
  const int32_t part = 7;
  const auto bytes = [](const auto& value) {
    return absl::MakeConstSpan(reinterpret_cast<const uint8_t*>(&value), sizeof(value));
  };
  for (Slot v : {0u, 1u}) ASSERT_TRUE(mesh.SetAttribute(0, v, bytes(heat[v])).ok());
  ASSERT_TRUE(mesh.SetAttribute(1, 0, bytes(part)).ok());
  Patch patch;
  const EdgeId e = mesh.FindEdge(VertexId(0), VertexId(1));
  ASSERT_TRUE(PlanSplitEdge(mesh, e, {.parameter = 0.25}, patch).ok());
  AppliedPatch applied;
  ASSERT_TRUE(ApplyPatch(mesh, patch, applied).ok());
  const double expected = mesh.Vertices(e)[0] == VertexId(0) ? 12.5 : 17.5;
  EXPECT_EQ(mesh.attributes()[0].Row(applied.new_vertices[0].slot()), bytes(expected));
  for (EntityId id : applied.added) EXPECT_EQ(mesh.attributes()[1].Row(id.slot), bytes(part));
}

}  // namespace
}  // namespace dynmesh::testing
