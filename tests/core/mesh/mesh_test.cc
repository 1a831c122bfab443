// Laws of the mesh on small hand-made meshes. Random edits: mesh_random_test.cc.

#include "core/mesh/mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/mesh/estimate.h"
#include "core/mesh/relations.h"
#include "core/mesh/validate.h"
#include "tests/support/meshes.h"
#include "tests/support/oracle.h"

namespace dynmesh {

/// Breaks one invariant at a time.
class MeshTestPeer {
 public:
  static void SpoilChecksum(Mesh& mesh) { ++mesh.checksum_.topology; }
  static void SpoilBoundaryBit(Mesh& mesh) { mesh.boundary_[2].Clear(0); }
  static void SpoilBoundaryCounter(Mesh& mesh) { ++mesh.boundary_uses_[1][0]; }
  static void SpoilCode(Mesh& mesh) {
    const OrientedFace oriented = mesh.cell_faces_[1];
    mesh.cell_faces_[1] = OrientedFace(oriented.face(), FaceCode{static_cast<uint8_t>(oriented.code().value ^ 1)});
  }
  static void SpoilList(Mesh& mesh) { mesh.vertex_edges_.Add(0, EdgeId(0)); }
  static void SpoilElementFlag(Mesh& mesh) { mesh.flags_[2][4] &= ~Mesh::kElementFlag; }
  static void SpoilDuplicateFlag(Mesh& mesh) { mesh.flags_[1][0] |= Mesh::kDuplicateFlag; }
  static void SpoilEdge(Mesh& mesh) { mesh.face_edges_[0] = mesh.face_edges_[1]; }
  static void SpoilStamp(Mesh& mesh) { mesh.changed_[3].Touch(0, 77); }
  static void SpoilLiveness(Mesh& mesh) { mesh.slots_[0].Free(1); }
  static void SpoilCount(Mesh& mesh) { ++mesh.num_elements_[3]; }
};

namespace testing {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr EntityKind V = EntityKind::kVertex, E = EntityKind::kEdge, F = EntityKind::kFace, C = EntityKind::kCell;

std::vector<uint32_t> Counts(const Mesh& mesh) {
  return {mesh.NumLive(V), mesh.NumLive(E), mesh.NumLive(F), mesh.NumLive(C)};
}

std::vector<Slot> Row(const Mesh& mesh, EntityKind from, EntityKind to, Slot slot) {
  std::vector<Slot> row;
  AppendNeighbors(mesh, {from, to}, slot, row);
  return row;
}

std::vector<VertexId> Ids(std::initializer_list<Slot> slots) {
  std::vector<VertexId> ids;
  for (Slot slot : slots) ids.emplace_back(slot);
  return ids;
}

TEST(MeshTest, EverySmallMeshEqualsBruteForce) {
  for (const NamedMesh& named : AllMeshes()) {
    SCOPED_TRACE(named.name);
    ExpectEqualsOracle(named.mesh, ModelOf(named.mesh));
  }
}

TEST(MeshTest, ElementsBringTheirFacesAndEdges) {
  EXPECT_THAT(Counts(OneTet()), ElementsAre(4, 6, 4, 1));
  EXPECT_THAT(Counts(TwoHexes()), ElementsAre(12, 20, 11, 2));
  EXPECT_THAT(Counts(HybridOfFour()), ElementsAre(12, 12 + 4 + 5 + 3, 6 + 4 + 4 + 3, 4));
  EXPECT_THAT(Counts(Octahedron()), ElementsAre(6, 12, 8, 0));
  EXPECT_THAT(Counts(MoebiusStrip(5)), ElementsAre(10, 15, 5, 0));
  EXPECT_THAT(Counts(HexGrid(2, 3, 2)), ElementsAre(36, 75, 52, 12));
}

TEST(MeshTest, RemovingACellFreesItsUnsharedFaces) {
  Mesh mesh = TwoHexes();
  ASSERT_TRUE(mesh.RemoveElement(CellId(0)).ok());
  Commit(mesh);
  EXPECT_THAT(Counts(mesh), ElementsAre(12, 12, 6, 1));
  EXPECT_THAT(Validate(mesh), IsEmpty());
}

TEST(MeshTest, ThreeFacesOnAnEdgeAreKept) {
  const Mesh mesh = Book(3);
  EXPECT_THAT(Row(mesh, E, F, mesh.FindEdge(VertexId(0), VertexId(1)).slot()), ElementsAre(0, 1, 2));
  EXPECT_FALSE(mesh.IsOnBoundary(mesh.FindEdge(VertexId(0), VertexId(1))));
}

TEST(MeshTest, MoreThanTwoCellsOnAFaceAreKept) {
  Mesh mesh;
  AddVertices(mesh, 8);
  for (Slot apex = 3; apex < 8; ++apex) Add(mesh, ElementType::kTetrahedron, {0, 1, 2, apex});
  Commit(mesh);
  const FaceId shared = mesh.FindFace(Ids({2, 1, 0}));
  EXPECT_THAT(Row(mesh, F, C, shared.slot()), ElementsAre(0, 1, 2, 3, 4));
  EXPECT_FALSE(mesh.IsOnBoundary(shared));
  for (Slot cell = 0; cell < 4; ++cell) ASSERT_TRUE(mesh.RemoveElement(CellId(cell)).ok());
  EXPECT_THAT(Row(mesh, F, C, shared.slot()), ElementsAre(4));
  EXPECT_TRUE(mesh.IsOnBoundary(shared));
  EXPECT_THAT(Validate(mesh), IsEmpty());
}

TEST(MeshTest, ADanglingFaceBecomesACellsFaceAndOutlivesTheCell) {
  Mesh mesh = OneTet();
  const auto face = mesh.AddElement(ElementType::kTriangle, Ids({2, 1, 0}));
  ASSERT_TRUE(face.ok());
  EXPECT_THAT(Counts(mesh), ElementsAre(4, 6, 4, 1));
  EXPECT_THAT(mesh.Vertices(FaceId(face->slot)), ElementsAre(VertexId(2), VertexId(1), VertexId(0)))
      << "an element keeps the order that its user gave";
  ASSERT_TRUE(mesh.RemoveElement(CellId(0)).ok());
  EXPECT_THAT(Counts(mesh), ElementsAre(4, 3, 1, 0));
  ASSERT_TRUE(mesh.RemoveElement(*face).ok());
  EXPECT_THAT(Counts(mesh), ElementsAre(4, 0, 0, 0));
  EXPECT_THAT(Validate(mesh), IsEmpty());
}

TEST(MeshTest, AFaceElementUsedByACellStaysAsDerived) {
  Mesh mesh = OneTet();
  const auto face = mesh.AddElement(ElementType::kTriangle, Ids({0, 1, 2}));
  ASSERT_TRUE(mesh.RemoveElement(*face).ok());
  EXPECT_TRUE(mesh.IsLive(*face));
  EXPECT_EQ(ErrorReason(mesh.RemoveElement(*face)), reason::kNotAnElement);
}

TEST(MeshTest, DuplicatesAreKeptAndOneTakesOverWhenThePrimaryEnds) {
  Mesh mesh = OneTet();
  const auto first = mesh.AddElement(ElementType::kTriangle, Ids({0, 1, 2}));
  const auto second = mesh.AddElement(ElementType::kTriangle, Ids({1, 0, 2}));
  ASSERT_TRUE(first.ok() && second.ok());
  EXPECT_NE(*first, *second);
  EXPECT_TRUE(mesh.IsDuplicate(*second));
  ASSERT_TRUE(mesh.RemoveElement(*first).ok());
  EXPECT_TRUE(mesh.IsLive(*first)) << "the cell still uses it";
  EXPECT_TRUE(mesh.IsDuplicate(*second));
  EXPECT_THAT(Validate(mesh), IsEmpty());
  ASSERT_TRUE(mesh.RemoveElement(CellId(0)).ok());
  EXPECT_FALSE(mesh.IsLive(*first));
  EXPECT_FALSE(mesh.IsDuplicate(*second));
  EXPECT_EQ(mesh.FindFace(Ids({0, 1, 2})), FaceId(second->slot));
  EXPECT_THAT(Validate(mesh), IsEmpty());
}

TEST(MeshTest, DuplicatesAreRefusedIfSoOpted) {
  MeshOptions options;
  options.duplicates = DuplicatePolicy::kRefuse;
  Mesh mesh(options);
  AddVertices(mesh, 8);
  Add(mesh, ElementType::kHexahedron, {0, 1, 2, 3, 4, 5, 6, 7});
  Add(mesh, ElementType::kQuad, {0, 1, 2, 3});
  Add(mesh, ElementType::kWireEdge, {0, 1});
  Commit(mesh);
  const std::string before = Describe(mesh);
  const std::pair<ElementType, std::vector<VertexId>> duplicates[] = {
      {ElementType::kHexahedron, Ids({4, 5, 6, 7, 0, 1, 2, 3})},
      {ElementType::kQuad, Ids({2, 1, 0, 3})},
      {ElementType::kWireEdge, Ids({1, 0})}};
  for (const auto& [type, vertices] : duplicates) {
    EXPECT_EQ(ErrorReason(mesh.AddElement(type, vertices).status()), reason::kDuplicateElement);
  }
  EXPECT_EQ(Describe(mesh), before);
  EXPECT_TRUE(mesh.AddElement(ElementType::kQuad, Ids({0, 2, 1, 3})).ok()) << "another cycle is another quad";
}

TEST(MeshTest, DegenerateElementsAreKept) {
  for (ElementType type : kElementTypes) {
    SCOPED_TRACE(std::string(ElementTypeName(type)));
    Mesh mesh;
    AddVertices(mesh, 2);
    std::vector<VertexId> vertices;
    for (int k = 0; k < NumVertices(type); ++k) vertices.emplace_back(type == ElementType::kWireEdge ? 0 : k % 2);
    const auto id = mesh.AddElement(type, vertices);
    ASSERT_TRUE(id.ok());
    EXPECT_TRUE(mesh.IsDegenerate(*id));
    Commit(mesh);
    ExpectEqualsOracle(mesh, ModelOf(mesh));
    ASSERT_TRUE(mesh.RemoveElement(*id).ok());
    EXPECT_EQ(mesh.NumLive(E), 0u);
  }
}

TEST(MeshTest, RelationsOfATetrahedronAreInTemplateOrder) {
  const Mesh mesh = OneTet();
  EXPECT_THAT(Row(mesh, C, V, 0), ElementsAre(0, 1, 2, 3));
  const ElementTemplate& shape = TemplateOf(ElementType::kTetrahedron);
  const std::vector<Slot> edges = Row(mesh, C, E, 0);
  ASSERT_EQ(edges.size(), 6u);
  for (int e = 0; e < 6; ++e) {
    EXPECT_EQ(EdgeId(edges[e]),
              mesh.FindEdge(VertexId(shape.edges[e].vertices[0]), VertexId(shape.edges[e].vertices[1])));
  }
  EXPECT_THAT(Row(mesh, V, V, 0), ElementsAre(1, 2, 3));
  EXPECT_THAT(Row(mesh, C, C, 0), IsEmpty());
}

TEST(MeshTest, BoundaryOfAGridIsItsHull) {
  const Mesh mesh = HexGrid(3, 3, 3);
  EXPECT_EQ(mesh.Boundary(F).size(), 54u);
  EXPECT_EQ(mesh.Boundary(V).size(), 64u - 8u);
  EXPECT_EQ(mesh.Boundary(E).size(), 108u);
}

TEST(MeshTest, BoundaryOfSurfacesIsTheirRim) {
  EXPECT_TRUE(Octahedron().Boundary(E).empty());
  EXPECT_EQ(Book(4).Boundary(E).size(), 8u);
  EXPECT_EQ(MoebiusStrip(6).Boundary(E).size(), 12u);
}

TEST(MeshTest, StaleIdsAreRefusedByBirth) {
  Mesh mesh = OneTet();
  ASSERT_TRUE(mesh.RemoveElement(CellId(0)).ok());
  EXPECT_EQ(ErrorReason(mesh.CheckLive(CellId(0))), reason::kEntityRemoved);
  Commit(mesh);
  Add(mesh, ElementType::kTetrahedron, {3, 2, 1, 0});
  Commit(mesh);
  EXPECT_TRUE(mesh.CheckLive(CellId(0), 3).ok());
  EXPECT_EQ(ErrorReason(mesh.CheckLive(CellId(0), 2)), reason::kEntityRemoved);
  EXPECT_EQ(ErrorReason(mesh.CheckLive(CellId(5))), reason::kUnknownEntity);
  EXPECT_EQ(ErrorReason(mesh.CheckLive(VertexId(kNoSlot))), reason::kUnknownEntity);
}

TEST(MeshTest, RefusedEditsChangeNothing) {
  Mesh mesh = TetWithDanglers();
  const std::string before = Describe(mesh);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  EXPECT_EQ(ErrorReason(mesh.AddVertex({0, nan, 0}).status()), reason::kNonFinite);
  EXPECT_EQ(ErrorReason(mesh.MoveVertex(VertexId(0), {inf, 0, 0})), reason::kNonFinite);
  EXPECT_EQ(ErrorReason(mesh.MoveVertex(VertexId(70), {0, 0, 0})), reason::kUnknownEntity);
  EXPECT_EQ(ErrorReason(mesh.RemoveVertex(VertexId(0))), reason::kVertexInUse);
  EXPECT_EQ(ErrorReason(mesh.RemoveElement(VertexId(0))), reason::kBadEntityKind);
  EXPECT_EQ(ErrorReason(mesh.RemoveElement(FaceId(0))), reason::kNotAnElement);
  EXPECT_EQ(ErrorReason(mesh.RemoveElement(CellId(1))), reason::kUnknownEntity);
  EXPECT_EQ(ErrorReason(mesh.AddElement(ElementType::kTriangle, Ids({0, 1})).status()), reason::kBadArrayLength);
  EXPECT_EQ(ErrorReason(mesh.AddElement(ElementType::kTriangle, Ids({0, 1, 99})).status()), reason::kUnknownEntity);
  EXPECT_EQ(ErrorReason(mesh.AddElement(static_cast<ElementType>(9), Ids({0, 1})).status()),
            reason::kBadElementType);
  EXPECT_EQ(Describe(mesh), before);
}

TEST(MeshTest, LimitsAreNamed) {
  MeshOptions options;
  options.limits.max_slots = {6, 7, 5, 1};
  Mesh mesh(options);
  AddVertices(mesh, 6);
  const absl::Status vertices = mesh.AddVertex({0, 0, 0}).status();
  EXPECT_EQ(vertices.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(GetErrorDetail(vertices)->Find("limit"), "max_vertices");
  Add(mesh, ElementType::kTetrahedron, {0, 1, 2, 3});
  const std::string before = Describe(mesh);
  const absl::Status more = mesh.AddElement(ElementType::kTetrahedron, Ids({0, 1, 2, 4})).status();
  EXPECT_EQ(GetErrorDetail(more)->Find("limit"), "max_edges");
  EXPECT_EQ(Describe(mesh), before);
}

TEST(MeshTest, WideningKeepsWhatIsThere) {
  Mesh mesh = TetGrid(2, 1, 1);
  const ElementModel tets = ModelOf(mesh);
  AddVertices(mesh, 8);
  Add(mesh, ElementType::kHexahedron, {12, 13, 14, 15, 16, 17, 18, 19});
  Commit(mesh);
  const ElementModel all = ModelOf(mesh);
  for (const auto& [id, element] : tets.elements) EXPECT_EQ(all.elements.at(id), element);
  ExpectEqualsOracle(mesh, all);
}

TEST(MeshTest, HubsOfThousandsOfEdgesStaySound) {
  constexpr int kRim = 1500;  // beyond the degree at which hubs are indexed
  Mesh mesh = TetWheel(kRim);
  EXPECT_THAT(Validate(mesh), IsEmpty());
  EXPECT_EQ(mesh.IncidentFaces(mesh.FindEdge(VertexId(1), VertexId(0))).size(), size_t{kRim});
  mesh.BeginBatch();
  for (int i = 0; i < kRim; i += 2) ASSERT_TRUE(mesh.RemoveElement(CellId(i)).ok());
  EXPECT_THAT(Validate(mesh), IsEmpty());
  const auto wire = mesh.AddElement(ElementType::kWireEdge, Ids({0, 1}));
  const auto twin = mesh.AddElement(ElementType::kWireEdge, Ids({1, 0}));
  ASSERT_TRUE(mesh.RemoveElement(*wire).ok());
  EXPECT_EQ(mesh.FindEdge(VertexId(0), VertexId(1)), EdgeId(wire->slot)) << "faces still use it";
  EXPECT_TRUE(mesh.IsDuplicate(*twin));
  EXPECT_THAT(Validate(mesh), IsEmpty());
  mesh.Rollback();
  EXPECT_THAT(Validate(mesh), IsEmpty());
  for (int i = 0; i < kRim; ++i) ASSERT_TRUE(mesh.RemoveElement(CellId(i)).ok());
  EXPECT_EQ(mesh.NumLive(E), 0u);
  EXPECT_THAT(Validate(mesh), IsEmpty());
}

TEST(MeshTest, TwinsHaveTheSameFacesEachAsOften) {
  Mesh mesh;
  AddVertices(mesh, 8);
  Add(mesh, ElementType::kHexahedron, {0, 0, 0, 0, 0, 0, 0, 0});
  Add(mesh, ElementType::kHexahedron, {0, 1, 2, 0, 0, 5, 6, 0});
  EXPECT_FALSE(mesh.FindTwin(CellId(1)).valid());
  Add(mesh, ElementType::kHexahedron, {0, 1, 2, 0, 0, 5, 6, 0});
  EXPECT_EQ(mesh.FindTwin(CellId(1)), CellId(2));
}

TEST(MeshTest, AFaceOfManyCellsKeepsItsOrderWhenAnElementJoinsIt) {
  Mesh mesh;
  AddVertices(mesh, 103);
  for (Slot apex = 3; apex < 103; ++apex) Add(mesh, ElementType::kTetrahedron, {0, 1, 2, apex});
  const FaceId shared = mesh.FindFace(Ids({0, 1, 2}));
  const std::vector<VertexId> order(mesh.Vertices(shared).begin(), mesh.Vertices(shared).end());
  const EntityId same = *mesh.AddElement(ElementType::kTriangle, order);
  EXPECT_EQ(same, EntityId(shared));
  ASSERT_TRUE(mesh.RemoveElement(same).ok());
  const EntityId other = *mesh.AddElement(ElementType::kTriangle, std::vector<VertexId>(order.rbegin(), order.rend()));
  EXPECT_TRUE(mesh.IsDuplicate(other));
  Commit(mesh);
  ExpectEqualsOracle(mesh, ModelOf(mesh));
}

TEST(MeshTest, AnEdgeBetweenTwoOldHubsIsFound) {
  constexpr Slot kRim = 600;
  Mesh mesh;
  AddVertices(mesh, 2 * kRim + 2);
  for (Slot i = 0; i < kRim; ++i) {
    Add(mesh, ElementType::kWireEdge, {0, 2 + i});
    Add(mesh, ElementType::kWireEdge, {1, 2 + kRim + i});
  }
  EXPECT_FALSE(mesh.FindEdge(VertexId(0), VertexId(1)).valid());
  const EntityId bridge = Add(mesh, ElementType::kWireEdge, {0, 1});
  EXPECT_EQ(mesh.FindEdge(VertexId(1), VertexId(0)), EdgeId(bridge.slot));
  EXPECT_THAT(Validate(mesh), IsEmpty());
  ASSERT_TRUE(mesh.RemoveElement(bridge).ok());
  EXPECT_FALSE(mesh.FindEdge(VertexId(0), VertexId(1)).valid());
}

TEST(MeshTest, AttributesOfANewOccupantAreZero) {
  Mesh mesh = OneTet();
  const AttributeSpec spec = {"temperature", C, AttributeType::kFloat64, 1};
  ASSERT_TRUE(mesh.AddAttribute(spec).ok());
  EXPECT_EQ(ErrorReason(mesh.AddAttribute(spec)), reason::kAttributeExists);
  const double hot = 300;
  std::vector<uint8_t> row(8);
  std::memcpy(row.data(), &hot, 8);
  ASSERT_TRUE(mesh.SetAttribute(0, 0, row).ok());
  EXPECT_THAT(mesh.attributes()[0].Row(0), ::testing::ElementsAreArray(row));
  Commit(mesh);
  ASSERT_TRUE(mesh.RemoveElement(CellId(0)).ok());
  Commit(mesh);
  Add(mesh, ElementType::kTetrahedron, {0, 1, 2, 3});
  EXPECT_THAT(mesh.attributes()[0].Row(0), ::testing::Each(0));
  EXPECT_EQ(ErrorReason(mesh.SetAttribute(0, 0, absl::MakeConstSpan(row).first(4))), reason::kBadArrayLength);
  const double nan = std::nan("");
  std::memcpy(row.data(), &nan, 8);
  EXPECT_EQ(ErrorReason(mesh.SetAttribute(0, 0, row)), reason::kNonFinite);
}

TEST(ValidateTest, SeesEveryKindOfDamage) {
  const auto damaged = [](void (*damage)(Mesh&)) {
    Mesh mesh = TetWithDanglers();
    EXPECT_THAT(Validate(mesh), IsEmpty());
    damage(mesh);
    return Validate(mesh);
  };
  EXPECT_THAT(damaged(MeshTestPeer::SpoilChecksum), ElementsAre("wrong topology checksum"));
  EXPECT_THAT(damaged(MeshTestPeer::SpoilBoundaryBit), Contains(HasSubstr("wrong boundary bit")));
  EXPECT_THAT(damaged(MeshTestPeer::SpoilBoundaryCounter), Contains(HasSubstr("wrong boundary counter")));
  EXPECT_THAT(damaged(MeshTestPeer::SpoilCode), Contains(HasSubstr("wrong orientation code")));
  EXPECT_THAT(damaged(MeshTestPeer::SpoilList), Contains(HasSubstr("lists its user")));
  EXPECT_THAT(damaged(MeshTestPeer::SpoilElementFlag), Contains(HasSubstr("is unused")));
  EXPECT_THAT(damaged(MeshTestPeer::SpoilDuplicateFlag), Contains(HasSubstr("duplicate")));
  EXPECT_THAT(damaged(MeshTestPeer::SpoilEdge), Contains(HasSubstr("does not join")));
  EXPECT_THAT(damaged(MeshTestPeer::SpoilStamp), Contains(HasSubstr("impossible stamps")));
  EXPECT_THAT(damaged(MeshTestPeer::SpoilLiveness), Contains(HasSubstr("dead vertex")));
  EXPECT_THAT(damaged(MeshTestPeer::SpoilCount), Contains(HasSubstr("wrong count of elements")));
}

TEST(EstimateTest, IsCloseToTheTruthForGrids) {
  const Mesh tets = TetGrid(12, 12, 12);
  ElementTypeCounts elements{};
  elements[static_cast<int>(ElementType::kTetrahedron)] = tets.NumLive(C);
  const auto estimate = EstimateCounts(tets.NumLive(V), elements);
  EXPECT_NEAR(estimate[1], tets.NumLive(E), 0.1 * tets.NumLive(E));
  EXPECT_NEAR(estimate[2], tets.NumLive(F), 0.1 * tets.NumLive(F));
  EXPECT_EQ(estimate[3], tets.NumLive(C));
}

TEST(EstimateTest, IsExactForAClosedSphere) {
  ElementTypeCounts elements{};
  elements[static_cast<int>(ElementType::kTriangle)] = 8;
  EXPECT_THAT(EstimateCounts(6, elements), ElementsAre(6, 12, 8, 0));
}

}  // namespace
}  // namespace testing
}  // namespace dynmesh
