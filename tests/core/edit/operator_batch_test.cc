// Operators as edits of a batch: names, skipping, lineage, limits.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "core/edit/transaction.h"
#include "tests/support/meshes.h"
#include "tests/support/oracle.h"

namespace dynmesh::testing {
namespace {

using ::testing::ElementsAre;

std::string Metadata(const absl::Status& status, absl::string_view key) {
  const auto detail = GetErrorDetail(status);
  return detail ? std::string(detail->Find(key)) : "";
}

std::vector<Slot> EndsOf(const Mesh& mesh, EdgeId e) {
  return {mesh.Vertices(e)[0].slot(), mesh.Vertices(e)[1].slot()};
}

TEST(OperatorBatchTest, ASplitEdgeCanBeNamedByTheVertexThatItGotInTheSameBatch) {
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

TEST(OperatorBatchTest, ParametersCountFromTheEndThatIsNamedFirst) {
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

TEST(OperatorBatchTest, RefusedItemsArePassedOverWhenAskedForAndElseEndTheBatch) {
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

TEST(OperatorBatchTest, WhatTheCallerWroteWrongIsNeverPassedOver) {
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

TEST(OperatorBatchTest, WeldingTwoBlocksAlongTheirSidesMakesOneOfThem) {
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

TEST(OperatorBatchTest, DuplicatesAreSplitTogether) {
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

TEST(OperatorBatchTest, ByDefaultACollapseLeavesTheBoundaryWhereItIs) {
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

TEST(OperatorBatchTest, WhatIsFlatButForRoundingIsFlat) {
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

TEST(OperatorBatchTest, VerticesThatCannotBeWeldedAreRefused) {
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

TEST(OperatorBatchTest, FewItemsCannotTakeWithoutEnd) {
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

TEST(OperatorBatchTest, WorkAtAVertexThatOnlyMovesCountsToo) {
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

TEST(OperatorBatchTest, AttributesThatOperatorsSpreadAreLimitedAndZerosAreNotWritten) {
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

TEST(OperatorBatchTest, ThePagesThatRowsOfNewVerticesTakeAreLimited) {
  Mesh mesh = OneTet();
  const AttributeSpec spec = {"t", EntityKind::kVertex, AttributeType::kFloat64, 16};
  AddVerticesEdit many;
  many.positions.assign(3000, Point{0, 0, 0});
  const std::vector<uint8_t> rows(256, 1);
  ASSERT_TRUE(
      ApplyBatch(mesh, {AddAttributeEdit{spec}, many, SetAttributeEdit{spec, {0, 1}, rows}}, {}).ok());
  SplitEdgesEdit split;
  split.edges.ends = {0, 1};
  const std::vector<Edit> batches[] = {
      {split},
      {AddVerticesEdit{{{0, 0, 0}}},
       SetAttributeEdit{spec, {kNewVertex}, {rows.begin(), rows.begin() + 128}}}};
  for (const std::vector<Edit>& edits : batches) {
    const std::string before = Describe(mesh);
    EXPECT_EQ(ErrorReason(ApplyBatch(mesh, edits, {.max_attribute_bytes = 10'000}).status()),
              reason::kLimitExceeded);
    EXPECT_EQ(Describe(mesh), before);
    const size_t bytes = mesh.attributes()[0].memory_bytes();
    ASSERT_TRUE(ApplyBatch(mesh, edits, {.max_attribute_bytes = 100'000}).ok());
    EXPECT_LE(mesh.attributes()[0].memory_bytes(), bytes + 100'000);
    ASSERT_TRUE(ApplyBatch(mesh, {many}, {}).ok());  // the next batch needs another page
  }
}

TEST(OperatorBatchTest, RefusalsAreToldInFullForTheFirstHundredOfABatch) {
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

TEST(OperatorBatchTest, ElementsThatWouldTurnOverAreRefusedUnlessAllowed) {
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

TEST(OperatorBatchTest, LookingForTwinsAndDuplicatesIsWorkToo) {
  Mesh duplicates = OneTet();
  duplicates.BeginBatch();
  for (int copy = 0; copy < 200; ++copy) Add(duplicates, ElementType::kTetrahedron, {0, 1, 2, 3});
  ASSERT_TRUE(duplicates.AddVertex({9, 9, 9}).ok());
  Add(duplicates, ElementType::kWireEdge, {4, 3});
  Commit(duplicates);
  CollapseEdgesEdit collapse;
  collapse.edges.ends = {4, 3};
  collapse.parameters = {0};
  EXPECT_EQ(ErrorReason(ApplyBatch(duplicates, {collapse}, {.max_work = 20'000}).status()),
            reason::kLimitExceeded);
  Mesh book;
  for (int i = 0; i < 306; ++i) ASSERT_TRUE(book.AddVertex({i * 0.1, i * 0.3, std::sin(i)}).ok());
  Add(book, ElementType::kTetrahedron, {0, 1, 2, 3});
  Add(book, ElementType::kTetrahedron, {0, 2, 1, 4});
  for (Slot i = 5; i < 305; ++i) Add(book, ElementType::kTriangle, {i % 3, (i + 1) % 3, i});
  Commit(book);
  SwapFacesEdit swap;
  swap.faces = {book.FindFace({VertexId(0), VertexId(1), VertexId(2)}).slot()};
  swap.limits.keep_orientation = false;
  EXPECT_EQ(ErrorReason(ApplyBatch(book, {swap}, {.max_work = 100}).status()), reason::kLimitExceeded);
  EXPECT_TRUE(ApplyBatch(book, {swap}, {.max_work = 1000}).ok());
}

}  // namespace
}  // namespace dynmesh::testing
