#include "tests/support/shaped_meshes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <vector>

#include "core/mesh/vector.h"
#include "tests/support/meshes.h"

namespace dynmesh::testing {
namespace {

double Length(const Point& p) { return std::sqrt(Dot(p, p)); }

double SixVolumes(const Mesh& mesh, CellId c) {
  const auto v = mesh.Vertices(c);
  const Point a = mesh.Position(v[0]);
  return Dot(Cross(mesh.Position(v[1]) - a, mesh.Position(v[2]) - a), mesh.Position(v[3]) - a);
}

bool HasTurnedCell(const Mesh& mesh, VertexId v) {
  for (EdgeId e : mesh.IncidentEdges(v)) {
    for (FaceId f : mesh.IncidentFaces(e)) {
      for (CellId c : mesh.IncidentCells(f)) {
        if (SixVolumes(mesh, c) <= 0) return true;
      }
    }
  }
  return false;
}

void MoveAll(Mesh& mesh, Point (*to)(const Point&, int), int n) {
  mesh.slots(EntityKind::kVertex).live().ForEach([&](Slot slot) {
    EXPECT_TRUE(mesh.MoveVertex(VertexId(slot), to(mesh.Position(VertexId(slot)), n)).ok());
  });
  Commit(mesh);
}

}  // namespace

Mesh GradedCube(int n) {
  Mesh mesh = TetGrid(n, n, n);
  MoveAll(
      mesh,
      [](const Point& p, int size) {
        Point to;
        for (int axis = 0; axis < 3; ++axis) to[axis] = std::pow(p[axis] / size, 1.3);
        return to;
      },
      n);
  return mesh;
}

void Shake(Mesh& mesh, double share, uint32_t seed) {
  std::mt19937 rng(seed);
  std::uniform_real_distribution<double> shift(-share, share);
  mesh.slots(EntityKind::kVertex).live().ForEach([&](Slot slot) {
    const VertexId v(slot);
    if (mesh.IsOnBoundary(v)) return;
    const Point from = mesh.Position(v);
    double shortest = 1e300;
    for (EdgeId e : mesh.IncidentEdges(v)) {
      const auto ends = mesh.Vertices(e);
      shortest = std::min(shortest, Length(mesh.Position(ends[0]) - mesh.Position(ends[1])));
    }
    EXPECT_TRUE(mesh.MoveVertex(v, from + shortest * Point{shift(rng), shift(rng), shift(rng)}).ok());
    if (HasTurnedCell(mesh, v)) {
      EXPECT_TRUE(mesh.MoveVertex(v, from).ok());
    }
  });
  Commit(mesh);
}

Mesh Sphere(int levels) {
  const int n = 1 << levels;
  Mesh mesh;
  std::map<Point, Slot> slots;
  const auto vertex = [&](const Point& on_octahedron) {
    const Point place = (1 / Length(on_octahedron)) * on_octahedron;
    const auto [known, is_new] = slots.emplace(on_octahedron, slots.size());
    if (is_new) {
      EXPECT_TRUE(mesh.AddVertex(place).ok());
    }
    return known->second;
  };
  for (int side = 0; side < 8; ++side) {
    const double x = side & 1 ? -1 : 1, y = side & 2 ? -1 : 1, z = side & 4 ? -1 : 1;
    const auto at = [&](int i, int j) {
      return vertex({i == 0 ? 0 : x * i, j == 0 ? 0 : y * j, i + j == n ? 0 : z * (n - i - j)});
    };
    const auto add = [&](Slot a, Slot b, Slot c) {
      x* y* z > 0 ? Add(mesh, ElementType::kTriangle, {a, b, c})
                  : Add(mesh, ElementType::kTriangle, {a, c, b});
    };
    for (int i = 0; i < n; ++i) {
      for (int j = 0; i + j < n; ++j) {
        add(at(i, j), at(i + 1, j), at(i, j + 1));
        if (i + j + 1 < n) add(at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
      }
    }
  }
  Commit(mesh);
  return mesh;
}

Mesh LBlock(int n) {
  Mesh mesh = TetGrid(2 * n, 2 * n, 2 * n);
  std::vector<Slot> outside;
  mesh.slots(EntityKind::kCell).live().ForEach([&](Slot c) {
    Point low = {1e300, 1e300, 1e300};
    for (VertexId v : mesh.Vertices(CellId(c))) {
      for (int axis = 0; axis < 3; ++axis) low[axis] = std::min(low[axis], mesh.Position(v)[axis]);
    }
    if (*std::min_element(low.begin(), low.end()) >= n) outside.push_back(c);
  });
  EXPECT_TRUE(mesh.RemoveElements(EntityKind::kCell, outside).ok());
  std::vector<VertexId> lonely;
  mesh.slots(EntityKind::kVertex).live().ForEach([&](Slot v) {
    if (mesh.IncidentEdges(VertexId(v)).empty()) lonely.push_back(VertexId(v));
  });
  for (VertexId v : lonely) EXPECT_TRUE(mesh.RemoveVertex(v).ok());
  MoveAll(
      mesh, [](const Point& p, int size) { return (1.0 / size) * p; }, n);
  return mesh;
}

}  // namespace dynmesh::testing
