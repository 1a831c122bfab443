// Meshes that are bad for naive data structures. None of this is timed: what takes quadratic time or deep
// recursion here does not end within the limit of the test runner.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/mesh/bulk_build.h"
#include "core/mesh/relations.h"
#include "core/mesh/validate.h"
#include "tests/support/meshes.h"

namespace dynmesh::testing {
namespace {

constexpr Slot kCone = 1'000'000;
constexpr Slot kBook = 100'000;

struct Input {
  std::vector<Point> positions;
  ElementType type;
  std::vector<VertexId> vertices;
};

Point OnCircle(Slot k, Slot n) {
  const double angle = 2 * 3.14159265358979 * k / n;
  return {std::cos(angle), std::sin(angle), 0};
}

/// `n` triangles round vertex 0.
Input Cone(Slot n) {
  Input input{{{0, 0, 1}}, ElementType::kTriangle, {}};
  for (Slot k = 0; k < n; ++k) {
    input.positions.push_back(OnCircle(k, n));
    for (Slot v : {Slot{0}, 1 + k, 1 + (k + 1) % n}) input.vertices.push_back(VertexId(v));
  }
  return input;
}

/// `n` triangles, or tetrahedra in a ring, on the edge 0-1.
Input OnEdge(Slot n, ElementType type) {
  Input input{{{0, 0, -1}, {0, 0, 1}}, type, {}};
  for (Slot k = 0; k < n; ++k) {
    input.positions.push_back(OnCircle(k, n));
    for (Slot v : {Slot{0}, Slot{1}, 2 + k}) input.vertices.push_back(VertexId(v));
    if (type == ElementType::kTetrahedron) input.vertices.push_back(VertexId(2 + (k + 1) % n));
  }
  return input;
}

Mesh Bulk(const Input& input) {
  BulkBuilder builder({});
  EXPECT_TRUE(builder.AddVertices(input.positions).ok());
  EXPECT_TRUE(builder.AddElements(input.type, input.vertices).ok());
  Mesh mesh = std::move(std::move(builder).Finish()->mesh);
  Commit(mesh);
  return mesh;
}

void AddAll(const Input& input, Mesh& mesh) {
  const size_t size = NumVertices(input.type);
  for (size_t i = 0; i < input.vertices.size(); i += size) {
    ASSERT_TRUE(mesh.AddElement(input.type, absl::MakeConstSpan(input.vertices).subspan(i, size)).ok());
  }
}

Mesh OneByOne(const Input& input) {
  Mesh mesh;
  for (const Point& p : input.positions) EXPECT_TRUE(mesh.AddVertex(p).ok());
  AddAll(input, mesh);
  Commit(mesh);
  return mesh;
}

/// Removes every second element, then the rest, each a batch that could be rolled back.
void RemoveAll(EntityKind kind, Mesh& mesh) {
  for (int parity : {0, 1}) {
    std::vector<Slot> doomed;
    mesh.slots(kind).live().ForEach([&](Slot slot) {
      if (static_cast<int>(slot % 2) == parity) doomed.push_back(slot);
    });
    mesh.BeginBatch();
    ASSERT_TRUE(mesh.RemoveElements(kind, doomed).ok());
    Commit(mesh);
  }
  EXPECT_EQ(mesh.NumLive(EntityKind::kEdge), 0u);
}

size_t RowLength(const Mesh& mesh, Relation relation, Slot slot) {
  std::vector<Slot> row;
  AppendNeighbors(mesh, relation, slot, row);
  EXPECT_TRUE(std::is_sorted(row.begin(), row.end()));
  return row.size();
}

class ExtremesTest : public ::testing::TestWithParam<bool> {
 protected:
  Mesh Build(const Input& input) const { return GetParam() ? Bulk(input) : OneByOne(input); }
};

TEST_P(ExtremesTest, AMillionTrianglesRoundAVertex) {
  Mesh mesh = Build(Cone(kCone));
  EXPECT_EQ(mesh.NumLive(EntityKind::kEdge), 2 * kCone);
  EXPECT_EQ(RowLength(mesh, {EntityKind::kVertex, EntityKind::kFace}, 0), kCone);
  EXPECT_EQ(RowLength(mesh, {EntityKind::kVertex, EntityKind::kVertex}, 0), kCone);
  EXPECT_EQ(mesh.Boundary(EntityKind::kEdge).size(), kCone);
  RemoveAll(EntityKind::kFace, mesh);
}

TEST_P(ExtremesTest, ABookOfFacesOnAnEdge) {
  Mesh mesh = Build(OnEdge(kBook, ElementType::kTriangle));
  EXPECT_EQ(
      RowLength(mesh, {EntityKind::kEdge, EntityKind::kFace}, mesh.FindEdge(VertexId(0), VertexId(1)).slot()),
      kBook);
  EXPECT_EQ(RowLength(mesh, {EntityKind::kFace, EntityKind::kFace}, 7), kBook - 1);
  EXPECT_THAT(Validate(mesh), ::testing::IsEmpty());
  RemoveAll(EntityKind::kFace, mesh);
}

TEST_P(ExtremesTest, AWheelOfTetrahedraOnAnEdge) {
  Mesh mesh = Build(OnEdge(kBook, ElementType::kTetrahedron));
  EXPECT_EQ(
      RowLength(mesh, {EntityKind::kEdge, EntityKind::kCell}, mesh.FindEdge(VertexId(0), VertexId(1)).slot()),
      kBook);
  EXPECT_EQ(RowLength(mesh, {EntityKind::kVertex, EntityKind::kCell}, 0), kBook);
  EXPECT_EQ(mesh.Boundary(EntityKind::kFace).size(), 2 * kBook);
  EXPECT_THAT(Validate(mesh), ::testing::IsEmpty());
  RemoveAll(EntityKind::kCell, mesh);
}

TEST_P(ExtremesTest, HubsKeepStoredRelationsInLinearTime) {
  Mesh mesh = Build(OnEdge(kBook, ElementType::kTetrahedron));
  for (Relation relation : kStorableRelations) ASSERT_TRUE(mesh.StoreRelation(relation, true).ok());
  RemoveAll(EntityKind::kCell, mesh);
  AddAll(OnEdge(kBook, ElementType::kTetrahedron), mesh);
  Commit(mesh);
  EXPECT_EQ(RowLength(mesh, {EntityKind::kVertex, EntityKind::kCell}, 0), kBook);
  EXPECT_THAT(Validate(mesh), ::testing::IsEmpty());
}

INSTANTIATE_TEST_SUITE_P(Builds, ExtremesTest, ::testing::Bool(),
                         [](const auto& bulk) { return bulk.param ? "InBulk" : "OneByOne"; });

TEST(ExtremesReplaceTest, TheStarOfAHubWhoseNeighborsAreNumberedInOrder) {
  constexpr Slot kPairs = 100'000;
  Input input{{{0, 0, 1}, {0, 0, 2}}, ElementType::kTriangle, {}};
  for (Slot k = 0; k < kPairs; ++k) {
    input.positions.push_back(OnCircle(2 * k, 2 * kPairs));
    input.positions.push_back(OnCircle(2 * k + 1, 2 * kPairs));
    for (Slot v : {Slot{0}, 2 + 2 * k, 3 + 2 * k}) input.vertices.push_back(VertexId(v));
  }
  Mesh mesh = Bulk(input);
  std::vector<EntityId> removed;
  std::vector<NewElement> added;
  for (Slot f = 0; f < kPairs; ++f) {
    const auto triangle = mesh.Vertices(FaceId(f));
    removed.push_back(FaceId(f));
    added.emplace_back(ElementType::kTriangle, absl::MakeConstSpan({VertexId(1), triangle[1], triangle[2]}));
  }
  mesh.BeginBatch();
  ASSERT_TRUE(mesh.ReplaceElements(removed, added, [](size_t, EntityId) {}).ok());
  Commit(mesh);
  EXPECT_EQ(mesh.IncidentEdges(VertexId(1)).size(), 2 * kPairs);
  EXPECT_EQ(mesh.NumLive(EntityKind::kEdge), 3 * kPairs);
  EXPECT_TRUE(Validate(mesh).empty());
}

TEST(ExtremesLimitsTest, AMeshEmptiedAndRefilledTenTimesUsesItsMemoryAgain) {
  const Mesh source = TetGrid(14, 14, 14);
  Input cells{{}, ElementType::kTetrahedron, {}};
  for (Slot v = 0; v < source.NumLive(EntityKind::kVertex); ++v)
    cells.positions.push_back(source.Position(VertexId(v)));
  source.slots(EntityKind::kCell).live().ForEach([&](Slot c) {
    const auto vertices = source.Vertices(CellId(c));
    cells.vertices.insert(cells.vertices.end(), vertices.begin(), vertices.end());
  });
  Mesh mesh = OneByOne(cells);
  RemoveAll(EntityKind::kCell, mesh);
  AddAll(cells, mesh);
  Commit(mesh);
  const size_t once = mesh.memory_bytes();
  std::array<Slot, kNumEntityKinds> limits;
  for (EntityKind kind : kEntityKinds) limits[Dimension(kind)] = mesh.slots(kind).limit();
  for (int round = 0; round < 10; ++round) {
    RemoveAll(EntityKind::kCell, mesh);
    AddAll(cells, mesh);
    Commit(mesh);
  }
  EXPECT_LE(mesh.memory_bytes(), once + once / 4);
  for (EntityKind kind : kEntityKinds) EXPECT_EQ(mesh.slots(kind).limit(), limits[Dimension(kind)]);
  EXPECT_THAT(Validate(mesh), ::testing::IsEmpty());
}

TEST(ExtremesLimitsTest, ListsThatReachTheir32BitLimitsAreRefusedByName) {
  MeshOptions options;
  options.limits.max_slots = {10, 9, 6, 3};
  Mesh mesh(options);
  AddVertices(mesh, 10);
  Add(mesh, ElementType::kTetrahedron, {0, 1, 2, 3});
  const absl::Status status =
      mesh.AddElement(ElementType::kTetrahedron, {VertexId(4), VertexId(5), VertexId(6), VertexId(7)})
          .status();
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(GetErrorDetail(status)->Find("limit"), "max_edges");
  EXPECT_THAT(Validate(mesh), ::testing::IsEmpty());
}

}  // namespace
}  // namespace dynmesh::testing
