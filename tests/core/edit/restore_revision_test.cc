// Going back to an earlier revision: the mesh is as it was then, with all ids of all kinds, but younger where
// it is not what it had become.

#include "core/edit/restore_revision.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>

#include "core/edit/revision_image.h"
#include "core/edit/transaction.h"
#include "core/mesh/validate.h"
#include "tests/core/edit/chronicle.h"
#include "tests/core/edit/past.h"
#include "tests/support/count_down.h"
#include "tests/support/meshes.h"
#include "tests/support/oracle.h"

namespace dynmesh::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr Slot kFirstNew = kNewVertex;

void Do(Past& past, const std::vector<Edit>& edits) {
  const auto applied = ApplyBatch(past.mesh(), edits, {.keeper = &past.keeper()});
  ASSERT_TRUE(applied.ok()) << applied.status();
  past.Note();
}

/// To each state that there was up to now.
void GoBackToAll(Past& past) {
  const size_t size = past.size();
  for (size_t i = 0; i < size && !::testing::Test::HasFailure(); ++i) past.GoBackTo(size - 1 - i);
}

TEST(RestoreRevisionTest, PutsBackWhatWasAddedMovedAndRemoved) {
  Past past(HybridOfFour());
  Do(past, {AddVerticesEdit{{{5, 5, 5}}}, AddElementsEdit{ElementType::kTriangle, {0, 1, kFirstNew}}});
  Do(past, {MoveVerticesEdit{{2, 3}, {{0, 0, 9}, {-0.0, 0, 8}}}});
  Do(past, {RemoveElementsEdit{EntityKind::kCell, {0, 3}}});
  GoBackToAll(past);
}

TEST(RestoreRevisionTest, EndsWhoLivesAtASlotAndPutsBackWhoDidBefore) {
  Past past(TetWithDanglers());
  Do(past, {RemoveElementsEdit{EntityKind::kCell, {0}}, RemoveElementsEdit{EntityKind::kFace, {4}},
            RemoveElementsEdit{EntityKind::kEdge, {8}}});
  Do(past, {RemoveVerticesEdit{{3}}});
  Do(past, {AddVerticesEdit{{{7, 8, 9}}}, AddElementsEdit{ElementType::kTetrahedron, {1, 0, kFirstNew, 4}}});
  for (EntityKind kind : kEntityKinds) {
    ASSERT_EQ(past.mesh().slots(kind).limit(), past.then(0).slots(kind).limit())
        << "nothing was given out again";
  }
  GoBackToAll(past);
}

TEST(RestoreRevisionTest, OneImageSaysThatASlotHadTwo) {
  Mesh mesh = OneTet();
  const Mesh then = mesh.Clone();
  ASSERT_TRUE(ApplyBatch(mesh, {RemoveElementsEdit{EntityKind::kCell, {0}}}, {}).ok());
  ASSERT_TRUE(ApplyBatch(mesh, {AddElementsEdit{ElementType::kTetrahedron, {1, 0, 2, 3}}}, {}).ok());
  const auto image = ImageOfRevision(mesh, then, WorkMeter::Unlimited());
  ASSERT_TRUE(image.ok()) << image.status();
  EXPECT_THAT(image->made[3], ElementsAre(0));
  EXPECT_THAT(image->ended[3].slots, ElementsAre(0));
  const auto restored = RestoreRevision(mesh, then, {});
  ASSERT_TRUE(restored.ok()) << restored.status();
  EXPECT_THAT(restored->images[0].made[3], ElementsAre(0));
  EXPECT_EQ(restored->images[0].ended[3].vertices,
            (std::vector<VertexId>{VertexId(1), VertexId(0), VertexId(2), VertexId(3)}));
}

TEST(RestoreRevisionTest, WhoIsPutBackIsYoungerThanIdsReadMeanwhile) {
  Mesh mesh = TetGrid(1, 1, 1);
  const Mesh then = mesh.Clone();
  ASSERT_TRUE(ApplyBatch(mesh, {RemoveElementsEdit{EntityKind::kCell, {0}}}, {}).ok());
  ASSERT_TRUE(RestoreRevision(mesh, then, {}).ok());
  EXPECT_TRUE(mesh.CheckLive(CellId(0), 3).ok());
  EXPECT_EQ(ErrorReason(mesh.CheckLive(CellId(0), 2)), reason::kEntityRemoved);
  EXPECT_TRUE(mesh.CheckLive(CellId(1), 1).ok()) << "was there all the time";
}

TEST(RestoreRevisionTest, LeavesColumnsAddedSinceWithoutTheirRows) {
  Past past(OneTet());
  const AttributeSpec old = {"old", EntityKind::kCell, AttributeType::kInt32, 1};
  const AttributeSpec young = {"young", EntityKind::kVertex, AttributeType::kUint8, 2, {}, {7, 7}};
  Do(past, {AddAttributeEdit{old}, SetAttributeEdit{old, {0}, {1, 2, 3, 4}}});
  Do(past, {AddAttributeEdit{young}, SetAttributeEdit{young, {0, 2}, {1, 2, 3, 4}}});
  Do(past, {RemoveElementsEdit{EntityKind::kCell, {0}}, RemoveVerticesEdit{{2}}});
  Do(past, {AddVerticesEdit{{{4, 4, 4}}}, SetAttributeEdit{young, {kFirstNew}, {9, 9}}});
  past.GoBackTo(1);
  ASSERT_EQ(past.mesh().attributes().size(), 2u);
  EXPECT_EQ(past.mesh().attributes()[0].Row(0), std::vector<uint8_t>({1, 2, 3, 4}));
  EXPECT_EQ(past.mesh().attributes()[1].Row(2), std::vector<uint8_t>({7, 7}));
  GoBackToAll(past);
}

TEST(RestoreRevisionTest, GivesADuplicatesInheritanceBack) {
  Mesh mesh = Disk(5);
  Add(mesh, ElementType::kWireEdge, {1, 0});
  for (int i = 0; i < 2; ++i) Add(mesh, ElementType::kWireEdge, {0, 1});
  for (int i = 0; i < 2; ++i) Add(mesh, ElementType::kTriangle, {0, 2, 1});
  Commit(mesh);
  const Slot face = mesh.FindFace({VertexId(0), VertexId(1), VertexId(2)}).slot();
  const Slot wire = mesh.FindEdge(VertexId(0), VertexId(1)).slot();
  Past past(std::move(mesh));
  Do(past, {RemoveElementsEdit{EntityKind::kFace, {face}}});  // a duplicate takes its place, unseen by stamps
  Do(past, {RemoveElementsEdit{EntityKind::kEdge, {wire}}});
  Do(past, {AddElementsEdit{ElementType::kTriangle, {3, 0, 4}}});
  GoBackToAll(past);
}

TEST(RestoreRevisionTest, TurnsWhatNoStampSaysWasTurned) {
  Past past(TetGrid(1, 1, 1));
  const Mesh& mesh = past.mesh();
  const FaceId f = mesh.Faces(CellId(0))[1].face();
  const auto order = mesh.Vertices(f);
  const std::vector<VertexId> turned = {order[1], order[0], order[2]};
  past.mesh().BeginBatch();
  ASSERT_TRUE(past.mesh().AddElement(ElementType::kTriangle, turned).ok());
  ASSERT_TRUE(past.mesh().RemoveElement(f).ok());
  ASSERT_TRUE(past.keeper().Keep(past.mesh()).ok());
  Commit(past.mesh());
  past.Note();
  const Stamp stamped = mesh.changed(EntityKind::kFace).At(f.slot());
  past.GoBackTo(0);
  EXPECT_EQ(mesh.changed(EntityKind::kFace).At(f.slot()), stamped)
      << "this test is about what bears no stamp";
  GoBackToAll(past);
}

TEST(RestoreRevisionTest, GoesBackToNothingAndForthFromIt) {
  Past past{Mesh()};
  past.mesh().BeginBatch();
  AddVertices(past.mesh(), 5);
  Add(past.mesh(), ElementType::kPyramid, {0, 1, 2, 3, 4});
  ASSERT_TRUE(past.keeper().Keep(past.mesh()).ok());
  Commit(past.mesh());
  past.Note();
  past.GoBackTo(0);
  EXPECT_EQ(past.mesh().NumLive(EntityKind::kVertex), 0u);
  past.GoBackTo(1);
  EXPECT_EQ(past.mesh().NumLive(EntityKind::kCell), 1u);
}

TEST(RestoreRevisionTest, GoingBackToThePresentStampsNothing) {
  Mesh mesh = HybridOfFour();
  const std::string before = DescribeContent(mesh, 0);
  const auto restored = RestoreRevision(mesh, mesh.Clone(), {});
  ASSERT_TRUE(restored.ok()) << restored.status();
  EXPECT_EQ(restored->revision, 2);
  EXPECT_EQ(restored->images[0].num_items(), 0u);
  EXPECT_EQ(DescribeContent(mesh, 0), before);
  for (EntityKind kind : kEntityKinds) {
    EXPECT_EQ(mesh.changed(kind).CountSince(1, 0, mesh.changed(kind).size()), 0u);
  }
}

TEST(RestoreRevisionTest, FindsEdgesAndFacesOfHubsAgain) {
  constexpr int kMany = 600;  // more than 512: looked up by hashing
  Mesh mesh = Book(kMany);
  const Mesh then = mesh.Clone();
  std::vector<Slot> all(kMany);
  for (int i = 0; i < kMany; ++i) all[i] = i;
  ASSERT_TRUE(ApplyBatch(mesh, {RemoveElementsEdit{EntityKind::kFace, all}}, {}).ok());
  ASSERT_TRUE(ApplyBatch(mesh, {AddElementsEdit{ElementType::kTriangle, {5, 6, 7}}}, {}).ok());
  ASSERT_TRUE(RestoreRevision(mesh, then, {}).ok());
  EXPECT_THAT(Validate(mesh), IsEmpty());
  EXPECT_TRUE(mesh.FindEdge(VertexId(0), VertexId(1)).valid());
}

TEST(RestoreRevisionTest, OneImageTakesBackManyRestored) {
  Chronicle chronicle(TetWithDanglers());
  Mesh mesh = chronicle.mesh().Clone();
  std::vector<BatchImage> undos;
  const auto apply = [&](const std::vector<Edit>& edits) {
    auto applied = ApplyBatch(mesh, edits, {.make_image = true});
    ASSERT_TRUE(applied.ok()) << applied.status();
    undos.push_back(*std::move(applied->image));
  };
  apply({RemoveElementsEdit{EntityKind::kCell, {0}}, RemoveElementsEdit{EntityKind::kFace, {4}}});
  apply({AddElementsEdit{ElementType::kTetrahedron, {1, 0, 2, 4}}, MoveVerticesEdit{{2}, {{3, 3, 3}}}});
  apply({RemoveElementsEdit{EntityKind::kCell, {0}}});
  const std::string last = DescribeContent(mesh, 0);
  mesh.BeginBatch();
  for (size_t i = undos.size(); i > 0; --i) ASSERT_TRUE(mesh.Restore(undos[i - 1]).ok());
  const BatchImage redo = mesh.ImageSince(0);
  Commit(mesh);
  EXPECT_EQ(FirstDifference(DescribeContent(mesh, 0), DescribeContent(chronicle.mesh(), 0)), "");
  ASSERT_TRUE(RestoreBatches(mesh, {&redo}, {}).ok());
  EXPECT_THAT(Validate(mesh), IsEmpty());
  EXPECT_EQ(FirstDifference(DescribeContent(mesh, 0), last), "");
}

TEST(RestoreRevisionTest, TouchesWhatWhoIsReplacedWasMadeOf) {
  Mesh mesh = OneTet();
  AddVertices(mesh, 4);
  Commit(mesh);
  const Mesh then = mesh.Clone();
  ASSERT_TRUE(mesh.RemoveElement(CellId(0)).ok());
  Commit(mesh);
  Add(mesh, ElementType::kTetrahedron, {4, 5, 6, 7});
  Commit(mesh);
  ASSERT_EQ(mesh.slots(EntityKind::kEdge).limit(), 6u) << "every slot has had two";
  const auto image = ImageOfRevision(mesh, then, WorkMeter::Unlimited());
  ASSERT_TRUE(image.ok()) << image.status();
  mesh.BeginBatch();
  ASSERT_TRUE(mesh.Restore(*image).ok());
  const auto touched = mesh.Touched(WorkMeter::Unlimited());
  ASSERT_TRUE(touched.ok()) << touched.status();
  EXPECT_THAT((*touched)[0], ElementsAre(0, 1, 2, 3, 4, 5, 6, 7));
  EXPECT_THAT((*touched)[1], ElementsAre(0, 1, 2, 3, 4, 5));
  EXPECT_THAT((*touched)[3], ElementsAre(0));
  mesh.Rollback();
}

// ---- Options ----

/// A mesh at revision 3, of which not much is as it was.
Mesh Changed(Mesh mesh) {
  EXPECT_TRUE(ApplyBatch(mesh, {RemoveElementsEdit{EntityKind::kCell, {0, 1}}}, {}).ok());
  EXPECT_TRUE(ApplyBatch(mesh, {MoveVerticesEdit{{1}, {{9, 9, 9}}}, AddVerticesEdit{{{1, 2, 3}}}}, {}).ok());
  return mesh;
}

TEST(RestoreRevisionTest, AnImageThatIsTooLargeIsLeftOut) {
  const Mesh then = TetGrid(1, 1, 1);
  Mesh mesh = Changed(then.Clone());
  const auto restored = RestoreRevision(mesh, then, {.max_image_bytes = 100});
  ASSERT_TRUE(restored.ok()) << restored.status();
  EXPECT_TRUE(restored->images.empty());
  ExpectSameContent(mesh, then);
}

TEST(RestoreRevisionTest, WhoStopsItAtAnyStepHasChangedNothing) {
  const Mesh then = TetGrid(1, 1, 1);
  Mesh mesh = Changed(then.Clone());
  const std::string before = Describe(mesh);
  CountDown all(1 << 20);
  ASSERT_TRUE(RestoreRevision(mesh, then, {.dry_run = true, .meter = all}).ok());
  const int64_t needed = (1 << 20) - all.left();
  ASSERT_GT(needed, 10);
  for (int64_t steps = 0; steps < needed; ++steps) {
    CountDown meter(steps);
    EXPECT_EQ(RestoreRevision(mesh, then, {.meter = meter}).status(), CountDown::error());
    EXPECT_EQ(meter.charges_after_end(), 0);
    ASSERT_EQ(Describe(mesh), before);
  }
  CountDown enough(needed);
  EXPECT_TRUE(RestoreRevision(mesh, then, {.meter = enough}).ok());
}

TEST(RestoreRevisionTest, PagesThatNobodyTouchedAreNotLookedAt) {
  const Mesh then = TetGrid(8, 8, 8);
  Mesh mesh = then.Clone();
  ASSERT_TRUE(ApplyBatch(mesh, {MoveVerticesEdit{{1}, {{9, 9, 9}}}}, {}).ok());
  CountDown meter(int64_t{1} << 40);
  ASSERT_TRUE(RestoreRevision(mesh, then, {.meter = meter}).ok());
  const int64_t steps = (int64_t{1} << 40) - meter.left();
  const int64_t unstamped = int64_t{then.NumLive(EntityKind::kEdge)} + then.NumLive(EntityKind::kFace);
  EXPECT_LE(steps, unstamped + 20);
}

class Refuser : public BatchKeeper {
 public:
  absl::Status Keep(const Mesh&) override { return absl::UnavailableError("full"); }
};

TEST(RestoreRevisionTest, WhatCannotBeKeptIsNotDone) {
  const Mesh then = TetGrid(1, 1, 1);
  Mesh mesh = Changed(then.Clone());
  const std::string before = Describe(mesh);
  Refuser keeper;
  EXPECT_EQ(RestoreRevision(mesh, then, {.keeper = &keeper}).status(), absl::UnavailableError("full"));
  EXPECT_EQ(Describe(mesh), before);
  EXPECT_TRUE(RestoreRevision(mesh, then, {.dry_run = true, .keeper = &keeper}).ok());
  EXPECT_EQ(Describe(mesh), before);
}

// ---- What the mesh never was ----

/// The error of a target that is refused without a trace.
absl::Status RefusalOf(Mesh& mesh, const Mesh& target) {
  const std::string before = Describe(mesh);
  const absl::Status status = RestoreRevision(mesh, target, {}).status();
  EXPECT_EQ(Describe(mesh), before);
  EXPECT_THAT(Validate(mesh), IsEmpty());
  return status;
}

TEST(RestoreRevisionTest, TheFutureIsRefused) {
  Mesh mesh = TetGrid(1, 1, 1);
  const absl::Status status = RefusalOf(mesh, Changed(mesh.Clone()));
  EXPECT_EQ(status.code(), absl::StatusCode::kOutOfRange);
  EXPECT_EQ(ErrorReason(status), reason::kRevisionInFuture);
  EXPECT_EQ(GetErrorDetail(status)->Find("requested"), "3");
  EXPECT_EQ(GetErrorDetail(status)->Find("revision"), "1");
}

TEST(RestoreRevisionTest, ColumnsThatTheMeshHasNotAreRefused) {
  Mesh mesh = Changed(TetGrid(1, 1, 1));
  Mesh other = TetGrid(1, 1, 1);
  ASSERT_TRUE(other.AddAttribute({"foreign", EntityKind::kFace, AttributeType::kInt32, 1}).ok());
  Commit(other);
  const absl::Status status = RefusalOf(mesh, other);
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(ErrorReason(status), reason::kBadArgument);
  EXPECT_EQ(GetErrorDetail(status)->Find("attribute"), "foreign");
  EXPECT_EQ(GetErrorDetail(status)->Find("kind"), "face");
}

TEST(RestoreRevisionTest, AnEntityThatIsAnotherIsNamed) {
  Mesh mesh = TetGrid(1, 1, 1), other = TetGrid(1, 1, 1);
  ASSERT_TRUE(mesh.MoveVertex(VertexId(3), {1, 1, 1}).ok());
  Commit(mesh);
  ASSERT_TRUE(mesh.MoveVertex(VertexId(3), {2, 2, 2}).ok());
  Commit(mesh);
  const auto corners = other.Vertices(CellId(0));
  const std::vector<VertexId> same(corners.begin(), corners.end());
  ASSERT_TRUE(other.RemoveElement(CellId(0)).ok());
  Commit(other);
  ASSERT_TRUE(other.AddElement(ElementType::kTetrahedron, same).ok());
  Commit(other);
  const absl::Status status = RefusalOf(mesh, other);
  EXPECT_EQ(ErrorReason(status), reason::kBadArgument);
  EXPECT_EQ(GetErrorDetail(status)->Find("kind"), "edge");
  EXPECT_FALSE(GetErrorDetail(status)->Find("ids").empty());
}

TEST(RestoreRevisionTest, OtherMeshesAreRefused) {
  auto meshes = AllMeshes();
  for (auto& [name, mesh] : meshes) {
    Mesh later = mesh.Clone();
    ASSERT_TRUE(later.AddVertex({1, 2, 3}).ok());
    Commit(later);
    for (auto& [other_name, other] : meshes) {
      if (other.FitNow() == mesh.FitNow()) continue;
      SCOPED_TRACE(std::string(name) + " to " + other_name);
      EXPECT_EQ(ErrorReason(RefusalOf(later, other)), reason::kBadArgument);
    }
  }
}

TEST(RestoreRevisionTest, APositionThatTheMeshNeverHadIsRefused) {
  Mesh mesh = TetGrid(1, 1, 1), other = TetGrid(1, 1, 1);
  ASSERT_TRUE(other.MoveVertex(VertexId(3), {1, 1, 1}).ok());
  Commit(other);
  Mesh later = Changed(mesh.Clone());
  const absl::Status status = RefusalOf(later, other);
  EXPECT_EQ(ErrorReason(status), reason::kBadArgument);
}

}  // namespace
}  // namespace dynmesh::testing
