// ConflictPolicy::kTouched: what others changed after a batch was thought out must not be touched by it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "core/edit/transaction.h"
#include "tests/support/meshes.h"
#include "tests/support/oracle.h"

namespace dynmesh::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::EndsWith;

const AttributeSpec kLoad = {"load", EntityKind::kVertex, AttributeType::kInt32, 1};
const AttributeSpec kMaterial = {"material", EntityKind::kCell, AttributeType::kInt32, 1};
const std::vector<uint8_t> kOne = {1, 0, 0, 0};
const std::vector<uint8_t> kZero = {0, 0, 0, 0};

class ConflictTest : public ::testing::Test {
 protected:
  /// At revision 2, with both columns: what both editors have read.
  explicit ConflictTest() : mesh_(TetGrid(3, 1, 1)) {
    Theirs({AddAttributeEdit{kLoad}, AddAttributeEdit{kMaterial}});
  }

  void Theirs(const std::vector<Edit>& edits) {
    const auto applied = ApplyBatch(mesh_, edits, {});
    ASSERT_TRUE(applied.ok()) << applied.status();
  }

  absl::StatusOr<BatchResult> Ours(const std::vector<Edit>& edits) {
    return ApplyBatch(mesh_, edits, {.as_of_revision = 2, .conflict_policy = ConflictPolicy::kTouched});
  }

  /// Fails unless our batch conflicts in just these entities, and changes nothing; and is accepted by who
  /// does not mind, unless its ids are stale.
  void ExpectConflict(const std::vector<Edit>& edits, absl::string_view kind, absl::string_view ids) {
    const std::string before = Describe(mesh_);
    const absl::Status status = Ours(edits).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kAborted) << status;
    EXPECT_EQ(ErrorReason(status), reason::kConflict);
    EXPECT_EQ(Metadata(status, "kind"), kind);
    EXPECT_EQ(Metadata(status, "ids"), ids);
    EXPECT_EQ(Metadata(status, "changed_revision"), std::to_string(mesh_.revision()));
    EXPECT_EQ(Metadata(status, "edit"), std::to_string(edits.size() - 1)) << "the last one is to conflict";
    EXPECT_EQ(Describe(mesh_), before);
  }

  void ExpectAccepted(const std::vector<Edit>& edits) {
    const auto applied = Ours(edits);
    EXPECT_TRUE(applied.ok()) << applied.status();
    ExpectEqualsOracle(mesh_, ModelOf(mesh_));
  }

  static std::string Metadata(const absl::Status& status, absl::string_view key) {
    return std::string(GetErrorDetail(status).value_or(ErrorDetail()).Find(key));
  }

  Slot CornerOf(Slot cell, int k) const { return mesh_.Vertices(CellId(cell))[k].slot(); }

  /// Any derived edge of the first cell that is not one of the last cell's.
  Slot EdgeOfFirstCell() const { return mesh_.Edge(CellId(0), 0).slot(); }

  static constexpr Slot kFirst = 0, kLast = 17;  ///< cells that share no vertex
  Mesh mesh_;
};

const std::vector<Point> kElsewhere = {{9, 9, 9}};

TEST_F(ConflictTest, InDisjointRegionsThereIsNone) {
  Theirs({MoveVerticesEdit{{CornerOf(kFirst, 0)}, {{0, 0.1, 0}}},
          RemoveElementsEdit{EntityKind::kCell, {kFirst}},
          SetAttributeEdit{kLoad, {CornerOf(kFirst, 1)}, kOne}});
  ExpectAccepted({MoveVerticesEdit{{CornerOf(kLast, 0)}, kElsewhere},
                  SetAttributeEdit{kMaterial, {kLast}, kOne}, RemoveElementsEdit{EntityKind::kCell, {kLast}},
                  AddVerticesEdit{kElsewhere},
                  AddElementsEdit{ElementType::kTetrahedron,
                                  {CornerOf(kLast, 0), CornerOf(kLast, 1), CornerOf(kLast, 2), kNewVertex}}});
}

TEST_F(ConflictTest, AVertexThatBothMove) {
  Theirs({MoveVerticesEdit{{4, 5, 6}, {{1, 2, 3}, {1, 2, 4}, {1, 2, 5}}}});
  ExpectConflict(
      {MoveVerticesEdit{{2}, kElsewhere}, MoveVerticesEdit{{6, 3, 4}, {{1, 1, 1}, {2, 2, 2}, {3, 3, 3}}}},
      "vertex", "4,6");
  const auto applied = ApplyBatch(mesh_, {MoveVerticesEdit{{4}, kElsewhere}}, {.as_of_revision = 2});
  EXPECT_TRUE(applied.ok()) << "somebody who does not mind was refused";
}

TEST_F(ConflictTest, ARowThatBothSet) {
  Theirs({SetAttributeEdit{kLoad, {3}, kZero}});  // as it was, but on purpose
  ExpectConflict({SetAttributeEdit{kLoad, {2, 3}, {1, 0, 0, 0, 1, 0, 0, 0}}}, "vertex", "3");
  ExpectAccepted({MoveVerticesEdit{{3}, kElsewhere}});
}

TEST_F(ConflictTest, AnElementOrVertexThatTheyRemoved) {
  Theirs({RemoveElementsEdit{EntityKind::kCell, {kFirst}}});
  ExpectConflict({RemoveElementsEdit{EntityKind::kCell, {kLast, kFirst}}}, "cell", "0");
  ExpectConflict({SetAttributeEdit{kMaterial, {kFirst}, kOne}}, "cell", "0");
}

TEST_F(ConflictTest, AnIdThatMeansAnotherEntityByNow) {
  Theirs({RemoveElementsEdit{EntityKind::kCell, {kFirst}}});
  Theirs({AddElementsEdit{ElementType::kTetrahedron, {0, 1, 2, 3}}});
  ASSERT_TRUE(mesh_.IsLive(CellId(kFirst)));
  ExpectConflict({RemoveElementsEdit{EntityKind::kCell, {kFirst}}}, "cell", "0");
}

TEST_F(ConflictTest, AnElementWhoseAttributesTheySet) {
  Theirs({SetAttributeEdit{kMaterial, {kFirst}, kOne}});
  ExpectConflict({RemoveElementsEdit{EntityKind::kCell, {kFirst}}}, "cell", "0");
  Theirs({SetAttributeEdit{kMaterial, {kFirst}, kZero}});
  ExpectConflict({RemoveElementsEdit{EntityKind::kCell, {kFirst}}}, "cell", "0");
}

TEST_F(ConflictTest, AnElementAtAVertexThatTheyMoved) {
  Theirs({MoveVerticesEdit{{4}, kElsewhere}});
  ExpectConflict({AddElementsEdit{ElementType::kTriangle, {0, 4, 15}}}, "vertex", "4");
  const auto face = mesh_.Vertices(FaceId(mesh_.IncidentFaces(mesh_.IncidentEdges(VertexId(4))[0])[0]));
  std::vector<Slot> derived;
  for (VertexId v : face) derived.push_back(v.slot());
  ExpectConflict({AddElementsEdit{ElementType::kTriangle, derived}}, "vertex", "4");
}

TEST_F(ConflictTest, AVertexThatTheyHaveUsed) {
  Mesh mesh = TetWithDanglers();
  const Slot isolated = mesh.slots(EntityKind::kVertex).limit() - 1;
  ASSERT_TRUE(mesh.IncidentEdges(VertexId(isolated)).empty());
  const auto used = ApplyBatch(mesh, {AddElementsEdit{ElementType::kWireEdge, {0, isolated}}}, {});
  ASSERT_TRUE(used.ok());
  const auto removed = ApplyBatch(mesh, {RemoveVerticesEdit{{isolated}}},
                                  {.as_of_revision = 1, .conflict_policy = ConflictPolicy::kTouched});
  EXPECT_EQ(ErrorReason(removed.status()), reason::kConflict) << removed.status();
  EXPECT_EQ(Metadata(removed.status(), "kind"), "edge");
  EXPECT_EQ(Metadata(removed.status(), "ids"), std::to_string(used->results[0].new_slots[0]));
}

TEST_F(ConflictTest, AFaceThatIsNoElementAnyMore) {
  const auto corners = mesh_.Vertices(mesh_.Faces(CellId(kFirst))[0].face());
  const std::vector<Slot> face = {corners[0].slot(), corners[1].slot(), corners[2].slot()};
  const auto added = ApplyBatch(mesh_, {AddElementsEdit{ElementType::kTriangle, face}}, {});
  ASSERT_TRUE(added.ok());
  const Slot f = added->results[0].new_slots[0];
  Theirs({RemoveElementsEdit{EntityKind::kFace, {f}}});
  const absl::Status status = ApplyBatch(mesh_, {RemoveElementsEdit{EntityKind::kFace, {f}}},
                                         {.as_of_revision = 3, .conflict_policy = ConflictPolicy::kTouched})
                                  .status();
  EXPECT_EQ(ErrorReason(status), reason::kConflict) << status;
  EXPECT_EQ(Metadata(status, "ids"), std::to_string(f));
}

TEST_F(ConflictTest, ADerivedEdgeThatIsGone) {
  const Slot e = EdgeOfFirstCell();
  std::vector<Slot> cells;
  for (FaceId f : mesh_.IncidentFaces(EdgeId(e))) {
    for (CellId c : mesh_.IncidentCells(f)) cells.push_back(c.slot());
  }
  std::sort(cells.begin(), cells.end());
  cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
  Theirs({RemoveElementsEdit{EntityKind::kCell, cells}});
  ASSERT_FALSE(mesh_.IsLive(EdgeId(e)));
  ExpectConflict({SplitEdgesEdit{{{e}, {}}, {}, {}, {}}}, "edge", std::to_string(e));
}

TEST_F(ConflictTest, AnOperatorWhoseElementsHaveAVertexThatTheyMoved) {
  const Slot opposite = CornerOf(kFirst, 3);
  const auto ends = mesh_.Vertices(mesh_.Edge(CellId(kFirst), 0));
  ASSERT_THAT(ends, ::testing::Not(::testing::Contains(VertexId(opposite))));
  const Point place = mesh_.Position(VertexId(opposite));
  Theirs({MoveVerticesEdit{{opposite}, {{place[0], place[1], place[2] + 1e-3}}}});
  ExpectConflict({SplitEdgesEdit{{{EdgeOfFirstCell()}, {}}, {}, {}, {}}}, "vertex", std::to_string(opposite));
}

TEST_F(ConflictTest, WithSkipRefusedJustTheItemsThatConflictArePassedOver) {
  Theirs({RemoveElementsEdit{EntityKind::kCell, {3}}, MoveVerticesEdit{{CornerOf(kLast, 2)}, {kElsewhere}}});
  const auto applied =
      ApplyBatch(mesh_, {SplitElementsEdit{EntityKind::kCell, {kLast, kFirst, 3}, {}, {}}},
                 {.as_of_revision = 2, .conflict_policy = ConflictPolicy::kTouched, .skip_refused = true});
  ASSERT_TRUE(applied.ok()) << applied.status();
  EXPECT_THAT(applied->results[0].skipped, ElementsAre(0, 2));
  for (const Refusal& refusal : applied->results[0].refusals) {
    EXPECT_EQ(ErrorReason(refusal.status), reason::kConflict) << refusal.status;
  }
  ExpectEqualsOracle(mesh_, ModelOf(mesh_));
}

TEST_F(ConflictTest, ManyItemsThatAreGoneAreExplainedInLinearTime) {
  constexpr size_t kMany = 200'000;
  const Slot vertex = mesh_.slots(EntityKind::kVertex).limit();
  Theirs({AddVerticesEdit{{{9, 9, 9}}}});
  Theirs({RemoveVerticesEdit{{vertex}}});
  AddVerticesEdit long_journal;
  long_journal.positions.assign(kMany, Point{7, 7, 7});
  BatchOptions options;
  options.as_of_revision = 3;
  options.conflict_policy = ConflictPolicy::kTouched;
  options.skip_refused = true;
  const auto applied =
      ApplyBatch(mesh_, {long_journal, DissolveVerticesEdit{std::vector<Slot>(kMany, vertex), {}}}, options);
  ASSERT_TRUE(applied.ok()) << applied.status();
  EXPECT_EQ(applied->results[1].skipped.size(), kMany);
  ASSERT_EQ(applied->results[1].refusals.size(), kMaxRefusals);
  EXPECT_EQ(ErrorReason(applied->results[1].refusals[0].status), reason::kConflict);
}

TEST_F(ConflictTest, VerticesThatAreSmoothedManyTimesArePassedOverOnce) {
  mesh_ = TetGrid(3, 3, 3);
  Theirs({MoveVerticesEdit{{21, 22}, {{1.1, 1.2, 1.1}, {2.2, 1.1, 0.9}}}});
  SmoothVerticesEdit smooth{{22, 26, 21}, {.method = SmoothMethod::kLaplacian}, 5};
  const auto applied =
      ApplyBatch(mesh_, {smooth},
                 {.as_of_revision = 1, .conflict_policy = ConflictPolicy::kTouched, .skip_refused = true});
  ASSERT_TRUE(applied.ok()) << applied.status();
  EXPECT_THAT(applied->results[0].skipped, ElementsAre(0, 2));
  ASSERT_EQ(applied->results[0].refusals.size(), 2u);
  EXPECT_EQ(applied->results[0].refusals[1].index, 2u);
  EXPECT_LE(applied->results[0].num_moved, 1u) << "what was passed over did not move";
  EXPECT_EQ(ErrorReason(applied->results[0].refusals[1].status), reason::kConflict);
}

TEST_F(ConflictTest, WhatABatchDoesTwiceIsNone) {
  Theirs({MoveVerticesEdit{{CornerOf(kFirst, 0)}, {{0, 0.1, 0}}}});
  ExpectAccepted({SetAttributeEdit{kMaterial, {kLast}, kOne}, SetAttributeEdit{kMaterial, {kLast}, kZero},
                  MoveVerticesEdit{{CornerOf(kLast, 0)}, kElsewhere},
                  MoveVerticesEdit{{CornerOf(kLast, 0)}, {{8, 8, 8}}},
                  RemoveElementsEdit{EntityKind::kCell, {kLast}}});
}

TEST_F(ConflictTest, WhatABatchItselfRemovedIsNotFound) {
  Theirs({MoveVerticesEdit{{CornerOf(kFirst, 0)}, {{0, 0.1, 0}}}});
  const auto refused =
      Ours({RemoveElementsEdit{EntityKind::kCell, {kLast}}, RemoveElementsEdit{EntityKind::kCell, {kLast}}});
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kNotFound) << refused.status();
  EXPECT_EQ(Ours({RemoveVerticesEdit{{12345}}}).status().code(), absl::StatusCode::kNotFound);
}

TEST_F(ConflictTest, TakingASlotThatTheyFreedIsNone) {
  Theirs({SetAttributeEdit{kMaterial, {kFirst}, kOne}});
  Theirs({RemoveElementsEdit{EntityKind::kCell, {kFirst}}});
  const std::vector<Slot> corners = {CornerOf(kLast, 0), CornerOf(kLast, 1), CornerOf(kLast, 2), kNewVertex};
  const auto applied =
      Ours({AddVerticesEdit{kElsewhere}, AddElementsEdit{ElementType::kTetrahedron, corners},
            SplitEdgesEdit{{{}, {corners[0], kNewVertex}}, {}, {}, {.keep_orientation = false}}});
  ASSERT_TRUE(applied.ok()) << applied.status();
  EXPECT_THAT(applied->results[1].new_slots, ElementsAre(kFirst));
}

TEST_F(ConflictTest, OfManyIdsTheFirstAreTold) {
  std::vector<Slot> all;
  const Mesh many = TetGrid(5, 5, 5);
  mesh_ = many.Clone();
  for (Slot v = 0; v < 216; ++v) all.push_back(v);
  const MoveVerticesEdit move{all, std::vector<Point>(all.size())};
  Theirs({move});
  const auto refused =
      ApplyBatch(mesh_, {move}, {.as_of_revision = 1, .conflict_policy = ConflictPolicy::kTouched});
  const std::string ids = Metadata(refused.status(), "ids");
  EXPECT_EQ(std::count(ids.begin(), ids.end(), ','), 100);
  EXPECT_THAT(ids, EndsWith(",98,99,..."));
}

}  // namespace
}  // namespace dynmesh::testing
