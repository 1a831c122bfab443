#include "tests/core/repair/repair_support.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "core/edit/geometry.h"
#include "core/mesh/validate.h"
#include "tests/support/oracle.h"

namespace dynmesh::testing {
namespace {

RepairReport Carry(Mesh& mesh, const RepairStep& step) {
  RepairReport result;
  const absl::Status status = RepairMesh(mesh, {&step, 1}, WorkMeter::Unlimited(),
                                         [&](size_t, const RepairReport& report) { result = report; });
  EXPECT_TRUE(status.ok()) << status;
  return result;
}

std::vector<EntityId> ElementsOf(const Mesh& mesh) {
  std::vector<EntityId> elements;
  for (const auto& [id, element] : ModelOf(mesh).elements) elements.push_back(id);
  return elements;
}

/// Adds an element of the given vertices, in that order.
void Put(Mesh& mesh, ElementType type, const std::vector<VertexId>& vertices) {
  const auto id = mesh.AddElement(type, vertices);
  ASSERT_TRUE(id.ok()) << id.status();
}

/// The vertices of an element in an order that mirrors it.
std::vector<VertexId> Mirrored(ElementType type, absl::Span<const VertexId> v) {
  switch (type) {
    case ElementType::kTriangle:
    case ElementType::kTetrahedron: {
      std::vector<VertexId> mirrored(v.begin(), v.end());
      std::swap(mirrored[0], mirrored[1]);
      return mirrored;
    }
    case ElementType::kQuad:
      return {v[3], v[2], v[1], v[0]};
    case ElementType::kPyramid:
      return {v[3], v[2], v[1], v[0], v[4]};
    case ElementType::kPrism:
      return {v[3], v[4], v[5], v[0], v[1], v[2]};
    case ElementType::kHexahedron:
      return {v[4], v[5], v[6], v[7], v[0], v[1], v[2], v[3]};
    default:
      return {v.begin(), v.end()};
  }
}

}  // namespace

RepairReport Repair(Mesh& mesh, const RepairStep& step) {
  const std::string before = Describe(mesh);
  mesh.BeginBatch();
  Carry(mesh, step);
  mesh.Rollback();
  EXPECT_EQ(Describe(mesh), before) << "rolled back";
  mesh.BeginBatch();
  const RepairReport report = Carry(mesh, step);
  ExpectEqualsOracle(mesh, ModelOf(mesh));
  Commit(mesh);
  const std::string after = Describe(mesh);
  mesh.BeginBatch();
  Carry(mesh, step);
  EXPECT_EQ(Describe(mesh), after) << "the second time";
  mesh.Rollback();
  return report;
}

std::vector<EntityId> Found(const RepairReport& report, RepairFinding finding) {
  EXPECT_EQ(report.Count(finding), report.Of(finding).entities.size());
  return report.Of(finding).entities;
}

int CountTurns(const Mesh& mesh) {
  std::map<std::vector<VertexId>, std::vector<std::vector<VertexId>>> sides;  // cycles by sorted vertices
  const auto add = [&](std::vector<VertexId> cycle) {
    std::vector<VertexId> sorted = cycle;
    std::sort(sorted.begin(), sorted.end());
    std::rotate(cycle.begin(), std::min_element(cycle.begin(), cycle.end()), cycle.end());
    sides[sorted].push_back(cycle);
  };
  for (const auto& [id, element] : ModelOf(mesh).elements) {
    const auto& v = element.vertices;
    const ElementTemplate& shape = TemplateOf(element.type);
    if (id.kind == EntityKind::kFace) {
      for (size_t k = 0; k < v.size(); ++k) add({v[k], v[(k + 1) % v.size()], VertexId()});
    }
    for (int i = 0; id.kind == EntityKind::kCell && i < shape.num_faces; ++i) {
      const auto face = FaceVertices(shape.faces[i], v);
      add({face.span().begin(), face.span().end()});
    }
  }
  int turns = 0;
  for (const auto& [key, cycles] : sides) turns += cycles.size() == 2 && cycles[0] == cycles[1];
  return turns;
}

Mesh Triangles(std::initializer_list<Point> points, std::initializer_list<std::array<Slot, 3>> triangles) {
  Mesh mesh;
  for (const Point& point : points) EXPECT_TRUE(mesh.AddVertex(point).ok());
  for (const auto& [a, b, c] : triangles) Add(mesh, ElementType::kTriangle, {a, b, c});
  Commit(mesh);
  return mesh;
}

Mesh CubeSurface() {
  return Triangles({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}},
                   {{0, 2, 1},
                    {0, 3, 2},
                    {4, 5, 6},
                    {4, 6, 7},
                    {0, 1, 5},
                    {0, 5, 4},
                    {1, 2, 6},
                    {1, 6, 5},
                    {2, 3, 7},
                    {2, 7, 6},
                    {3, 0, 4},
                    {3, 4, 7}});
}

Mesh Separated(const Mesh& mesh, std::mt19937& rng) {
  Mesh apart;
  std::vector<EntityId> elements = ElementsOf(mesh);
  std::shuffle(elements.begin(), elements.end(), rng);
  for (EntityId id : elements) {
    std::vector<VertexId> vertices;
    for (VertexId v : mesh.VerticesOf(id)) vertices.push_back(*apart.AddVertex(mesh.Position(v)));
    Put(apart, mesh.Type(id), vertices);
  }
  Commit(apart);
  return apart;
}

Mesh RandomlyReversed(const Mesh& mesh, std::mt19937& rng) {
  Mesh reversed;
  const ElementModel model = ModelOf(mesh);
  for (const auto& [v, point] : model.vertices) EXPECT_EQ(*reversed.AddVertex(point), v);
  for (const auto& [id, element] : model.elements) {
    Put(reversed, element.type, rng() % 2 ? Mirrored(element.type, element.vertices) : element.vertices);
  }
  Commit(reversed);
  return reversed;
}

}  // namespace dynmesh::testing
