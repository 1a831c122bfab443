#include "core/mesh/rings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "core/mesh/error.h"
#include "core/mesh/relations.h"
#include "tests/support/count_down.h"
#include "tests/support/meshes.h"
#include "tests/support/random_edits.h"

namespace dynmesh::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

std::vector<Slot> Ring(const Mesh& mesh, EntityKind kind, Slot start, uint32_t rings) {
  std::vector<Slot> row;
  EXPECT_TRUE(RingWalk(mesh, kind, WorkMeter::Unlimited()).Walk(start, rings, row).ok());
  return row;
}

/// Adjacency, k times over.
std::vector<Slot> BruteRing(const Mesh& mesh, EntityKind kind, Slot start, uint32_t rings) {
  std::set<Slot> reached = {start};
  for (uint32_t ring = 0; ring < rings; ++ring) {
    for (Slot slot : std::set<Slot>(reached)) {
      std::vector<Slot> adjacent;
      AppendNeighbors(mesh, {kind, kind}, slot, adjacent);
      reached.insert(adjacent.begin(), adjacent.end());
    }
  }
  reached.erase(start);
  return {reached.begin(), reached.end()};
}

void ExpectRings(const Mesh& mesh) {
  for (EntityKind kind : kEntityKinds) {
    RingWalk walk(mesh, kind, WorkMeter::Unlimited());  // one walker for all: it must leave nothing behind
    mesh.slots(kind).live().ForEach([&](Slot start) {
      for (uint32_t rings : {0, 1, 2, 3, 100}) {
        std::vector<Slot> row;
        ASSERT_TRUE(walk.Walk(start, rings, row).ok());
        EXPECT_EQ(row, BruteRing(mesh, kind, start, std::min(rings, 12u)))
            << EntityKindName(kind) << " " << start << ", " << rings << " rings";
      }
    });
  }
}

TEST(RingsTest, RingsAreAdjacencyOverAndOver) {
  for (const NamedMesh& named : AllMeshes()) {
    SCOPED_TRACE(named.name);
    ExpectRings(named.mesh);
  }
}

TEST(RingsTest, RingsOfBrokenMeshesToo) {
  for (uint32_t seed = 0; seed < 8; ++seed) {
    SCOPED_TRACE(seed);
    Mesh mesh;
    ElementModel model;
    RandomEditor editor(mesh, model, seed);
    for (int i = 0; i < 60; ++i) editor.Edit();
    Commit(mesh);
    ExpectRings(mesh);
  }
}

TEST(RingsTest, AWireIsWalkedAStepARing) {
  Mesh mesh;
  AddVertices(mesh, 6);
  for (Slot i = 0; i < 5; ++i) Add(mesh, ElementType::kWireEdge, {i, i + 1});
  Commit(mesh);
  EXPECT_THAT(Ring(mesh, EntityKind::kVertex, 2, 0), IsEmpty());
  EXPECT_THAT(Ring(mesh, EntityKind::kVertex, 2, 1), ElementsAre(1, 3));
  EXPECT_THAT(Ring(mesh, EntityKind::kVertex, 2, 2), ElementsAre(0, 1, 3, 4));
  EXPECT_THAT(Ring(mesh, EntityKind::kEdge, 0, 2), ElementsAre(1, 2));
  EXPECT_THAT(Ring(mesh, EntityKind::kVertex, 2, 0xffffffffu), ElementsAre(0, 1, 3, 4, 5));
}

TEST(RingsTest, LongRowsAscend) {
  const Mesh mesh = TetGrid(14, 14, 14);
  const std::vector<Slot> row = Ring(mesh, EntityKind::kCell, 7, 1000);
  ASSERT_EQ(row.size(), mesh.NumLive(EntityKind::kCell) - 1);
  EXPECT_TRUE(std::is_sorted(row.begin(), row.end()));
}

TEST(RingsTest, AHubIsGoneThroughOnceHoweverOftenItIsMet) {
  constexpr int kSpokes = 30'000;
  Mesh mesh;
  AddVertices(mesh, kSpokes + 1);
  for (Slot i = 1; i <= kSpokes; ++i) Add(mesh, ElementType::kWireEdge, {0, i});
  Commit(mesh);
  CountDown meter(4 * kSpokes);
  std::vector<Slot> row;
  ASSERT_TRUE(RingWalk(mesh, EntityKind::kEdge, meter).Walk(0, 5, row).ok());
  EXPECT_EQ(row.size(), kSpokes - 1u);
  CountDown few(kSpokes / 2);
  EXPECT_EQ(RingWalk(mesh, EntityKind::kEdge, few).Walk(0, 5, row), few.error());
  EXPECT_EQ(few.charges_after_end(), 0);
}

}  // namespace
}  // namespace dynmesh::testing
