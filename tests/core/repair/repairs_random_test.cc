// Repairs of random meshes against brute force.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "tests/core/repair/repair_support.h"
#include "tests/support/oracle.h"
#include "tests/support/random_edits.h"

namespace dynmesh::testing {
namespace {

std::array<uint32_t, kNumEntityKinds> Counts(const Mesh& mesh) {
  std::array<uint32_t, kNumEntityKinds> counts;
  for (EntityKind kind : kEntityKinds) counts[Dimension(kind)] = mesh.NumLive(kind);
  return counts;
}

TEST(RepairsRandomTest, WeldingWhatWasSeparatedGivesBackTheMesh) {
  std::mt19937 rng(21);
  for (auto& [name, mesh] : AllMeshes()) {
    SCOPED_TRACE(name);
    if (name == std::string("TetWithDanglers")) continue;  // its isolated vertex belongs to no element
    Mesh apart = Separated(mesh, rng);
    EXPECT_GE(apart.NumLive(EntityKind::kVertex), mesh.NumLive(EntityKind::kVertex));
    Repair(apart, WeldStep{1e-9});
    EXPECT_EQ(Counts(apart), Counts(mesh));
    EXPECT_EQ(Euler(apart), Euler(mesh));
    EXPECT_DOUBLE_EQ(TotalMeasure(apart, EntityKind::kCell), TotalMeasure(mesh, EntityKind::kCell));
  }
}

TEST(RepairsRandomTest, WeldedVerticesAreTheNearestThatStayAndTheseAreApart) {
  for (uint32_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 rng(seed);
    Mesh mesh;
    const double tolerance = 0.01 * (1 + rng() % 30);
    for (int i = 0; i < 300; ++i) {
      ASSERT_TRUE(mesh.AddVertex({rng() % 1000 / 1e3, rng() % 1000 / 1e3, rng() % 100 / 1e3}).ok());
    }
    Commit(mesh);
    const ElementModel before = ModelOf(mesh);
    Repair(mesh, WeldStep{tolerance});
    const ElementModel after = ModelOf(mesh);
    const auto distance = [](const Point& a, const Point& b) {
      return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
    };
    for (const auto& [v, point] : before.vertices) {
      const bool stays = std::none_of(after.vertices.begin(), after.vertices.end(), [&](const auto& other) {
        return other.first < v && distance(other.second, point) <= tolerance;
      });
      ASSERT_EQ(after.vertices.count(v), stays) << v.slot();
    }
  }
}

TEST(RepairsRandomTest, WhatIsOrientableTurnsAlikeAfterwards) {
  std::mt19937 rng(22);
  for (int trial = 0; trial < 10; ++trial) {
    for (const Mesh& mesh : {Octahedron(), CubeSurface(), Disk(9), TetGrid(2, 2, 1), HexGrid(2, 1, 2)}) {
      Mesh reversed = RandomlyReversed(mesh, rng);
      const RepairReport report = Repair(reversed, OrientStep{});
      EXPECT_EQ(report.Count(RepairFinding::kNotOrientable), 0u);
      EXPECT_EQ(CountTurns(reversed), 0);
      EXPECT_NEAR(TotalMeasure(reversed, EntityKind::kCell), TotalMeasure(mesh, EntityKind::kCell), 1e-12);
    }
  }
}

/// By brute force: whether the faces at a vertex form one fan, across edges of at most two faces.
bool IsManifoldSurface(const Mesh& mesh) {
  const ElementModel model = ModelOf(mesh);
  std::map<std::set<VertexId>, std::vector<EntityId>> edges;
  std::map<VertexId, std::set<EntityId>> faces;
  for (const auto& [id, element] : model.elements) {
    const auto& v = element.vertices;
    for (size_t k = 0; k < v.size(); ++k) {
      edges[{v[k], v[(k + 1) % v.size()]}].push_back(id);
      faces[v[k]].insert(id);
    }
  }
  for (const auto& [ends, uses] : edges) {
    if (uses.size() > 2) return false;
  }
  for (const auto& [v, star] : faces) {
    std::set<EntityId> reached = {*star.begin()};
    for (bool grew = true; grew;) {
      grew = false;
      for (const auto& [ends, uses] : edges) {
        if (ends.count(v) == 0 || uses.size() != 2) continue;
        if (reached.count(uses[0]) == reached.count(uses[1])) continue;
        reached.insert(uses.begin(), uses.end());
        grew = true;
      }
    }
    if (reached.size() != star.size()) return false;
  }
  return true;
}

TEST(RepairsRandomTest, AnySoupOfTrianglesAndQuadsIsManifoldOnceSplit) {
  int broken = 0;
  for (uint32_t seed = 1; seed <= 60; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Mesh mesh;
    std::mt19937 rng(seed);
    AddVertices(mesh, 12);
    for (int i = 0; i < 25; ++i) {
      std::vector<VertexId> all;
      for (Slot v = 0; v < 12; ++v) all.emplace_back(v);
      std::shuffle(all.begin(), all.end(), rng);
      all.resize(rng() % 4 ? 3 : 4);
      ASSERT_TRUE(mesh.AddElement(all.size() == 3 ? ElementType::kTriangle : ElementType::kQuad, all).ok());
    }
    Commit(mesh);
    broken += !IsManifoldSurface(mesh);
    const uint32_t faces = mesh.NumElements(EntityKind::kFace);
    Repair(mesh, SplitNonManifoldStep{});
    EXPECT_TRUE(IsManifoldSurface(mesh));
    EXPECT_EQ(mesh.NumElements(EntityKind::kFace), faces);
  }
  EXPECT_GT(broken, 50);
}

/// By brute force: whether the cells at each vertex hang together through faces at it that just two of them
/// have.
bool CellsHangTogether(const Mesh& mesh) {
  std::map<std::set<VertexId>, std::set<EntityId>> faces;
  std::map<VertexId, std::set<EntityId>> stars;
  for (const auto& [id, element] : ModelOf(mesh).elements) {
    const ElementTemplate& shape = TemplateOf(element.type);
    for (int i = 0; i < shape.num_faces; ++i) {
      const FaceVertices face(shape.faces[i], element.vertices);
      faces[{face.span().begin(), face.span().end()}].insert(id);
    }
    for (VertexId v : element.vertices) stars[v].insert(id);
  }
  for (const auto& [v, star] : stars) {
    std::set<EntityId> reached = {*star.begin()};
    for (size_t before = 0; before != reached.size();) {
      before = reached.size();
      for (const auto& [vertices, cells] : faces) {
        if (vertices.count(v) == 0 || cells.size() != 2) continue;
        if (reached.count(*cells.begin()) + reached.count(*cells.rbegin()) == 1) {
          reached.insert(cells.begin(), cells.end());
        }
      }
    }
    if (reached.size() != star.size()) return false;
  }
  return true;
}

TEST(RepairsRandomTest, AnySoupOfTetrahedraHangsTogetherAtEachVertexOnceSplit) {
  int broken = 0;
  for (uint32_t seed = 1; seed <= 30; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Mesh mesh;
    std::mt19937 rng(seed);
    const std::vector<VertexId> vertices = AddVertices(mesh, 9);
    std::set<std::set<VertexId>> known;
    for (int i = 0; i < 14; ++i) {
      std::vector<VertexId> all = vertices;
      std::shuffle(all.begin(), all.end(), rng);
      all.resize(4);
      if (!known.insert({all.begin(), all.end()}).second) continue;
      ASSERT_TRUE(mesh.AddElement(ElementType::kTetrahedron, all).ok());
    }
    Commit(mesh);
    broken += !CellsHangTogether(mesh);
    const uint32_t cells = mesh.NumElements(EntityKind::kCell);
    Repair(mesh, SplitNonManifoldStep{});
    EXPECT_TRUE(CellsHangTogether(mesh));
    EXPECT_EQ(mesh.NumElements(EntityKind::kCell), cells);
  }
  EXPECT_GT(broken, 20);
}

TEST(RepairsRandomTest, EveryStepOnMeshesBrokenInAnyWayKeepsThemSoundAndFindsNothingTheSecondTime) {
  for (uint32_t seed = 1; seed <= 40; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Mesh mesh;
    ElementModel model;
    RandomEditor editor(mesh, model, seed,
                        {.max_vertices = 10 + int(seed % 20), .attributes = seed % 3 == 0});
    for (int i = 0; i < 120; ++i) editor.Edit();
    Commit(mesh);
    std::vector<RepairStep> steps = {RemoveDuplicatesStep{{.isolated_vertices = true}}, WeldStep{0.3},
                                     SplitNonManifoldStep{}, OrientStep{}, FillHolesStep{50}};
    std::shuffle(steps.begin(), steps.end(), editor.rng());
    for (const RepairStep& step : steps) Repair(mesh, step);
  }
}

}  // namespace
}  // namespace dynmesh::testing
