#include "core/mesh/element_type.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <set>
#include <vector>

namespace dynmesh {
namespace {

using testing::ElementsAre;
using Vector = std::array<double, 3>;

// Nodes of a reference element of each type, in VTK's order and right way round.
std::vector<Vector> ReferenceNodes(ElementType type) {
  switch (type) {
    case ElementType::kTetrahedron:
      return {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    case ElementType::kPyramid:
      return {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.5, 0.5, 1}};
    case ElementType::kPrism:
      return {{0, 0, 0}, {0, 1, 0}, {1, 0, 0}, {0, 0, 1}, {0, 1, 1}, {1, 0, 1}};
    default:
      return {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
  }
}

Vector Minus(const Vector& a, const Vector& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
double Dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Vector Cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

Vector Centre(const std::vector<Vector>& nodes) {
  Vector centre = {0, 0, 0};
  for (const Vector& node : nodes) {
    for (int axis = 0; axis < 3; ++axis) centre[axis] += node[axis] / nodes.size();
  }
  return centre;
}

std::vector<std::vector<int>> Faces(ElementType type) {
  const ElementTemplate& t = TemplateOf(type);
  std::vector<std::vector<int>> faces;
  for (int f = 0; f < t.num_faces; ++f) {
    faces.emplace_back(t.faces[f].vertices, t.faces[f].vertices + t.faces[f].size);
  }
  return faces;
}

std::vector<std::pair<int, int>> Edges(ElementType type) {
  const ElementTemplate& t = TemplateOf(type);
  std::vector<std::pair<int, int>> edges;
  for (int e = 0; e < t.num_edges; ++e) edges.emplace_back(t.edges[e].vertices[0], t.edges[e].vertices[1]);
  return edges;
}

TEST(ElementTypeTest, TheTetrahedronIsTheRowOfThePapersTable2) {
  const ElementTemplate& t = TemplateOf(ElementType::kTetrahedron);
  EXPECT_EQ(t.num_vertices, 4);
  EXPECT_EQ(t.num_edges, 6);
  EXPECT_EQ(t.num_faces, 4);
  EXPECT_EQ(t.num_smart_edges, 2);
  EXPECT_EQ(t.num_smart_vertices, 3);
  const LocalEdge& first = t.edges[t.smart_edges[0]];
  const LocalEdge& second = t.edges[t.smart_edges[1]];
  EXPECT_EQ((std::set<int>{first.vertices[0], first.vertices[1], second.vertices[0], second.vertices[1]}),
            (std::set<int>{0, 1, 2, 3}))
      << "the two smart edges are opposite";
}

TEST(ElementTypeTest, EdgesAreVtksInVtksOrder) {
  using E = std::pair<int, int>;
  EXPECT_THAT(Edges(ElementType::kTetrahedron),
              ElementsAre(E{0, 1}, E{1, 2}, E{2, 0}, E{0, 3}, E{1, 3}, E{2, 3}));
  EXPECT_THAT(Edges(ElementType::kPyramid),
              ElementsAre(E{0, 1}, E{1, 2}, E{2, 3}, E{3, 0}, E{0, 4}, E{1, 4}, E{2, 4}, E{3, 4}));
  EXPECT_THAT(Edges(ElementType::kPrism),
              ElementsAre(E{0, 1}, E{1, 2}, E{2, 0}, E{3, 4}, E{4, 5}, E{5, 3}, E{0, 3}, E{1, 4}, E{2, 5}));
  EXPECT_THAT(Edges(ElementType::kHexahedron),
              ElementsAre(E{0, 1}, E{1, 2}, E{3, 2}, E{0, 3}, E{4, 5}, E{5, 6}, E{7, 6}, E{4, 7}, E{0, 4},
                          E{1, 5}, E{3, 7}, E{2, 6}));
}

TEST(ElementTypeTest, FacesAreVtksInVtksOrder) {
  using F = std::vector<int>;
  EXPECT_THAT(Faces(ElementType::kTetrahedron), ElementsAre(F{0, 1, 3}, F{1, 2, 3}, F{2, 0, 3}, F{0, 2, 1}));
  EXPECT_THAT(Faces(ElementType::kPyramid),
              ElementsAre(F{0, 3, 2, 1}, F{0, 1, 4}, F{1, 2, 4}, F{2, 3, 4}, F{3, 0, 4}));
  EXPECT_THAT(Faces(ElementType::kPrism),
              ElementsAre(F{0, 1, 2}, F{3, 5, 4}, F{0, 3, 4, 1}, F{1, 4, 5, 2}, F{2, 5, 3, 0}));
  EXPECT_THAT(Faces(ElementType::kHexahedron), ElementsAre(F{0, 4, 7, 3}, F{1, 2, 6, 5}, F{0, 1, 5, 4},
                                                           F{3, 7, 6, 2}, F{0, 3, 2, 1}, F{4, 5, 6, 7}));
}

TEST(ElementTypeTest, FacesOfCellsPointOutwards) {
  for (ElementType type :
       {ElementType::kTetrahedron, ElementType::kPyramid, ElementType::kPrism, ElementType::kHexahedron}) {
    const std::vector<Vector> nodes = ReferenceNodes(type);
    for (const std::vector<int>& face : Faces(type)) {
      const Vector normal =
          Cross(Minus(nodes[face[1]], nodes[face[0]]), Minus(nodes[face[2]], nodes[face[0]]));
      EXPECT_GT(Dot(normal, Minus(nodes[face[0]], Centre(nodes))), 0) << ElementTypeName(type);
    }
  }
}

TEST(ElementTypeTest, FaceEdgesJoinConsecutiveFaceVertices) {
  for (ElementType type : kElementTypes) {
    const ElementTemplate& t = TemplateOf(type);
    for (int f = 0; f < t.num_faces; ++f) {
      const LocalFace& face = t.faces[f];
      for (int k = 0; k < face.size; ++k) {
        const LocalEdge& edge = t.edges[face.edges[k]];
        const std::set<int> ends = {face.vertices[k], face.vertices[(k + 1) % face.size]};
        EXPECT_EQ((std::set<int>{edge.vertices[0], edge.vertices[1]}), ends) << t.name << ", face " << f;
      }
    }
  }
}

TEST(ElementTypeTest, EveryFaceIsLookedUpRoundOneOfItsOwnSmartEdges) {
  for (ElementType type : kElementTypes) {
    const ElementTemplate& t = TemplateOf(type);
    for (int f = 0; f < t.num_faces; ++f) {
      ASSERT_LT(t.smart_edge_of_face[f], t.num_smart_edges);
      const int smart_edge = t.smart_edges[t.smart_edge_of_face[f]];
      const std::set<int> edges(t.faces[f].edges, t.faces[f].edges + t.faces[f].size);
      EXPECT_TRUE(edges.count(smart_edge)) << t.name << ", face " << f;
    }
  }
}

TEST(ElementTypeTest, SmartSetsAreAsSmallAsTheyCanBe) {
  const auto smart_edges = [](ElementType type) { return int{TemplateOf(type).num_smart_edges}; };
  const auto smart_vertices = [](ElementType type) { return int{TemplateOf(type).num_smart_vertices}; };
  std::vector<int> edges, vertices;
  for (ElementType type : kElementTypes) edges.push_back(smart_edges(type));
  for (ElementType type : kElementTypes) vertices.push_back(smart_vertices(type));
  EXPECT_THAT(edges, ElementsAre(0, 1, 1, 2, 3, 3, 3));
  EXPECT_THAT(vertices, ElementsAre(1, 2, 2, 3, 3, 4, 4));
}

TEST(ElementTypeTest, SmartEdgesOfAHexahedronAreMutuallySkew) {
  const ElementTemplate& t = TemplateOf(ElementType::kHexahedron);
  const std::vector<Vector> nodes = ReferenceNodes(ElementType::kHexahedron);
  for (int i = 0; i < 3; ++i) {
    const uint8_t(&a)[2] = t.edges[t.smart_edges[i]].vertices;
    const uint8_t(&b)[2] = t.edges[t.smart_edges[(i + 1) % 3]].vertices;
    const Vector normal = Cross(Minus(nodes[a[1]], nodes[a[0]]), Minus(nodes[b[1]], nodes[b[0]]));
    EXPECT_NE(Dot(normal, Minus(nodes[b[0]], nodes[a[0]])), 0);
  }
}

TEST(ElementTypeTest, TemplatesAgreeWithTheInlineTables) {
  for (ElementType type : kElementTypes) {
    const ElementTemplate& t = TemplateOf(type);
    EXPECT_EQ(t.type, type);
    EXPECT_EQ(t.kind, KindOf(type));
    EXPECT_EQ(t.num_vertices, NumVertices(type));
    EXPECT_EQ(ElementTypeName(type), t.name);
  }
  EXPECT_EQ(ElementTypeName(ElementType::kUnspecified), "unspecified");
  EXPECT_EQ(ElementTypeName(static_cast<ElementType>(200)), "unspecified");
}

}  // namespace
}  // namespace dynmesh
