#include "tests/support/meshes.h"

#include <gtest/gtest.h>

#include <cmath>

namespace dynmesh::testing {
namespace {

Mesh WithVertices(int n) {
  Mesh mesh;
  AddVertices(mesh, n);
  return mesh;
}

Slot GridSlot(int nx, int ny, int i, int j, int k) { return (k * (ny + 1) + j) * (nx + 1) + i; }

/// The eight corners of grid cell (i, j, k) in VTK order.
std::array<Slot, 8> Corners(int nx, int ny, int i, int j, int k) {
  const auto at = [&](int a, int b, int c) { return GridSlot(nx, ny, i + a, j + b, k + c); };
  return {at(0, 0, 0), at(1, 0, 0), at(1, 1, 0), at(0, 1, 0), at(0, 0, 1), at(1, 0, 1), at(1, 1, 1), at(0, 1, 1)};
}

template <typename Fn>
Mesh Grid(int nx, int ny, int nz, Fn add_cell) {
  Mesh mesh;
  for (int k = 0; k <= nz; ++k) {
    for (int j = 0; j <= ny; ++j) {
      for (int i = 0; i <= nx; ++i) EXPECT_TRUE(mesh.AddVertex({double(i), double(j), double(k)}).ok());
    }
  }
  for (int k = 0; k < nz; ++k) {
    for (int j = 0; j < ny; ++j) {
      for (int i = 0; i < nx; ++i) add_cell(mesh, Corners(nx, ny, i, j, k));
    }
  }
  Commit(mesh);
  return mesh;
}

}  // namespace

std::vector<VertexId> AddVertices(Mesh& mesh, int n) {
  std::vector<VertexId> ids;
  for (int i = 0; i < n; ++i) {
    const double t = mesh.NumLive(EntityKind::kVertex);
    ids.push_back(*mesh.AddVertex({std::sin(t), std::cos(1.7 * t), 0.3 * t}));
  }
  return ids;
}

EntityId Add(Mesh& mesh, ElementType type, std::initializer_list<Slot> slots) {
  std::vector<VertexId> vertices;
  for (Slot slot : slots) vertices.emplace_back(slot);
  const auto id = mesh.AddElement(type, vertices);
  EXPECT_TRUE(id.ok()) << id.status();
  return id.value_or(EntityId());
}

void Commit(Mesh& mesh) { EXPECT_TRUE(mesh.Commit().ok()); }

Mesh OneTet() {
  Mesh mesh = WithVertices(4);
  Add(mesh, ElementType::kTetrahedron, {0, 1, 2, 3});
  Commit(mesh);
  return mesh;
}

Mesh TetWheel(int n) {
  Mesh mesh = WithVertices(2 + n);
  for (int i = 0; i < n; ++i) Add(mesh, ElementType::kTetrahedron, {0, 1, Slot(2 + i), Slot(2 + (i + 1) % n)});
  Commit(mesh);
  return mesh;
}

Mesh TwoHexes() {
  Mesh mesh = WithVertices(12);
  Add(mesh, ElementType::kHexahedron, {0, 1, 2, 3, 4, 5, 6, 7});
  Add(mesh, ElementType::kHexahedron, {4, 5, 6, 7, 8, 9, 10, 11});
  Commit(mesh);
  return mesh;
}

Mesh HybridOfFour() {
  Mesh mesh = WithVertices(12);
  Add(mesh, ElementType::kHexahedron, {0, 1, 2, 3, 4, 5, 6, 7});
  Add(mesh, ElementType::kPyramid, {4, 5, 6, 7, 8});
  Add(mesh, ElementType::kPrism, {1, 9, 2, 5, 10, 6});
  Add(mesh, ElementType::kTetrahedron, {4, 5, 8, 11});
  Commit(mesh);
  return mesh;
}

Mesh Book(int n) {
  Mesh mesh = WithVertices(2 + n);
  for (int i = 0; i < n; ++i) Add(mesh, ElementType::kTriangle, {0, 1, Slot(2 + i)});
  Commit(mesh);
  return mesh;
}

Mesh MoebiusStrip(int n) {
  Mesh mesh = WithVertices(2 * n);
  for (int i = 0; i + 1 < n; ++i) {
    Add(mesh, ElementType::kQuad, {Slot(2 * i), Slot(2 * i + 1), Slot(2 * i + 3), Slot(2 * i + 2)});
  }
  Add(mesh, ElementType::kQuad, {Slot(2 * n - 2), Slot(2 * n - 1), 0, 1});
  Commit(mesh);
  return mesh;
}

Mesh BowTie() {
  Mesh mesh = WithVertices(7);
  Add(mesh, ElementType::kTriangle, {0, 1, 2});
  Add(mesh, ElementType::kTriangle, {0, 2, 3});
  Add(mesh, ElementType::kTriangle, {0, 4, 5});
  Add(mesh, ElementType::kTriangle, {0, 5, 6});
  Commit(mesh);
  return mesh;
}

Mesh Octahedron() {
  Mesh mesh = WithVertices(6);
  for (Slot i = 0; i < 4; ++i) {
    Add(mesh, ElementType::kTriangle, {i, (i + 1) % 4, 4});
    Add(mesh, ElementType::kTriangle, {(i + 1) % 4, i, 5});
  }
  Commit(mesh);
  return mesh;
}

Mesh Disk(int n) {
  Mesh mesh = WithVertices(n + 1);
  for (int i = 0; i < n; ++i) Add(mesh, ElementType::kTriangle, {0, Slot(1 + i), Slot(1 + (i + 1) % n)});
  Commit(mesh);
  return mesh;
}

Mesh TetWithDanglers() {
  Mesh mesh = WithVertices(7);
  Add(mesh, ElementType::kTetrahedron, {0, 1, 2, 3});
  Add(mesh, ElementType::kTriangle, {0, 1, 4});
  Add(mesh, ElementType::kWireEdge, {0, 5});
  Commit(mesh);
  return mesh;
}

Mesh HexGrid(int nx, int ny, int nz) {
  return Grid(nx, ny, nz, [](Mesh& mesh, const std::array<Slot, 8>& c) {
    Add(mesh, ElementType::kHexahedron, {c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7]});
  });
}

Mesh TetGrid(int nx, int ny, int nz) {
  constexpr int kPaths[6][2] = {{1, 2}, {2, 3}, {3, 7}, {7, 4}, {4, 5}, {5, 1}};  // round the diagonal 0-6
  return Grid(nx, ny, nz, [&](Mesh& mesh, const std::array<Slot, 8>& c) {
    for (const auto& path : kPaths) Add(mesh, ElementType::kTetrahedron, {c[0], c[path[0]], c[path[1]], c[6]});
  });
}

std::vector<NamedMesh> AllMeshes() {
  std::vector<NamedMesh> meshes;
  meshes.push_back({"OneTet", OneTet()});
  meshes.push_back({"TetWheel", TetWheel(7)});
  meshes.push_back({"TwoHexes", TwoHexes()});
  meshes.push_back({"HybridOfFour", HybridOfFour()});
  meshes.push_back({"Book", Book(3)});
  meshes.push_back({"MoebiusStrip", MoebiusStrip(5)});
  meshes.push_back({"BowTie", BowTie()});
  meshes.push_back({"Octahedron", Octahedron()});
  meshes.push_back({"Disk", Disk(5)});
  meshes.push_back({"TetWithDanglers", TetWithDanglers()});
  meshes.push_back({"HexGrid", HexGrid(2, 3, 2)});
  meshes.push_back({"TetGrid", TetGrid(2, 2, 2)});
  return meshes;
}

}  // namespace dynmesh::testing
