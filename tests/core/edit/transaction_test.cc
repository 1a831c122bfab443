#include "core/edit/transaction.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
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

// ---- Operators in a batch ----

std::vector<Slot> EndsOf(const Mesh& mesh, EdgeId e) {
  return {mesh.Vertices(e)[0].slot(), mesh.Vertices(e)[1].slot()};
}

TEST(TransactionOperatorsTest, ASplitEdgeCanBeNamedByTheVertexThatItGotInTheSameBatch) {
  Mesh mesh = OneTet();
  SplitEdgesEdit first, second;
  first.edges.ends = {0, 1};
  second.edges.ends = {0, kNewVertex | 0};
  BatchOptions options;
  options.max_lineage = 100;
  const auto result = ApplyBatch(mesh, {first, second}, options);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(mesh.revision(), 2);
  EXPECT_EQ(mesh.NumElements(EntityKind::kCell), 3u);
  EXPECT_EQ(result->num_made, 4u);
  ASSERT_EQ(result->results[0].lineage.size(), 2u);
  EXPECT_EQ(result->results[0].lineage[0].parent, EntityId(CellId(0)));
  EXPECT_THAT(result->results[1].new_slots, ElementsAre(5));
  ExpectEqualsOracle(mesh, ModelOf(mesh));
}

TEST(TransactionOperatorsTest, ParametersCountFromTheEndThatIsNamedFirst) {
  for (const auto& [a, b] : {std::pair<Slot, Slot>{0, 1}, {1, 0}}) {
    Mesh mesh = Disk(6);
    const Point origin = mesh.Position(VertexId(a)), other = mesh.Position(VertexId(b));
    SplitEdgesEdit split;
    split.edges.ends = {a, b};
    split.parameters = {0.25};
    ASSERT_TRUE(ApplyBatch(mesh, {split}, {}).ok());
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_DOUBLE_EQ(mesh.Position(VertexId(7))[axis], 0.75 * origin[axis] + 0.25 * other[axis]);
    }
    CollapseEdgesEdit collapse;
    collapse.edges.ends = {a, 7};
    collapse.limits.keep_orientation = false;
    ASSERT_TRUE(ApplyBatch(mesh, {collapse}, {}).ok());
    EXPECT_TRUE(mesh.IsLive(VertexId(a))) << a;
    EXPECT_FALSE(mesh.IsLive(VertexId(7)));
  }
}

TEST(TransactionOperatorsTest, RefusedItemsArePassedOverWhenAskedForAndElseEndTheBatch) {
  Mesh mesh = OneTet();
  const std::string before = Describe(mesh);
  SwapEdgesEdit swap;  // on the boundary
  swap.edges.ids = {0, 1};
  SplitEdgesEdit split;
  split.edges.ids = {0, 77, 1};
  MoveVerticesEdit move{{kNewVertex | 2}, {{9, 9, 9}}};
  const auto refused = ApplyBatch(mesh, {swap, split}, {});
  EXPECT_EQ(ErrorReason(refused.status()), reason::kBoundary);
  EXPECT_EQ(Metadata(refused.status(), "edit"), "0");
  EXPECT_EQ(Metadata(refused.status(), "index"), "0");
  EXPECT_EQ(Describe(mesh), before);
  BatchOptions options;
  options.skip_refused = true;
  const auto result = ApplyBatch(mesh, {swap, split, move}, options);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_THAT(result->results[0].skipped, ElementsAre(0, 1));
  EXPECT_EQ(ErrorReason(result->results[0].refusals[1].status), reason::kBoundary);
  EXPECT_THAT(result->results[1].skipped, ElementsAre(1));
  EXPECT_THAT(result->results[1].new_slots, ElementsAre(4, kNoSlot, 5));
  EXPECT_EQ(mesh.Position(VertexId(5)), (Point{9, 9, 9}));
  move.vertices = {kNewVertex | 1};
  EXPECT_EQ(ErrorReason(ApplyBatch(mesh, {split, move}, options).status()), reason::kUnknownEntity);
  ExpectEqualsOracle(mesh, ModelOf(mesh));
}

TEST(TransactionOperatorsTest, WhatTheCallerWroteWrongIsNeverPassedOver) {
  Mesh mesh = OneTet();
  const std::string before = Describe(mesh);
  BatchOptions options;
  options.skip_refused = true;
  SplitEdgesEdit split;
  const auto reason_of = [&](const Edit& edit) {
    return ErrorReason(ApplyBatch(mesh, {edit}, options).status());
  };
  split.edges.ids = {0};
  split.parameters = {0.5, 0.5};
  EXPECT_EQ(reason_of(split), reason::kBadArrayLength);
  split.parameters = {1};
  EXPECT_EQ(reason_of(split), reason::kBadArgument);
  split.edges.ids = {7777, 0};  // not there, which is no excuse for the second one's parameter
  split.parameters = {0.5, 7};
  EXPECT_EQ(reason_of(split), reason::kBadArgument);
  split.edges.ids = {0};
  split.parameters = {std::nan("")};
  EXPECT_EQ(reason_of(split), reason::kBadArgument);
  split.parameters = {};
  split.positions = {{0, std::nan(""), 0}};
  EXPECT_EQ(reason_of(split), reason::kNonFinite);
  split.positions = {};
  split.edges.ends = {0, 1};
  EXPECT_EQ(reason_of(split), reason::kBadArgument);
  split.edges = {{}, {0, 1, 2}};
  EXPECT_EQ(reason_of(split), reason::kBadArrayLength);
  split.edges = {{0}, {}};
  split.limits.min_quality = 2;
  EXPECT_EQ(reason_of(split), reason::kBadArgument);
  EXPECT_EQ(reason_of(SplitElementsEdit{EntityKind::kVertex, {0}, {}, {}}), reason::kBadEntityKind);
  EXPECT_EQ(Describe(mesh), before);
}

TEST(TransactionOperatorsTest, WeldingTwoBlocksAlongTheirSidesMakesOneOfThem) {
  Mesh mesh;
  AddVerticesEdit vertices;
  AddElementsEdit cells{ElementType::kTetrahedron, {}};
  const Mesh block = TetGrid(2, 2, 2);
  std::vector<Slot> pairs;
  for (int copy = 0; copy < 2; ++copy) {
    const Slot first = vertices.positions.size();
    block.slots(EntityKind::kVertex).live().ForEach([&](Slot v) {
      Point p = block.Position(VertexId(v));
      if (copy == 1 && p[0] == 0) pairs.insert(pairs.end(), {kNewVertex | (v + 2), kNewVertex | (first + v)});
      p[0] += 2 * copy;
      vertices.positions.push_back(p);
    });
    block.slots(EntityKind::kCell).live().ForEach([&](Slot c) {
      for (VertexId v : block.Vertices(CellId(c))) cells.vertices.push_back(kNewVertex | (first + v.slot()));
    });
  }
  const auto result = ApplyBatch(mesh, {vertices, cells, MergeVerticesEdit{pairs, {}, {}}}, {});
  ASSERT_TRUE(result.ok()) << result.status();
  const Mesh whole = TetGrid(4, 2, 2);
  for (EntityKind kind : kEntityKinds)
    EXPECT_EQ(mesh.NumLive(kind), whole.NumLive(kind)) << EntityKindName(kind);
  EXPECT_EQ(mesh.Boundary(EntityKind::kFace).size(), whole.Boundary(EntityKind::kFace).size());
  ExpectEqualsOracle(mesh, ModelOf(mesh));
}

TEST(TransactionOperatorsTest, DuplicatesAreSplitTogether) {
  Mesh mesh = OneTet();
  mesh.BeginBatch();
  Add(mesh, ElementType::kTetrahedron, {0, 1, 2, 3});
  for (int twice = 0; twice < 2; ++twice) {
    Add(mesh, ElementType::kWireEdge, {0, 1});
    Add(mesh, ElementType::kTriangle, {0, 1, 2});
  }
  Commit(mesh);
  SplitEdgesEdit split;
  split.edges.ends = {0, 1};
  const auto result = ApplyBatch(mesh, {split}, {});
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(mesh.NumElements(EntityKind::kCell), 4u);
  EXPECT_EQ(mesh.NumElements(EntityKind::kFace), 4u);
  EXPECT_EQ(mesh.NumElements(EntityKind::kEdge), 4u);
  ExpectEqualsOracle(mesh, ModelOf(mesh));
}

TEST(TransactionOperatorsTest, ByDefaultACollapseLeavesTheBoundaryWhereItIs) {
  for (bool inwards : {false, true}) {
    Mesh mesh = TetGrid(3, 3, 3);
    const VertexId corner(0), inside(21);
    ASSERT_TRUE(mesh.IsOnBoundary(corner) && !mesh.IsOnBoundary(inside));
    CollapseEdgesEdit collapse;
    collapse.edges.ends = inwards ? std::vector<Slot>{0, 21} : std::vector<Slot>{21, 0};
    ASSERT_TRUE(ApplyBatch(mesh, {collapse}, {}).ok());
    EXPECT_EQ(mesh.Position(corner), (Point{0, 0, 0}));
    EXPECT_FALSE(mesh.IsLive(inside));
  }
}

TEST(TransactionOperatorsTest, WhatIsFlatButForRoundingIsFlat) {
  std::mt19937 rng(5);
  std::uniform_real_distribution<double> coordinate(-1, 1);
  for (int round = 0; round < 200; ++round) {
    Mesh mesh = OneTet();
    mesh.BeginBatch();
    for (Slot v = 0; v < 4; ++v) {
      ASSERT_TRUE(mesh.MoveVertex(VertexId(v), {coordinate(rng), coordinate(rng), coordinate(rng)}).ok());
    }
    Commit(mesh);
    SplitEdgesEdit split;
    split.edges.ends = {0, 1};
    ASSERT_TRUE(ApplyBatch(mesh, {split}, {}).ok());
    SwapFacesEdit swap;  // one of the three new cells would have the whole edge 0-1 and its middle
    swap.faces = {mesh.FindFace({VertexId(4), VertexId(2), VertexId(3)}).slot()};
    EXPECT_EQ(ErrorReason(ApplyBatch(mesh, {swap}, {}).status()), reason::kWouldInvert);
  }
}

TEST(TransactionOperatorsTest, VerticesThatCannotBeWeldedAreRefused) {
  Mesh mesh = TwoHexes();
  const auto reason_of = [&](Slot kept, Slot gone) {
    const std::string before = Describe(mesh);
    MergeVerticesEdit merge{{kept, gone}, {}, {.keep_orientation = false}};
    const auto result = ApplyBatch(mesh, {merge}, {});
    EXPECT_TRUE(result.ok() || Describe(mesh) == before);
    return ErrorReason(result.status());
  };
  EXPECT_EQ(reason_of(0, 0), reason::kBadArgument);
  EXPECT_EQ(reason_of(0, 1), reason::kEdgeExists);
  EXPECT_EQ(reason_of(0, 2), reason::kNotSimplex);
  EXPECT_EQ(reason_of(0, 99), reason::kUnknownEntity);
  mesh = Book(2);
  EXPECT_EQ(reason_of(2, 3), reason::kDuplicateElement);
}

TEST(TransactionOperatorsTest, FewItemsCannotTakeWithoutEnd) {
  Mesh mesh = TetWheel(200);
  const std::string before = Describe(mesh);
  SplitEdgesEdit split;
  split.edges.ends = EndsOf(mesh, mesh.FindEdge(VertexId(0), VertexId(1)));
  for (BatchOptions options :
       {BatchOptions{.max_made = 399}, BatchOptions{.max_work = 200}, BatchOptions{.max_lineage = 399}}) {
    EXPECT_EQ(ErrorReason(ApplyBatch(mesh, {split}, options).status()), reason::kLimitExceeded);
    EXPECT_EQ(Describe(mesh), before);
  }
  EXPECT_TRUE(ApplyBatch(mesh, {split}, {.max_lineage = 400, .max_made = 400, .max_work = 10000}).ok());
}

TEST(TransactionOperatorsTest, WorkAtAVertexThatOnlyMovesCountsToo) {
  Mesh mesh = TetWheel(200);  // its cells stand at vertices 0 and 1
  mesh.BeginBatch();
  ASSERT_TRUE(mesh.AddVertex({5, 5, 5}).ok());
  Add(mesh, ElementType::kWireEdge, {0, 202});
  Commit(mesh);
  CollapseEdgesEdit collapse;
  collapse.edges.ends = {0, 202};
  collapse.parameters = {0.25};
  EXPECT_EQ(ErrorReason(ApplyBatch(mesh, {collapse}, {.max_work = 400}).status()), reason::kLimitExceeded);
  Mesh ring = TetWheel(20);
  SwapEdgesEdit swap{{{}, {0, 1}}, {.keep_orientation = false}};
  EXPECT_EQ(ErrorReason(ApplyBatch(ring, {swap}, {.max_work = 5000}).status()), reason::kLimitExceeded);
  EXPECT_TRUE(ApplyBatch(ring, {swap}, {.max_work = 10'000}).ok());
}

TEST(TransactionOperatorsTest, AttributesThatOperatorsSpreadAreLimitedAndZerosAreNotWritten) {
  Mesh mesh = OneTet();
  ASSERT_TRUE(
      ApplyBatch(mesh, {AddAttributeEdit{{"t", EntityKind::kCell, AttributeType::kFloat64, 16}}}, {}).ok());
  SplitElementsEdit split{EntityKind::kCell, {0}, {}, {}};
  ASSERT_TRUE(ApplyBatch(mesh, {split}, {.max_attribute_bytes = 0}).ok());
  const Slot cell = mesh.slots(EntityKind::kCell).live().Next(0);
  std::vector<uint8_t> row(128, 1);
  ASSERT_TRUE(ApplyBatch(mesh, {SetAttributeEdit{mesh.attributes()[0].spec(), {cell}, row}}, {}).ok());
  split.elements = {cell};
  const std::string before = Describe(mesh);
  EXPECT_EQ(ErrorReason(ApplyBatch(mesh, {split}, {.max_attribute_bytes = 500}).status()),
            reason::kLimitExceeded);
  EXPECT_EQ(Describe(mesh), before);
  EXPECT_TRUE(ApplyBatch(mesh, {split}, {.max_attribute_bytes = 2000}).ok());
}

TEST(TransactionOperatorsTest, RefusalsAreToldInFullForTheFirstHundredOfABatch) {
  Mesh mesh = OneTet();
  std::vector<Edit> edits(60, SwapEdgesEdit{{{77, 78, 79}, {}}, {}});
  BatchOptions options;
  options.skip_refused = true;
  const auto result = ApplyBatch(mesh, edits, options);
  ASSERT_TRUE(result.ok());
  size_t told = 0, skipped = 0;
  for (const EditResult& edit : result->results) {
    told += edit.refusals.size();
    skipped += edit.skipped.size();
  }
  EXPECT_EQ(told, kMaxRefusals);
  EXPECT_EQ(skipped, 180u);
}

TEST(TransactionOperatorsTest, ElementsThatWouldTurnOverAreRefusedUnlessAllowed) {
  Mesh mesh = TetGrid(1, 1, 1);
  CollapseEdgesEdit collapse;
  collapse.edges.ends = {0, 1};
  collapse.positions = {{5, 5, 5}};
  const auto refused = ApplyBatch(mesh, {collapse}, {});
  EXPECT_EQ(ErrorReason(refused.status()), reason::kWouldInvert);
  EXPECT_EQ(Metadata(refused.status(), "kind"), "cell");
  collapse.limits.keep_orientation = false;
  EXPECT_TRUE(ApplyBatch(mesh, {collapse}, {}).ok());
  ExpectEqualsOracle(mesh, ModelOf(mesh));
}

}  // namespace
}  // namespace dynmesh::testing
