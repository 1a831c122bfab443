#include "core/edit/transaction.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

#include "core/mesh/validate.h"
#include "tests/support/meshes.h"
#include "tests/support/oracle.h"

namespace dynmesh::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

std::string Metadata(const absl::Status& status, absl::string_view key) {
  const auto detail = GetErrorDetail(status);
  return detail ? std::string(detail->Find(key)) : "";
}

TEST(TransactionTest, ABatchIsOneRevisionAndMayUseItsOwnVertices) {
  Mesh mesh = OneTet();
  const std::vector<Edit> edits = {AddVerticesEdit{{{1, 1, 1}, {2, 2, 2}}},
                                   AddElementsEdit{ElementType::kTetrahedron, {0, 1, 2, kNewVertex | 1}},
                                   MoveVerticesEdit{{kNewVertex | 0}, {{5, 5, 5}}}};
  const auto result = ApplyBatch(mesh, edits, {});
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(result->revision, 2);
  EXPECT_EQ(mesh.revision(), 2);
  ASSERT_EQ(result->results.size(), 3u);
  EXPECT_THAT(result->results[0].new_slots, ElementsAre(4, 5));
  EXPECT_THAT(result->results[1].new_slots, ElementsAre(1));
  EXPECT_THAT(mesh.Vertices(CellId(1)), ElementsAre(VertexId(0), VertexId(1), VertexId(2), VertexId(5)));
  EXPECT_EQ(mesh.Position(VertexId(4))[0], 5);
  EXPECT_EQ(result->checksum, mesh.checksum());
  EXPECT_THAT(result->counts, ElementsAre(6, 9, 7, 2));
}

/// All cells of a mesh as one edit that adds them.
AddElementsEdit AllCells(const Mesh& mesh) {
  AddElementsEdit edit{ElementType::kTetrahedron, {}};
  mesh.slots(EntityKind::kCell).live().ForEach([&](Slot c) {
    for (VertexId v : mesh.Vertices(CellId(c))) edit.vertices.push_back(v.slot());
  });
  return edit;
}

TEST(TransactionTest, ManyItemsGetSlotsInSpatialOrderAndAnswersInTheirOwn) {
  const Mesh source = TetGrid(5, 5, 5);
  AddVerticesEdit vertices;
  for (Slot v = 0; v < source.NumLive(EntityKind::kVertex); ++v)
    vertices.positions.push_back(source.Position(VertexId(v)));
  AddElementsEdit cells = AllCells(source);
  for (Slot& v : cells.vertices) v |= kNewVertex;
  Mesh mesh;
  const auto result = ApplyBatch(mesh, {vertices, cells}, {});
  ASSERT_TRUE(result.ok()) << result.status();
  const auto& new_vertices = result->results[0].new_slots;
  const auto& new_cells = result->results[1].new_slots;
  ASSERT_EQ(new_vertices.size(), vertices.positions.size());
  ASSERT_EQ(new_cells.size(), cells.vertices.size() / 4);
  EXPECT_FALSE(std::is_sorted(new_vertices.begin(), new_vertices.end()));
  for (size_t i = 0; i < new_vertices.size(); ++i) {
    EXPECT_EQ(mesh.Position(VertexId(new_vertices[i])), vertices.positions[i]);
  }
  for (size_t i = 0; i < new_cells.size(); ++i) {
    for (int k = 0; k < 4; ++k) {
      EXPECT_EQ(mesh.Vertices(CellId(new_cells[i]))[k].slot(),
                new_vertices[cells.vertices[4 * i + k] & ~kNewVertex]);
    }
  }
  ExpectEqualsOracle(mesh, ModelOf(mesh));
}

TEST(TransactionTest, RemovingAndAddingManyCellsInAnyOrderGivesTheSameMesh) {
  Mesh mesh = TetGrid(4, 4, 4);
  const ElementModel before = ModelOf(mesh);
  std::vector<Slot> doomed;
  AddElementsEdit again{ElementType::kTetrahedron, {}};
  for (Slot c = 0; c < mesh.NumLive(EntityKind::kCell); c += 2) doomed.push_back(c);
  std::shuffle(doomed.begin(), doomed.end(), std::mt19937(3));
  for (Slot c : doomed) {
    for (VertexId v : mesh.Vertices(CellId(c))) again.vertices.push_back(v.slot());
  }
  ASSERT_TRUE(ApplyBatch(mesh, {RemoveElementsEdit{EntityKind::kCell, doomed}}, {}).ok());
  EXPECT_EQ(mesh.NumLive(EntityKind::kCell), before.elements.size() - doomed.size());
  ExpectEqualsOracle(mesh, ModelOf(mesh));
  const auto result = ApplyBatch(mesh, {again}, {});
  ASSERT_TRUE(result.ok());
  EXPECT_THAT(result->duplicate, IsEmpty());
  EXPECT_EQ(ModelOf(mesh).elements.size(), before.elements.size());
  ExpectEqualsOracle(mesh, ModelOf(mesh));
}

/// Every `step`-th cell of a mesh, and an edit that adds them again.
std::pair<std::vector<Slot>, AddElementsEdit> EveryCell(const Mesh& mesh, Slot step) {
  std::vector<Slot> cells;
  AddElementsEdit again{ElementType::kTetrahedron, {}};
  for (Slot c = 0; c < mesh.NumLive(EntityKind::kCell); c += step) {
    cells.push_back(c);
    for (VertexId v : mesh.Vertices(CellId(c))) again.vertices.push_back(v.slot());
  }
  return {cells, again};
}

TEST(TransactionTest, CellsFarApartGoAndComeBackAsOthersDo) {
  for (Slot step : {1u, 2u, 50u}) {
    Mesh mesh = TetGrid(7, 7, 7);
    const auto [cells, again] = EveryCell(mesh, step);
    ASSERT_TRUE(ApplyBatch(mesh, {RemoveElementsEdit{EntityKind::kCell, cells}}, {}).ok());
    ExpectEqualsOracle(mesh, ModelOf(mesh));
    ASSERT_TRUE(ApplyBatch(mesh, {again}, {}).ok());
    ExpectEqualsOracle(mesh, ModelOf(mesh));
    const std::string before = Describe(mesh);
    const Edit both[] = {RemoveElementsEdit{EntityKind::kCell, cells}, again};
    ASSERT_TRUE(ApplyBatch(mesh, both, {.dry_run = true}).ok());
    EXPECT_EQ(Describe(mesh), before);
  }
}

TEST(TransactionTest, ARefusalAfterManyCellsPutsTheBoundaryBack) {
  for (Slot step : {1u, 50u}) {
    MeshOptions options;
    options.duplicates = DuplicatePolicy::kRefuse;
    Mesh mesh(options);
    const Mesh grid = TetGrid(7, 7, 7);
    AddVerticesEdit vertices;
    grid.slots(EntityKind::kVertex).live().ForEach([&](Slot v) {
      vertices.positions.push_back(grid.Position(VertexId(v)));
    });
    auto [cells, edit] = EveryCell(grid, step);
    for (Slot& v : edit.vertices) v |= kNewVertex;
    ASSERT_TRUE(
        ApplyBatch(mesh,
                   {vertices, AddElementsEdit{edit.type, {edit.vertices.begin(), edit.vertices.begin() + 4}}},
                   {})
            .ok());
    const std::string before = Describe(mesh);
    const auto& slots = grid.Vertices(CellId(0));
    const auto refused = ApplyBatch(mesh,
                                    {vertices, edit, RemoveElementsEdit{EntityKind::kCell, {0}},
                                     AddElementsEdit{edit.type, {slots[0].slot(), slots[0].slot()}}},
                                    {});
    EXPECT_FALSE(refused.ok());
    EXPECT_EQ(Describe(mesh), before);
    edit.vertices.insert(edit.vertices.end(), edit.vertices.begin(), edit.vertices.begin() + 4);
    const auto twice = ApplyBatch(mesh, {vertices, edit}, {});
    EXPECT_EQ(ErrorReason(twice.status()), reason::kDuplicateElement);
    EXPECT_EQ(Describe(mesh), before);
    ExpectEqualsOracle(mesh, ModelOf(mesh));
  }
}

TEST(TransactionTest, OfEqualCellsInALargeBatchAllButTheFirstAreDuplicates) {
  Mesh mesh = TetGrid(3, 3, 3);
  AddElementsEdit twice = AllCells(mesh);
  const size_t count = mesh.NumLive(EntityKind::kCell);
  std::vector<Slot> all(count);
  for (Slot c = 0; c < count; ++c) all[c] = c;
  ASSERT_TRUE(ApplyBatch(mesh, {RemoveElementsEdit{EntityKind::kCell, all}}, {}).ok());
  twice.vertices.insert(twice.vertices.end(), twice.vertices.begin(), twice.vertices.end());
  const auto result = ApplyBatch(mesh, {twice}, {});
  ASSERT_TRUE(result.ok());
  const auto& slots = result->results[0].new_slots;
  std::set<Slot> second(slots.begin() + count, slots.end()), reported;
  for (EntityId id : result->duplicate) reported.insert(id.slot);
  EXPECT_EQ(reported, second);
}

TEST(TransactionTest, ALargeEditThatIsRefusedSaysWhichItem) {
  Mesh mesh = TetGrid(3, 3, 3);
  const std::string before = Describe(mesh);
  AddElementsEdit cells = AllCells(mesh);
  cells.vertices[4 * 77 + 2] = 100'000;
  auto status = ApplyBatch(mesh, {cells}, {}).status();
  EXPECT_EQ(Metadata(status, "index"), "77");
  std::vector<Slot> doomed(100);
  for (Slot i = 0; i < 100; ++i) doomed[i] = 99 - i;
  doomed[60] = doomed[20];
  status = ApplyBatch(mesh, {RemoveElementsEdit{EntityKind::kCell, doomed}}, {}).status();
  EXPECT_EQ(ErrorReason(status), reason::kEntityRemoved);
  EXPECT_EQ(Metadata(status, "index"), "60");
  EXPECT_EQ(Describe(mesh), before);
}

TEST(TransactionTest, ARefusedBatchChangesNothingAndSaysWhere) {
  Mesh mesh = TetWithDanglers();
  const std::string before = Describe(mesh);
  const Edit good = AddVerticesEdit{{{1, 1, 1}}};
  const Edit remove = RemoveElementsEdit{EntityKind::kCell, {0}};
  const struct {
    Edit bad;
    const char* reason;
    const char* index;
  } cases[] = {
      {AddElementsEdit{ElementType::kTriangle, {0, 1, 2, 0, 1, 44}}, reason::kUnknownEntity, "1"},
      {AddElementsEdit{ElementType::kTriangle, {0, 1, 2, 0}}, reason::kBadArrayLength, ""},
      {AddElementsEdit{ElementType::kUnspecified, {0, 1, 2, 0}}, reason::kBadElementType, ""},
      {AddElementsEdit{ElementType::kTriangle, {0, 1, kNewVertex | 1}}, reason::kUnknownEntity, "0"},
      {RemoveElementsEdit{EntityKind::kCell, {0}}, reason::kEntityRemoved, "0"},
      {RemoveElementsEdit{EntityKind::kVertex, {0}}, reason::kBadEntityKind, "0"},
      {RemoveVerticesEdit{{6, 6}}, reason::kEntityRemoved, "1"},
      {MoveVerticesEdit{{0, 1}, {{0, 0, 0}}}, reason::kBadArrayLength, ""},
      {SetAttributeEdit{{"x", EntityKind::kCell, AttributeType::kInt32, 1}, {0}, {0, 0, 0, 0}},
       reason::kUnknownAttribute, ""},
      {AddAttributeEdit{{"", EntityKind::kCell, AttributeType::kInt32, 1}}, reason::kBadArgument, ""},
  };
  for (const auto& c : cases) {
    const auto result = ApplyBatch(mesh, std::vector<Edit>{good, remove, c.bad}, {});
    EXPECT_EQ(ErrorReason(result.status()), c.reason) << result.status();
    EXPECT_EQ(Metadata(result.status(), "edit"), "2");
    EXPECT_EQ(Metadata(result.status(), "index"), c.index);
    EXPECT_EQ(Describe(mesh), before);
  }
  EXPECT_THAT(Validate(mesh), IsEmpty());
}

TEST(TransactionTest, ADryRunTellsAndChangesNothing) {
  Mesh mesh = OneTet();
  const std::string before = Describe(mesh);
  const std::vector<Edit> edits = {AddVerticesEdit{{{1, 1, 1}}}, RemoveElementsEdit{EntityKind::kCell, {0}}};
  BatchOptions options;
  options.dry_run = true;
  const auto dry = ApplyBatch(mesh, edits, options);
  ASSERT_TRUE(dry.ok());
  EXPECT_EQ(Describe(mesh), before);
  EXPECT_EQ(dry->revision, 1);
  const auto wet = ApplyBatch(mesh, edits, {});
  ASSERT_TRUE(wet.ok());
  EXPECT_EQ(dry->checksum, wet->checksum);
  EXPECT_EQ(dry->results[0].new_slots, wet->results[0].new_slots);
}

TEST(TransactionTest, IdsReadBeforeARebirthAreRefused) {
  Mesh mesh = OneTet();
  ASSERT_TRUE(ApplyBatch(mesh, std::vector<Edit>{RemoveElementsEdit{EntityKind::kCell, {0}}}, {}).ok());
  ASSERT_TRUE(
      ApplyBatch(mesh, std::vector<Edit>{AddElementsEdit{ElementType::kTetrahedron, {0, 1, 2, 3}}}, {}).ok());
  BatchOptions stale;
  stale.as_of_revision = 1;
  const std::vector<Edit> remove = {RemoveElementsEdit{EntityKind::kCell, {0}}};
  const auto refused = ApplyBatch(mesh, remove, stale);
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(ErrorReason(refused.status()), reason::kEntityRemoved);
  EXPECT_TRUE(ApplyBatch(mesh, remove, {}).ok());
}

TEST(TransactionTest, AFaceThatBecameAnElementAgainIsAnotherElement) {
  Mesh mesh = OneTet();
  const auto apply = [&](Edit edit, int64_t as_of) {
    BatchOptions options;
    options.as_of_revision = as_of;
    return ApplyBatch(mesh, std::vector<Edit>{std::move(edit)}, options);
  };
  const AddElementsEdit triangle = {ElementType::kTriangle, {0, 1, 2}};
  const auto added = apply(triangle, 1);
  ASSERT_TRUE(added.ok());
  const RemoveElementsEdit remove = {EntityKind::kFace, added->results[0].new_slots};
  ASSERT_TRUE(apply(remove, 2).ok());
  ASSERT_TRUE(apply(triangle, 3).ok());
  EXPECT_EQ(ErrorReason(apply(remove, 2).status()), reason::kEntityRemoved);
  EXPECT_TRUE(apply(remove, 4).ok());
  EXPECT_EQ(ErrorReason(ApplyBatch(mesh, std::vector<Edit>{triangle, remove}, {}).status()),
            reason::kEntityRemoved)
      << "made in the same batch";
}

TEST(TransactionTest, BadKindsAndValuesAreNamed) {
  Mesh mesh = OneTet();
  const auto refusal = [&](Edit edit) {
    return ApplyBatch(mesh, std::vector<Edit>{std::move(edit)}, {}).status();
  };
  const EntityKind bad = static_cast<EntityKind>(9);
  EXPECT_EQ(ErrorReason(refusal(RemoveElementsEdit{bad, {0}})), reason::kBadEntityKind);
  EXPECT_EQ(ErrorReason(refusal(SetAttributeEdit{{"x", bad, AttributeType::kInt32, 1}, {0}, {0, 0, 0, 0}})),
            reason::kBadEntityKind);
  const AttributeSpec spec = {"x", EntityKind::kVertex, AttributeType::kFloat64, 1};
  ASSERT_TRUE(ApplyBatch(mesh, std::vector<Edit>{AddAttributeEdit{spec}}, {}).ok());
  std::vector<uint8_t> rows(24);
  rows[22] = 0xf0;
  rows[23] = 0x7f;  // the third value is infinite
  const absl::Status infinite = refusal(SetAttributeEdit{spec, {0, 1, 2}, rows});
  EXPECT_EQ(ErrorReason(infinite), reason::kNonFinite);
  EXPECT_EQ(Metadata(infinite, "index"), "2");
}

TEST(TransactionTest, AnIdMadeInTheBatchCannotBeGuessed) {
  Mesh mesh = OneTet();
  const std::vector<Edit> edits = {AddElementsEdit{ElementType::kTetrahedron, {0, 1, 2, 3}},
                                   RemoveElementsEdit{EntityKind::kCell, {1}}};
  EXPECT_EQ(ErrorReason(ApplyBatch(mesh, edits, {}).status()), reason::kEntityRemoved);
  EXPECT_EQ(mesh.NumLive(EntityKind::kCell), 1u);
}

TEST(TransactionTest, AnEmptyBatchIsNoRevision) {
  Mesh mesh = OneTet();
  const auto result = ApplyBatch(mesh, {}, {});
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->revision, 1);
}

TEST(TransactionTest, DegenerateAndDuplicateElementsAreReported) {
  Mesh mesh = OneTet();
  const auto result =
      ApplyBatch(mesh,
                 std::vector<Edit>{AddElementsEdit{ElementType::kTetrahedron, {0, 1, 2, 2, 3, 2, 1, 0}},
                                   AddElementsEdit{ElementType::kTriangle, {0, 1, 2, 2, 1, 0}}},
                 {});
  ASSERT_TRUE(result.ok());
  EXPECT_THAT(result->degenerate, ElementsAre(EntityId(CellId(1))));
  ASSERT_EQ(result->duplicate.size(), 2u);
  EXPECT_EQ(result->duplicate[0], EntityId(CellId(2)));
  EXPECT_EQ(result->duplicate[1].kind, EntityKind::kFace);
}

}  // namespace
}  // namespace dynmesh::testing
