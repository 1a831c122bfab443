// Undoing and redoing batches: the mesh is as it was, with all ids of all kinds, all attributes and the
// boundary, and a mirror follows.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/edit/restore_batches.h"
#include "core/edit/transaction.h"
#include "core/mesh/validate.h"
#include "tests/core/edit/chronicle.h"
#include "tests/support/count_down.h"
#include "tests/support/meshes.h"
#include "tests/support/oracle.h"

namespace dynmesh::testing {
namespace {

using ::testing::IsEmpty;

constexpr Slot kFirstNew = kNewVertex;

TEST(UndoTest, TakesBackWhatABatchAddedMovedAndRemoved) {
  Chronicle chronicle(HybridOfFour());
  chronicle.Do({AddVerticesEdit{{{5, 5, 5}}}, AddElementsEdit{ElementType::kTriangle, {0, 1, kFirstNew}},
                MoveVerticesEdit{{2, 3}, {{0, 0, 9}, {-0.0, 0, 8}}},
                RemoveElementsEdit{EntityKind::kCell, {0, 3}}});
  chronicle.UndoAndRedoAll();
}

TEST(UndoTest, TellsNothingOfWhatABatchMadeAndRemoved) {
  Mesh mesh = OneTet();
  mesh.BeginBatch();
  const VertexId v = *mesh.AddVertex({1, 2, 3});
  const EntityId wire = Add(mesh, ElementType::kWireEdge, {0, v.slot()});
  ASSERT_TRUE(mesh.RemoveElement(wire).ok());
  ASSERT_TRUE(mesh.RemoveVertex(v).ok());
  EXPECT_EQ(mesh.ImageSince(0).num_items(), 0u);
  mesh.Rollback();
}

TEST(UndoTest, HoldsTheFirstOfManyPositionsAndRows) {
  Chronicle chronicle(OneTet());
  const AttributeSpec spec = {"a", EntityKind::kVertex, AttributeType::kInt32, 1};
  chronicle.Do({AddAttributeEdit{spec}, SetAttributeEdit{spec, {1, 0}, {1, 0, 0, 0, 2, 0, 0, 0}}});
  chronicle.Do({MoveVerticesEdit{{1, 0, 1}, {{7, 7, 7}, {8, 8, 8}, {9, 9, 9}}},
                SetAttributeEdit{spec, {1, 0, 1}, {3, 0, 0, 0, 4, 0, 0, 0, 5, 0, 0, 0}},
                RemoveElementsEdit{EntityKind::kCell, {0}}, RemoveVerticesEdit{{1}}});
  chronicle.UndoAndRedoAll();
}

TEST(UndoTest, LeavesTheColumnsOfABatchWithoutTheirRows) {
  Chronicle chronicle(OneTet());
  const AttributeSpec spec = {"a", EntityKind::kCell, AttributeType::kInt32, 1};
  chronicle.Do({AddAttributeEdit{spec}, SetAttributeEdit{spec, {0}, {1, 2, 3, 4}}});
  chronicle.Undo(1);
  ASSERT_EQ(chronicle.mesh().attributes().size(), 1u);
  EXPECT_EQ(chronicle.mesh().attributes()[0].Row(0), std::vector<uint8_t>(4));
  chronicle.Redo(1);
}

TEST(UndoTest, GivesADuplicatesInheritanceBack) {
  Mesh mesh = Disk(5);
  Add(mesh, ElementType::kWireEdge, {1, 0});  // the edge that triangles use becomes an element
  for (int i = 0; i < 2; ++i) Add(mesh, ElementType::kWireEdge, {0, 1});
  for (int i = 0; i < 2; ++i) Add(mesh, ElementType::kTriangle, {0, 2, 1});
  Commit(mesh);
  const Slot face = mesh.FindFace({VertexId(0), VertexId(1), VertexId(2)}).slot();
  const Slot wire = mesh.FindEdge(VertexId(0), VertexId(1)).slot();
  Chronicle chronicle(std::move(mesh));
  chronicle.Do({RemoveElementsEdit{EntityKind::kFace, {face}}});  // a duplicate takes its place
  chronicle.Do(
      {RemoveElementsEdit{EntityKind::kEdge, {wire}},
       RemoveElementsEdit{EntityKind::kFace,
                          {chronicle.mesh().FindFace({VertexId(0), VertexId(1), VertexId(2)}).slot()}}});
  chronicle.UndoAndRedoAll();
}

TEST(UndoTest, ForgetsAnEdgeWithAllItsDuplicates) {
  Mesh mesh;
  AddVertices(mesh, 3);
  ASSERT_TRUE(mesh.StoreRelation({EntityKind::kVertex, EntityKind::kVertex}, true).ok());
  Commit(mesh);
  Chronicle chronicle(std::move(mesh));
  chronicle.Do({AddElementsEdit{ElementType::kWireEdge, {0, 1, 1, 0, 0, 1}}});
  chronicle.UndoAndRedoAll();
}

TEST(UndoTest, RollsBackADuplicateWithALowerIdThanTheEdgeItRepeats) {
  Mesh mesh;
  AddVertices(mesh, 3);
  ASSERT_TRUE(mesh.StoreRelation({EntityKind::kVertex, EntityKind::kVertex}, true).ok());
  Add(mesh, ElementType::kWireEdge, {1, 2});
  Add(mesh, ElementType::kWireEdge, {0, 1});
  Commit(mesh);
  ASSERT_TRUE(mesh.RemoveElement(EdgeId(0)).ok());
  Commit(mesh);
  ASSERT_EQ(Add(mesh, ElementType::kWireEdge, {0, 1}), EntityId(EdgeId(0)));
  Commit(mesh);
  Chronicle chronicle(std::move(mesh));
  chronicle.Do({RemoveElementsEdit{EntityKind::kEdge, {0, 1}}});
  chronicle.UndoInVain(1);
  chronicle.UndoAndRedoAll();
}

TEST(UndoTest, TurnsFacesAndEdgesBackThatBecameElements) {
  Chronicle chronicle(TetGrid(1, 1, 1));
  Mesh& mesh = chronicle.mesh();
  const CellId c(0);
  const auto face = mesh.Vertices(mesh.Faces(c)[1].face());
  const auto edge = mesh.Vertices(mesh.Edge(c, 2));
  const std::vector<Slot> turned = {face[1].slot(), face[0].slot(), face[2].slot()};
  const std::vector<Slot> flipped = {edge[1].slot(), edge[0].slot()};
  const Slot f = mesh.Faces(c)[1].face().slot();
  chronicle.Do(
      {AddElementsEdit{ElementType::kTriangle, turned}, AddElementsEdit{ElementType::kWireEdge, flipped}});
  chronicle.Do({RemoveElementsEdit{EntityKind::kFace, {f}},
                AddElementsEdit{ElementType::kTriangle, {turned[1], turned[0], turned[2]}},
                RemoveElementsEdit{EntityKind::kCell, {0, 1, 2, 3, 4, 5}}});
  chronicle.UndoAndRedoAll();
}

TEST(UndoTest, FindsEdgesAndFacesOfHubsAgain) {
  constexpr int kMany = 600;  // more than 512: looked up by hashing
  Mesh mesh = Book(kMany);
  std::vector<Slot> all(kMany);
  for (int i = 0; i < kMany; ++i) all[i] = i;
  mesh.BeginBatch();
  ASSERT_TRUE(mesh.RemoveElements(EntityKind::kFace, all).ok());
  const BatchImage undo = mesh.ImageSince(0);
  Commit(mesh);
  const auto undone = RestoreBatches(mesh, {&undo}, {});
  ASSERT_TRUE(undone.ok()) << undone.status();
  EXPECT_THAT(Validate(mesh), IsEmpty());
  EXPECT_TRUE(mesh.FindEdge(VertexId(0), VertexId(1)).valid());
  const BatchImage* const redo = &undone->images[0];
  ASSERT_TRUE(RestoreBatches(mesh, {redo}, {}).ok());
  EXPECT_THAT(Validate(mesh), IsEmpty());
  EXPECT_EQ(mesh.NumLive(EntityKind::kEdge), 0u);
}

TEST(UndoTest, PutsFormerOccupantsBackIntoSlotsThatWereGivenOutAgain) {
  Chronicle chronicle(TetWithDanglers());
  chronicle.Do({RemoveElementsEdit{EntityKind::kCell, {0}}, RemoveElementsEdit{EntityKind::kFace, {4}},
                RemoveElementsEdit{EntityKind::kEdge, {8}}});
  const Slot limit = chronicle.mesh().slots(EntityKind::kFace).limit();
  chronicle.Do({AddElementsEdit{ElementType::kTetrahedron, {1, 0, 2, 4}}});
  chronicle.Do(
      {AddElementsEdit{ElementType::kWireEdge, {0, 3}}, AddElementsEdit{ElementType::kTriangle, {3, 2, 1}}});
  EXPECT_EQ(chronicle.mesh().slots(EntityKind::kFace).limit(), limit) << "no slot was given out again";
  chronicle.UndoAndRedoAll();
}

TEST(UndoTest, SaysThatWhatCameBackIsYounger) {
  Mesh mesh = OneTet();
  auto removed = ApplyBatch(mesh, {RemoveElementsEdit{EntityKind::kCell, {0}}}, {.make_image = true});
  ASSERT_TRUE(removed.ok());
  ASSERT_TRUE(RestoreBatches(mesh, {&*removed->image}, {}).ok());
  EXPECT_TRUE(mesh.CheckLive(CellId(0), 3).ok());
  EXPECT_EQ(ErrorReason(mesh.CheckLive(CellId(0), 2)), reason::kEntityRemoved);
}

TEST(UndoTest, AnImageOfAnotherStateIsRefusedAndChangesNothing) {
  Mesh mesh = TetGrid(1, 1, 1);
  auto removed = ApplyBatch(mesh, {RemoveElementsEdit{EntityKind::kCell, {0}}}, {.make_image = true});
  ASSERT_TRUE(removed.ok());
  ASSERT_TRUE(ApplyBatch(mesh, {RemoveElementsEdit{EntityKind::kCell, {1}}}, {}).ok());
  const std::string before = Describe(mesh);
  EXPECT_EQ(RestoreBatches(mesh, {&*removed->image}, {}).status().code(), absl::StatusCode::kInternal);
  EXPECT_EQ(Describe(mesh), before);
}

TEST(UndoTest, WhoStopsItHasChangedNothing) {
  Chronicle chronicle(TetGrid(1, 1, 1));
  std::vector<BatchImage> images;
  for (Slot c : {0, 1, 2}) {
    auto removed =
        ApplyBatch(chronicle.mesh(), {RemoveElementsEdit{EntityKind::kCell, {c}}}, {.make_image = true});
    ASSERT_TRUE(removed.ok());
    images.push_back(*std::move(removed->image));
  }
  const std::string before = Describe(chronicle.mesh());
  CountDown meter(images[2].num_items() + 1);
  const auto stopped =
      RestoreBatches(chronicle.mesh(), {&images[2], &images[1], &images[0]}, {.meter = meter});
  EXPECT_EQ(stopped.status(), CountDown::error());
  EXPECT_EQ(meter.charges_after_end(), 0);
  EXPECT_EQ(Describe(chronicle.mesh()), before);
}

}  // namespace
}  // namespace dynmesh::testing
