#include <thread>

#include "core/codec/surface_codec.h"
#include "core/mesh/relations.h"
#include "tests/server/server_support.h"
#include "tests/support/meshes.h"

namespace dynmesh::testing {
namespace {

using ::testing::ElementsAre;

struct NeighborsResult {
  grpc::Status status;
  int64_t revision = -1;
  std::vector<Slot> ids;
  CsrTable table;
};

class QueriesRpcTest : public ServerTest {
 protected:
  QueriesRpcTest() { EXPECT_TRUE(CreateSession("mesh").ok()); }

  NeighborsResult Neighbors(v1::EntityKind from, v1::EntityKind to, const v1::Selection& selection,
                            int64_t as_of = 0) {
    PatientContext context;
    v1::GetNeighborsRequest request;
    request.set_session("mesh");
    request.set_from(from);
    request.set_to(to);
    *request.mutable_selection() = selection;
    request.set_as_of_revision(as_of);
    const auto stream = queries().GetNeighbors(&context, request);
    NeighborsResult result;
    v1::GetNeighborsResponse response;
    while (stream->Read(&response)) {
      EXPECT_TRUE(result.revision == -1 || result.revision == response.revision());
      result.revision = response.revision();
      const auto ids = Array<Slot>(response.ids());
      const auto offsets = Array<uint32_t>(response.offsets());
      const auto neighbors = Array<Slot>(response.neighbors());
      EXPECT_EQ(offsets.size(), ids.size() + 1);
      result.ids.insert(result.ids.end(), ids.begin(), ids.end());
      for (size_t i = 0; i < ids.size(); ++i) {
        result.table.offsets.push_back(result.table.offsets.back() + offsets[i + 1] - offsets[i]);
      }
      result.table.ids.insert(result.table.ids.end(), neighbors.begin(), neighbors.end());
    }
    result.status = stream->Finish();
    return result;
  }

  grpc::Status Entities(v1::EntityKind kind, const v1::Selection& selection,
                        std::vector<v1::GetEntitiesResponse>* chunks) {
    PatientContext context;
    v1::GetEntitiesRequest request;
    request.set_session("mesh");
    request.set_kind(kind);
    *request.mutable_selection() = selection;
    const auto stream = queries().GetEntities(&context, request);
    chunks->emplace_back();
    while (stream->Read(&chunks->back())) chunks->emplace_back();
    chunks->pop_back();
    return stream->Finish();
  }

  grpc::Status Boundary(v1::EntityKind kind, std::vector<Slot>* ids) {
    PatientContext context;
    v1::GetBoundaryRequest request;
    request.set_session("mesh");
    request.set_kind(kind);
    const auto stream = queries().GetBoundary(&context, request);
    v1::GetBoundaryResponse response;
    while (stream->Read(&response)) {
      EXPECT_EQ(response.revision(), 1);
      for (Slot slot : Array<Slot>(response.ids())) ids->push_back(slot);
    }
    return stream->Finish();
  }

  grpc::Status Surface(int bits, std::string* drc) {
    PatientContext context;
    v1::GetBoundarySurfaceRequest request;
    request.set_session("mesh");
    request.set_position_bits(bits);
    const auto stream = queries().GetBoundarySurface(&context, request);
    v1::GetBoundarySurfaceResponse response;
    while (stream->Read(&response)) *drc += response.drc();
    return stream->Finish();
  }
};

v1::EntityKind Proto(EntityKind kind) { return static_cast<v1::EntityKind>(Dimension(kind) + 1); }

TEST_F(QueriesRpcTest, AnswersThatWaitToBeReadAreBounded) {
  Limits limits;
  limits.max_answer_bytes = 30'000'000;
  StartServer(limits);
  ASSERT_TRUE(CreateSession("mesh").ok());
  v1::ApplyEditsRequest many = Batch("mesh");
  *many.add_edits()->mutable_add_vertices() = AddVerticesMessage(SomePoints(150'000));
  for (int i = 0; i < 4; ++i) MustApply(many);
  v1::GetEntitiesRequest request;
  request.set_session("mesh");
  request.set_kind(v1::ENTITY_KIND_VERTEX);
  *request.mutable_selection() = SelectAll();
  {
    // The first chunk arrives when all is gathered; the flow of bytes stops long before the last one does.
    PatientContext context;
    const auto unread = queries().GetEntities(&context, request);
    v1::GetEntitiesResponse chunk;
    ASSERT_TRUE(unread->Read(&chunk));
    std::vector<v1::GetEntitiesResponse> chunks;
    ExpectError(Entities(v1::ENTITY_KIND_VERTEX, SelectAll(), &chunks), grpc::RESOURCE_EXHAUSTED,
                reason::kLimitExceeded, "limit", "max_answer_bytes");
    while (unread->Read(&chunk)) {
    }
    EXPECT_TRUE(unread->Finish().ok());
  }
  std::vector<v1::GetEntitiesResponse> chunks;
  EXPECT_TRUE(Entities(v1::ENTITY_KIND_VERTEX, SelectAll(), &chunks).ok());
}

TEST_F(QueriesRpcTest, All16RelationsAreThoseOfTheMesh) {
  const Mesh mesh = TetGrid(5, 5, 5);
  ASSERT_TRUE(Import("mesh", mesh).ok());
  for (EntityKind from : kEntityKinds) {
    for (EntityKind to : kEntityKinds) {
      const NeighborsResult result = Neighbors(Proto(from), Proto(to), SelectAll());
      ASSERT_TRUE(result.status.ok()) << result.status.error_message();
      EXPECT_EQ(result.revision, 1);
      EXPECT_EQ(result.ids.size(), mesh.NumLive(from));
      const CsrTable expected = dynmesh::Neighbors(mesh, {from, to}, result.ids);
      EXPECT_EQ(result.table.offsets, expected.offsets);
      EXPECT_EQ(result.table.ids, expected.ids);
    }
  }
}

TEST_F(QueriesRpcTest, SelectionsNameIdsRangesOrAll) {
  ASSERT_TRUE(Import("mesh", TetGrid(2, 2, 2)).ok());
  const auto ids = [&](const v1::Selection& selection) {
    return Neighbors(v1::ENTITY_KIND_CELL, v1::ENTITY_KIND_VERTEX, selection).ids;
  };
  EXPECT_THAT(ids(SelectIds({7, 3, 7})), ElementsAre(7, 3, 7));
  v1::Selection range;
  range.mutable_range()->set_begin(46);
  range.mutable_range()->set_end(4'000'000'000u);
  EXPECT_THAT(ids(range), ElementsAre(46, 47));
  EXPECT_EQ(ids(SelectAll()).size(), 48u);
  EXPECT_EQ(Neighbors(v1::ENTITY_KIND_CELL, v1::ENTITY_KIND_VERTEX, SelectIds({})).revision, 1);
}

TEST_F(QueriesRpcTest, RefusalsHaveReasons) {
  MustApply(TetBatch("mesh"));
  v1::ApplyEditsRequest remove = Batch("mesh");
  remove.add_edits()->mutable_remove_elements()->set_kind(v1::ENTITY_KIND_CELL);
  remove.mutable_edits(0)->mutable_remove_elements()->set_ids(Bytes<Slot>({0}));
  MustApply(TetBatch("mesh"));
  MustApply(remove);
  constexpr auto kVertex = v1::ENTITY_KIND_VERTEX;
  constexpr auto kCell = v1::ENTITY_KIND_CELL;
  const auto expect = [](const NeighborsResult& result, grpc::StatusCode code, const char* why,
                         const char* key,
                         const char* value) { ExpectError(result.status, code, why, key, value); };
  expect(Neighbors(kCell, kVertex, SelectIds({1, 0})), grpc::NOT_FOUND, reason::kEntityRemoved, "ids", "0");
  expect(Neighbors(kCell, kVertex, SelectIds({9, 0})), grpc::NOT_FOUND, reason::kUnknownEntity, "ids", "9,0");
  expect(Neighbors(kCell, kVertex, SelectIds({1}), 1), grpc::NOT_FOUND, reason::kEntityRemoved, "kind",
         "cell");
  expect(Neighbors(kCell, kVertex, SelectIds({1}), 9), grpc::OUT_OF_RANGE, reason::kRevisionInFuture,
         "actual", "3");
  expect(Neighbors(kCell, static_cast<v1::EntityKind>(9), SelectAll()), grpc::INVALID_ARGUMENT,
         reason::kBadEntityKind, "field", "to");
  expect(Neighbors(v1::ENTITY_KIND_UNSPECIFIED, kCell, SelectAll()), grpc::INVALID_ARGUMENT,
         reason::kBadEntityKind, "field", "from");
  expect(Neighbors(kCell, kVertex, v1::Selection()), grpc::INVALID_ARGUMENT, reason::kBadArgument, "field",
         "selection");
  v1::Selection odd;
  odd.set_ids("abc");
  expect(Neighbors(kCell, kVertex, odd), grpc::INVALID_ARGUMENT, reason::kBadArrayLength, "field",
         "selection.ids");
  std::vector<v1::GetEntitiesResponse> chunks;
  ExpectError(Entities(v1::ENTITY_KIND_UNSPECIFIED, SelectAll(), &chunks), grpc::INVALID_ARGUMENT,
              reason::kBadEntityKind);
  std::vector<Slot> ids;
  ExpectError(Boundary(kCell, &ids), grpc::INVALID_ARGUMENT, reason::kBadEntityKind, "kind", "cell");
  std::string drc;
  ExpectError(Surface(31, &drc), grpc::INVALID_ARGUMENT, reason::kBadArgument, "field", "position_bits");
  ASSERT_TRUE(DeleteSession("mesh").ok());
  expect(Neighbors(kCell, kVertex, SelectAll()), grpc::NOT_FOUND, reason::kSessionNotFound, "session",
         "mesh");
}

TEST_F(QueriesRpcTest, EntitiesTellWhatTheyAre) {
  ASSERT_TRUE(Import("mesh", TetWithDanglers()).ok());
  std::vector<v1::GetEntitiesResponse> chunks;
  ASSERT_TRUE(Entities(v1::ENTITY_KIND_FACE, SelectAll(), &chunks).ok());
  ASSERT_EQ(chunks.size(), 1u);
  EXPECT_EQ(chunks[0].revision(), 1);
  EXPECT_THAT(Array<Slot>(chunks[0].ids()), ElementsAre(0, 1, 2, 3, 4));
  EXPECT_THAT(Array<uint8_t>(chunks[0].types()), ElementsAre(2, 2, 2, 2, 2));
  EXPECT_THAT(Array<uint8_t>(chunks[0].flags()), ElementsAre(1, 2, 2, 2, 2));
  EXPECT_THAT(Array<uint32_t>(chunks[0].vertex_offsets()), ElementsAre(0, 3, 6, 9, 12, 15));
  EXPECT_THAT(Array<int64_t>(chunks[0].born_revisions()), ElementsAre(1, 1, 1, 1, 1));
  EXPECT_EQ(chunks[0].positions().size(), 0u);
  chunks.clear();
  ASSERT_TRUE(Entities(v1::ENTITY_KIND_VERTEX, SelectIds({2, 1}), &chunks).ok());
  EXPECT_EQ(Array<Point>(chunks[0].positions())[1], TetWithDanglers().Position(VertexId(1)));
  EXPECT_EQ(chunks[0].types().size(), 0u);
}

TEST_F(QueriesRpcTest, LargeAnswersComeInChunksOfOneRevision) {
  const Mesh mesh = TetGrid(25, 25, 25);
  ASSERT_TRUE(Import("mesh", mesh, nullptr, 50'000).ok());
  std::vector<v1::GetEntitiesResponse> chunks;
  ASSERT_TRUE(Entities(v1::ENTITY_KIND_CELL, SelectAll(), &chunks).ok());
  EXPECT_GT(chunks.size(), 2u);
  size_t cells = 0;
  for (const v1::GetEntitiesResponse& chunk : chunks) {
    EXPECT_LE(chunk.ByteSizeLong(), (size_t{1} << 20) + 1000);
    EXPECT_EQ(chunk.revision(), 1);
    cells += chunk.ids().size() / sizeof(Slot);
  }
  EXPECT_EQ(cells, mesh.NumLive(EntityKind::kCell));
}

TEST_F(QueriesRpcTest, BoundaryAndSurface) {
  const Mesh mesh = TetGrid(3, 3, 3);
  ASSERT_TRUE(Import("mesh", mesh).ok());
  for (EntityKind kind : {EntityKind::kVertex, EntityKind::kEdge, EntityKind::kFace}) {
    std::vector<Slot> ids, expected;
    ASSERT_TRUE(Boundary(Proto(kind), &ids).ok());
    mesh.Boundary(kind).ForEach([&](Slot slot) { expected.push_back(slot); });
    EXPECT_EQ(ids, expected);
  }
  std::string drc;
  ASSERT_TRUE(Surface(0, &drc).ok());
  EXPECT_EQ(DecodeSurface(drc)->triangles.size(), mesh.Boundary(EntityKind::kFace).size());
}

TEST_F(QueriesRpcTest, ASessionWithoutASurfaceSaysSo) {
  std::string drc;
  EXPECT_EQ(Surface(0, &drc).error_code(), grpc::FAILED_PRECONDITION);
}

TEST_F(QueriesRpcTest, AnswersAreLimited) {
  Limits limits;
  limits.max_query_bytes = 1000;
  StartServer(limits);
  ASSERT_TRUE(CreateSession("mesh").ok());
  ASSERT_TRUE(Import("mesh", TetGrid(3, 3, 3)).ok());
  const auto result = Neighbors(v1::ENTITY_KIND_CELL, v1::ENTITY_KIND_VERTEX, SelectAll());
  ExpectError(result.status, grpc::RESOURCE_EXHAUSTED, reason::kLimitExceeded, "limit", "max_query_bytes");
}

TEST_F(QueriesRpcTest, CancelledQueriesLeaveTheServerSound) {
  ASSERT_TRUE(Import("mesh", TetGrid(12, 12, 12)).ok());
  for (int i = 0; i < 30; ++i) {
    PatientContext context;
    v1::GetNeighborsRequest request;
    request.set_session("mesh");
    request.set_from(v1::ENTITY_KIND_VERTEX);
    request.set_to(v1::ENTITY_KIND_CELL);
    *request.mutable_selection() = SelectAll();
    const auto stream = queries().GetNeighbors(&context, request);
    v1::GetNeighborsResponse response;
    if (i % 2 == 0) stream->Read(&response);
    context.TryCancel();
    stream->Finish();
  }
  EXPECT_TRUE(Neighbors(v1::ENTITY_KIND_CELL, v1::ENTITY_KIND_VERTEX, SelectAll()).status.ok());
}

TEST_F(QueriesRpcTest, ReadersSeeWholeRevisionsWhileEditorsWork) {
  ASSERT_TRUE(Import("mesh", TetGrid(6, 6, 6)).ok());
  std::atomic<bool> stop{false};
  std::thread editor([&] {
    while (!stop) MustApply(TetBatch("mesh"));
  });
  for (int i = 0; i < 30; ++i) {
    // Each edit adds one cell, so the number of rows tells the revision.
    const auto result = Neighbors(v1::ENTITY_KIND_CELL, v1::ENTITY_KIND_CELL, SelectAll());
    ASSERT_TRUE(result.status.ok());
    EXPECT_EQ(static_cast<int64_t>(result.ids.size()), 6 * 6 * 6 * 6 + result.revision - 1);
  }
  stop = true;
  editor.join();
}

}  // namespace
}  // namespace dynmesh::testing
