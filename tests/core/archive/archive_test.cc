#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/archive/head.h"
#include "core/mesh/bulk_build.h"
#include "core/mesh/error.h"
#include "tests/core/archive/archive_support.h"
#include "tests/support/meshes.h"
#include "tests/support/rows.h"
#include "tests/support/shaped_meshes.h"

namespace dynmesh::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

Mesh MustRebuild(const Archive& archive, uint32_t shuffle_seed = 0) {
  absl::StatusOr<Mesh> mesh = Rebuild(archive, shuffle_seed);
  EXPECT_TRUE(mesh.ok()) << mesh.status();
  return mesh.ok() ? *std::move(mesh) : Mesh();
}

/// Runs `edit` as a batch of its own that `keeper` takes the record of.
template <typename Edit>
void RunBatch(Mesh& mesh, ArchiveKeeper& keeper, Edit edit) {
  mesh.BeginBatch();
  edit();
  keeper.Keep(mesh);
  Commit(mesh);
}

AttributeSpec Temperature(EntityKind kind) {
  return {"temperature", kind, AttributeType::kFloat64, 1, AttributePolicy::kMax, RowOf({20.0})};
}

// ---- Pages ----

TEST(ArchiveTest, EveryMeshComesBackFromItsPages) {
  for (auto& [name, mesh] : AllMeshes()) {
    SCOPED_TRACE(name);
    ExpectIdentical(MustRebuild(Archive::Of(mesh)), mesh);
  }
}

TEST(ArchiveTest, AnEmptyMeshIsAHeadWithoutPages) {
  Mesh mesh;
  EXPECT_THAT(Archive::Of(mesh).pages, IsEmpty());
  ExpectIdentical(MustRebuild(Archive::Of(mesh)), mesh);
  Commit(mesh);
  ExpectIdentical(MustRebuild(Archive::Of(mesh)), mesh);
}

TEST(ArchiveTest, PagesMayComeInAnyOrder) {
  const Mesh mesh = TetGrid(6, 6, 6);
  const Archive archive = Archive::Of(mesh);
  ASSERT_GT(archive.pages.size(), 8u);
  for (uint32_t seed = 1; seed <= 5; ++seed) ExpectIdentical(MustRebuild(archive, seed), mesh);
}

TEST(ArchiveTest, ABulkBuiltMeshComesBack) {
  const Mesh grid = HexGrid(3, 2, 4);
  BulkBuilder builder({.mesh = {}, .order = SlotOrder::kHilbert});
  std::vector<Point> points;
  for (Slot v = 0; v < grid.slots(EntityKind::kVertex).limit(); ++v) {
    points.push_back(grid.Position(VertexId(v)));
  }
  ASSERT_TRUE(builder.AddVertices(points).ok());
  grid.slots(EntityKind::kCell).live().ForEach([&](Slot c) {
    ASSERT_TRUE(builder.AddElements(grid.Type(CellId(c)), grid.Vertices(CellId(c))).ok());
  });
  Mesh built = std::move(std::move(builder).Finish()->mesh);
  Commit(built);
  ExpectIdentical(MustRebuild(Archive::Of(built)), built);
}

TEST(ArchiveTest, SurfacesAndVolumesOfManyPagesComeBack) {
  const Mesh sphere = Sphere(3);
  ExpectIdentical(MustRebuild(Archive::Of(sphere)), sphere);
  const Mesh block = LBlock(2);
  ExpectIdentical(MustRebuild(Archive::Of(block)), block);
}

TEST(ArchiveTest, FreedSlotsKeepTheirStampsAndAreHandedOutInTheSameOrder) {
  Mesh mesh = TetGrid(2, 2, 2);
  for (Slot c : {3, 17, 5, 40}) ASSERT_TRUE(mesh.RemoveElement(CellId(c)).ok());
  Commit(mesh);
  Mesh rebuilt = MustRebuild(Archive::Of(mesh));
  ExpectIdentical(rebuilt, mesh);
  for (Mesh* each : {&mesh, &rebuilt}) {
    Add(*each, ElementType::kTetrahedron, {0, 5, 10, 15});
    Add(*each, ElementType::kTriangle, {1, 2, 20});
    Commit(*each);
  }
  ExpectIdentical(rebuilt, mesh);
}

TEST(ArchiveTest, OptionsComeBack) {
  MeshOptions options;
  options.duplicates = DuplicatePolicy::kRefuse;
  options.limits.max_slots = {5, 12, 9, 2};
  Mesh mesh(options);
  AddVertices(mesh, 4);
  Add(mesh, ElementType::kTetrahedron, {0, 1, 2, 3});
  Commit(mesh);
  Mesh rebuilt = MustRebuild(Archive::Of(mesh));
  ExpectIdentical(rebuilt, mesh);
  const std::vector<VertexId> tet = {VertexId(0), VertexId(1), VertexId(2), VertexId(3)};
  EXPECT_EQ(ErrorReason(rebuilt.AddElement(ElementType::kTetrahedron, tet).status()),
            reason::kDuplicateElement);
}

TEST(ArchiveTest, RoomForWiderElementsStaysWhenTheyAreGone) {
  Mesh mesh = OneTet();
  AddVertices(mesh, 4);
  const EntityId prism = Add(mesh, ElementType::kPrism, {0, 1, 2, 4, 5, 6});
  Commit(mesh);
  ASSERT_TRUE(mesh.RemoveElement(prism).ok());
  Commit(mesh);
  ASSERT_FALSE(mesh.IsTetrahedral());
  ExpectIdentical(MustRebuild(Archive::Of(mesh)), mesh);
}

TEST(ArchiveTest, DuplicatesAndDegenerateElementsComeBack) {
  Mesh mesh = OneTet();
  AddVertices(mesh, 2);
  Add(mesh, ElementType::kTriangle, {0, 1, 2});
  Add(mesh, ElementType::kTriangle, {2, 0, 1});
  Add(mesh, ElementType::kTriangle, {1, 0, 2});
  Add(mesh, ElementType::kWireEdge, {0, 1});
  Add(mesh, ElementType::kWireEdge, {1, 0});
  Add(mesh, ElementType::kWireEdge, {4, 4});
  Add(mesh, ElementType::kWireEdge, {4, 5});
  Add(mesh, ElementType::kWireEdge, {5, 4});
  Add(mesh, ElementType::kWireEdge, {4, 5});
  Add(mesh, ElementType::kTetrahedron, {0, 1, 2, 3});
  Add(mesh, ElementType::kTetrahedron, {0, 0, 1, 4});
  Add(mesh, ElementType::kQuad, {0, 1, 0, 5});
  Add(mesh, ElementType::kHexahedron, {0, 1, 1, 0, 2, 3, 3, 2});
  Commit(mesh);
  Mesh rebuilt = MustRebuild(Archive::Of(mesh));
  ExpectIdentical(rebuilt, mesh);
  for (Mesh* each : {&mesh, &rebuilt}) {  // the first duplicate becomes primary
    const EdgeId primary = each->FindEdge(VertexId(4), VertexId(5));
    ASSERT_TRUE(each->RemoveElement(primary).ok());
    EXPECT_TRUE(each->FindEdge(VertexId(4), VertexId(5)).valid());
    Commit(*each);
  }
  ExpectIdentical(rebuilt, mesh);
}

TEST(ArchiveTest, HubsAndBooksComeBack) {
  Mesh mesh = Book(700);
  const std::vector<VertexId> tips = AddVertices(mesh, 1300);
  for (int k = 0; k < 1200; k += 2) {
    Add(mesh, ElementType::kTetrahedron, {0, 1, tips[k].slot(), tips[k + 1].slot()});
  }
  for (int k = 0; k < 600; ++k) Add(mesh, ElementType::kTetrahedron, {0, 1, 2, tips[k].slot()});
  Commit(mesh);
  Mesh rebuilt = MustRebuild(Archive::Of(mesh));
  ExpectIdentical(rebuilt, mesh);
  for (Mesh* each : {&mesh, &rebuilt}) {
    ASSERT_TRUE(each->RemoveElement(CellId(7)).ok());
    Add(*each, ElementType::kTriangle, {0, 1, 3});
    Commit(*each);
  }
  ExpectIdentical(rebuilt, mesh);
}

TEST(ArchiveTest, AttributesOfEveryKindComeBackWithTheirStamps) {
  Mesh mesh = TetGrid(2, 2, 2);
  for (EntityKind kind : kEntityKinds) {
    ASSERT_TRUE(mesh.AddAttribute(Temperature(kind)).ok());
    Commit(mesh);
    for (Slot slot : {0, 2, 3}) {
      ASSERT_TRUE(mesh.SetAttribute(Dimension(kind), slot, RowOf({slot * 1.5})).ok());
      Commit(mesh);
    }
  }
  ASSERT_TRUE(mesh.RemoveElement(CellId(2)).ok());
  Commit(mesh);
  ExpectIdentical(MustRebuild(Archive::Of(mesh)), mesh);
}

// ---- Records ----

TEST(ArchiveTest, RecordsLeadFromAnEmptyMeshToTheLastOne) {
  Mesh mesh;
  ArchiveKeeper keeper(mesh);
  RunBatch(mesh, keeper, [&] { AddVertices(mesh, 8); });
  RunBatch(mesh, keeper, [&] { Add(mesh, ElementType::kTetrahedron, {0, 1, 2, 3}); });
  RunBatch(mesh, keeper, [&] { Add(mesh, ElementType::kHexahedron, {0, 1, 2, 3, 4, 5, 6, 7}); });
  RunBatch(mesh, keeper, [&] { ASSERT_TRUE(mesh.RemoveElement(CellId(0)).ok()); });
  RunBatch(mesh, keeper, [&] { ASSERT_TRUE(mesh.MoveVertex(VertexId(2), {9, 8, 7}).ok()); });
  RunBatch(mesh, keeper, [] {});
  EXPECT_THAT(keeper.archive().pages, IsEmpty());
  ExpectIdentical(MustRebuild(keeper.archive()), mesh);
}

TEST(ArchiveTest, AFaceThatIsTurnedIsTurnedInCellsThatNoRecordNames) {
  Mesh mesh = TwoHexes();
  ArchiveKeeper keeper(mesh);
  const FaceId shared = mesh.Faces(CellId(0))[1].face();
  const auto cycle = mesh.Vertices(shared);
  std::vector<VertexId> turned(cycle.rbegin(), cycle.rend());
  const uint32_t before = mesh.Faces(CellId(0))[1].packed();
  RunBatch(mesh, keeper, [&] { ASSERT_TRUE(mesh.AddElement(ElementType::kQuad, turned).ok()); });
  ASSERT_NE(mesh.Faces(CellId(0))[1].packed(), before);
  ExpectIdentical(MustRebuild(keeper.archive()), mesh);
}

TEST(ArchiveTest, WhatABatchBothMadeAndRemovedLeavesItsStamps) {
  Mesh mesh = OneTet();
  ArchiveKeeper keeper(mesh);
  RunBatch(mesh, keeper, [&] {
    AddVertices(mesh, 2);
    const EntityId tet = Add(mesh, ElementType::kTetrahedron, {1, 2, 3, 4});
    ASSERT_TRUE(mesh.RemoveElement(tet).ok());
    ASSERT_TRUE(mesh.RemoveVertex(VertexId(5)).ok());
  });
  ExpectIdentical(MustRebuild(keeper.archive()), mesh);
}

TEST(ArchiveTest, WhatWasTakenBackToASavepointIsNotRecorded) {
  Mesh mesh = OneTet();
  ArchiveKeeper keeper(mesh);
  RunBatch(mesh, keeper, [&] {
    AddVertices(mesh, 1);
    const Mesh::Savepoint savepoint = mesh.MakeSavepoint();
    AddVertices(mesh, 3);
    Add(mesh, ElementType::kQuad, {4, 5, 6, 7});
    ASSERT_TRUE(mesh.AddAttribute(Temperature(EntityKind::kVertex)).ok());
    mesh.RollbackTo(savepoint);
    Add(mesh, ElementType::kTriangle, {0, 1, 4});
  });
  ExpectIdentical(MustRebuild(keeper.archive()), mesh);
}

TEST(ArchiveTest, ColumnsThatABatchAddsComeBack) {
  Mesh mesh = OneTet();
  ArchiveKeeper keeper(mesh);
  RunBatch(mesh, keeper, [&] {
    ASSERT_TRUE(mesh.AddAttribute(Temperature(EntityKind::kVertex)).ok());
    ASSERT_TRUE(mesh.SetAttribute(0, 3, RowOf({37.0})).ok());
  });
  RunBatch(mesh, keeper, [&] { ASSERT_TRUE(mesh.AddAttribute(Temperature(EntityKind::kCell)).ok()); });
  RunBatch(mesh, keeper, [&] { ASSERT_TRUE(mesh.RemoveElement(CellId(0)).ok()); });
  RunBatch(mesh, keeper, [&] { ASSERT_TRUE(mesh.RemoveVertex(VertexId(3)).ok()); });
  ExpectIdentical(MustRebuild(keeper.archive()), mesh);
}

TEST(ArchiveTest, ARecordTellsItsNoteAndRevisionWithoutTheMesh) {
  Mesh mesh = OneTet();
  const Archive before = Archive::Of(mesh);
  RecordEncoder encoder;
  mesh.BeginBatch();
  AddVertices(mesh, 1);
  const std::string note("any\0bytes", 9);
  const std::string record = encoder.Encode(mesh, note);
  Commit(mesh);
  const absl::StatusOr<RecordView> view = ReadRecord(record);
  ASSERT_TRUE(view.ok()) << view.status();
  EXPECT_EQ(view->note, note);
  EXPECT_EQ(view->revision, mesh.revision());
  EXPECT_TRUE(view->fit == mesh.FitNow());
  absl::StatusOr<Rebuilder> rebuilder = Rebuilder::Start(before.head);
  ASSERT_TRUE(rebuilder.ok()) << rebuilder.status();
  for (const auto& [id, page] : before.pages) ASSERT_TRUE(rebuilder->AddPage(page).ok());
  ASSERT_TRUE(rebuilder->AddRecord(*view).ok());
  EXPECT_EQ(rebuilder->revision(), mesh.revision());
  ExpectIdentical(*std::move(*rebuilder).Finish(), mesh);
}

TEST(ArchiveTest, RecordsBeforeTheHeadArePassedOver) {
  Mesh mesh = OneTet();
  ArchiveKeeper keeper(mesh);
  for (int k = 0; k < 4; ++k) RunBatch(mesh, keeper, [&] { AddVertices(mesh, 1); });
  Archive archive = Archive::Of(mesh);
  archive.records = keeper.archive().records;
  ExpectIdentical(MustRebuild(archive), mesh);
}

TEST(ArchiveTest, AMissingRecordIsDataLoss) {
  Mesh mesh = OneTet();
  ArchiveKeeper keeper(mesh);
  for (int k = 0; k < 4; ++k) RunBatch(mesh, keeper, [&] { AddVertices(mesh, 1); });
  Archive archive = keeper.archive();
  archive.records.erase(archive.records.begin() + 1);
  const absl::Status status = Rebuild(archive).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
  EXPECT_EQ(ErrorReason(status), reason::kArchiveDamaged);
  EXPECT_EQ(GetErrorDetail(status)->Find("revision"), "4");
}

// ---- Checkpoints ----

TEST(ArchiveTest, BatchesMarkThePagesThatTheyTouch) {
  Mesh mesh = TetGrid(6, 6, 6);
  DirtyPages dirty;
  mesh.BeginBatch();
  ASSERT_TRUE(mesh.MoveVertex(VertexId(3), {0, 0, 0}).ok());
  dirty.Add(mesh.journal());
  Commit(mesh);
  EXPECT_THAT(dirty.List(), ::testing::ElementsAre(PageId{EntityKind::kVertex, 0}));
  mesh.BeginBatch();
  ASSERT_TRUE(mesh.RemoveElement(CellId(kPageSlots + 1)).ok());
  dirty.Add(mesh.journal());
  Commit(mesh);
  EXPECT_TRUE(dirty.Has({EntityKind::kCell, 1}));
  EXPECT_FALSE(dirty.Has({EntityKind::kCell, 0}));
  DirtyPages all;
  all.AddAll(mesh);
  EXPECT_EQ(all.size(), Archive::Of(mesh).pages.size());
  all.Add(dirty);
  EXPECT_EQ(all.size(), Archive::Of(mesh).pages.size());
}

TEST(ArchiveTest, PagesTakenBetweenBatchesAreMadeExactByTheRecords) {
  Mesh mesh = TetGrid(3, 3, 3);
  ArchiveKeeper keeper(mesh);
  for (int batch = 0; batch < 30; ++batch) {
    RunBatch(mesh, keeper, [&] {
      ASSERT_TRUE(mesh.RemoveElement(CellId(5 * batch)).ok());
      if (batch % 3 == 0) Add(mesh, ElementType::kPrism, {0, 1, 2, 3, 4, static_cast<Slot>(5 + batch)});
      if (batch % 4 == 0) AddVertices(mesh, 40);
    });
    if (!keeper.is_checkpointing()) keeper.BeginCheckpoint(mesh);
    if (keeper.is_checkpointing()) keeper.CopyPage(mesh, 0);
    ExpectIdentical(MustRebuild(keeper.archive()), mesh);
  }
}

TEST(ArchiveTest, AMissingPageIsDataLossThatNamesASlot) {
  const Mesh mesh = TetGrid(6, 6, 6);
  for (const auto& [page, bytes] : Archive::Of(mesh).pages) {
    Archive archive = Archive::Of(mesh);
    archive.pages.erase(page);
    const absl::Status status = Rebuild(archive).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
    EXPECT_EQ(GetErrorDetail(status)->Find("kind"), EntityKindName(page.kind));
    EXPECT_EQ(GetErrorDetail(status)->Find("ids"), std::to_string(page.index * kPageSlots));
  }
}

TEST(ArchiveTest, APageOfALaterRevisionThanTheRecordsIsDataLoss) {
  Mesh mesh = OneTet();
  Archive archive = Archive::Of(mesh);
  mesh.BeginBatch();
  ASSERT_TRUE(mesh.MoveVertex(VertexId(0), {5, 5, 5}).ok());
  Commit(mesh);
  const PageId page{EntityKind::kVertex, 0};
  archive.pages[page] = EncodePage(mesh, page);
  const absl::Status status = Rebuild(archive).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(std::string(status.message()), HasSubstr("later revision"));
}

// ---- Refusals ----

TEST(ArchiveTest, ANewerFormatIsRefusedAsSuch) {
  Mesh mesh = OneTet();
  ArchiveKeeper keeper(mesh);
  RunBatch(mesh, keeper, [&] { AddVertices(mesh, 1); });
  constexpr size_t kFormatByte = 5;
  const auto newer = [](std::string part) {
    part[kFormatByte] = 2;
    return part;  // not resealed: another format may be sealed otherwise
  };
  const auto expect_newer = [](const absl::Status& status) {
    EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
    EXPECT_EQ(ErrorReason(status), reason::kArchiveFormatNewer);
  };
  Archive archive = keeper.archive();
  archive.head = newer(archive.head);
  expect_newer(Rebuild(archive).status());
  archive = keeper.archive();
  archive.pages.begin()->second = newer(archive.pages.begin()->second);
  expect_newer(Rebuild(archive).status());
  archive = keeper.archive();
  archive.records[0] = newer(archive.records[0]);
  expect_newer(Rebuild(archive).status());
}

TEST(ArchiveTest, AMeshThatWouldTakeTooMuchMemoryIsRefusedBeforeItDoes) {
  const Mesh mesh = TetGrid(3, 3, 3);
  const absl::Status status = Rebuild(Archive::Of(mesh), 0, {.max_memory_bytes = 1000}).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(ErrorReason(status), reason::kLimitExceeded);
}

TEST(ArchiveTest, WhatIsTakenIsAskedForBeforeAndARefusalEndsAll) {
  const Archive archive = Archive::Of(TetGrid(3, 3, 3));
  uint64_t asked = 0, left = std::numeric_limits<uint64_t>::max();
  const auto charge = [&](uint64_t bytes) -> absl::Status {
    if (bytes > left) return LimitExceeded("left", left, bytes);
    asked += bytes;
    left -= bytes;
    return absl::OkStatus();
  };
  const auto rebuilder = Rebuilder::Start(archive.head, {.charge = charge});
  ASSERT_TRUE(rebuilder.ok());
  EXPECT_EQ(asked, rebuilder->memory_bytes());
  left = asked - 1;
  EXPECT_EQ(ErrorReason(Rebuilder::Start(archive.head, {.charge = charge}).status()), reason::kLimitExceeded);
}

TEST(ArchiveTest, RowsOfColumnsCountAgainstTheMemoryLimit) {
  Mesh mesh = TetGrid(3, 3, 3);
  const RebuildOptions options = {.max_memory_bytes = 100'000};
  EXPECT_TRUE(Rebuild(Archive::Of(mesh), 0, options).ok());
  const AttributeSpec wide{"wide", EntityKind::kCell, AttributeType::kFloat64, 16};
  ASSERT_TRUE(mesh.AddAttribute(wide).ok());
  ASSERT_TRUE(mesh.SetAttribute(0, 0, RowOf(std::vector<double>(16, 1.0))).ok());
  Commit(mesh);
  EXPECT_EQ(ErrorReason(Rebuild(Archive::Of(mesh), 0, options).status()), reason::kLimitExceeded);
  EXPECT_TRUE(Rebuild(Archive::Of(mesh)).ok());
}

TEST(ArchiveTest, PartsOfAnotherMeshAreDataLoss) {
  const Mesh mesh = TetGrid(2, 2, 2), other = HexGrid(2, 2, 2);
  Archive archive = Archive::Of(mesh);
  archive.head = EncodeHead(other);
  EXPECT_EQ(Rebuild(archive).status().code(), absl::StatusCode::kDataLoss);
}

}  // namespace
}  // namespace dynmesh::testing
