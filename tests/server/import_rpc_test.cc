#include <map>
#include <vector>

#include "tests/server/server_support.h"
#include "tests/support/meshes.h"

namespace dynmesh::testing {
namespace {

using ::testing::ElementsAre;

class ImportRpcTest : public ServerTest {
 protected:
  ImportRpcTest() { EXPECT_TRUE(CreateSession("mesh").ok()); }

  /// All chunks of an export.
  std::vector<v1::ExportMeshResponse> Export(const std::string& session) {
    PatientContext context;
    v1::ExportMeshRequest request;
    request.set_session(session);
    const auto stream = sessions().ExportMesh(&context, request);
    std::vector<v1::ExportMeshResponse> chunks(1);
    while (stream->Read(&chunks.back())) chunks.emplace_back();
    chunks.pop_back();
    EXPECT_TRUE(stream->Finish().ok());
    return chunks;
  }
};

TEST_F(ImportRpcTest, AnyChunkingGivesTheSameSession) {
  const Mesh mesh = TetGrid(6, 6, 6);
  const size_t chunkings[] = {1, 7, 100, 1'000'000};
  for (size_t items : chunkings) {
    const std::string name = "chunks" + std::to_string(items);
    ASSERT_TRUE(CreateSession(name).ok());
    v1::ImportResult result;
    ASSERT_TRUE(Import(name, mesh, &result, items).ok());
    EXPECT_EQ(result.revision(), 1);
    EXPECT_EQ(result.session().checksum().topology(), mesh.checksum().topology);
    EXPECT_EQ(result.session().checksum().geometry(), mesh.checksum().geometry);
    EXPECT_EQ(result.session().counts().faces(), mesh.NumLive(EntityKind::kFace));
  }
}

TEST_F(ImportRpcTest, AnExportCanBeImported) {
  int number = 0;
  for (NamedMesh& named : AllMeshes()) {
    SCOPED_TRACE(named.name);
    const std::string from = "from" + std::to_string(number), to = "to" + std::to_string(number);
    ++number;
    ASSERT_TRUE(CreateSession(from).ok());
    ASSERT_TRUE(CreateSession(to).ok());
    ASSERT_TRUE(Import(from, named.mesh).ok());
    std::vector<v1::ImportMeshRequest> requests = {ImportHead(to)};
    size_t types = 0;
    for (const v1::ExportMeshResponse& chunk : Export(from)) {
      EXPECT_EQ(chunk.revision(), 1);
      v1::ImportMeshRequest& request = requests.emplace_back();
      if (chunk.has_vertices()) request.set_positions(chunk.vertices().positions());
      if (chunk.has_elements()) *request.mutable_elements() = chunk.elements().block();
      types += chunk.has_elements();
    }
    ASSERT_TRUE(ImportRequests(requests).ok());
    const v1::Session a = GetSession(from), b = GetSession(to);
    EXPECT_EQ(a.counts().SerializeAsString(), b.counts().SerializeAsString());
    EXPECT_EQ(a.boundary_counts().SerializeAsString(), b.boundary_counts().SerializeAsString());
    // With one type of elements ids are dense and in order, so the copy is equal to the last id.
    EXPECT_TRUE(types > 1 || a.checksum().SerializeAsString() == b.checksum().SerializeAsString());
  }
}

TEST_F(ImportRpcTest, AnExportOfAnEmptySessionTellsItsRevision) {
  const auto chunks = Export("mesh");
  ASSERT_EQ(chunks.size(), 1u);
  EXPECT_EQ(chunks[0].revision(), 0);
}

TEST_F(ImportRpcTest, AttributesTravelBothWays) {
  v1::ImportMeshRequest rows;
  *rows.mutable_attribute()->mutable_spec() = Spec("t", v1::ENTITY_KIND_VERTEX, v1::ATTRIBUTE_TYPE_INT32, 1);
  rows.mutable_attribute()->set_values(Bytes<int32_t>({1, 2, 3, 4}));
  ASSERT_TRUE(ImportRequests({ImportHead("mesh", 4, 1), ImportPositions(SomePoints(4)), rows,
                              ImportElements(v1::ELEMENT_TYPE_TETRAHEDRON, {0, 1, 2, 3})})
                  .ok());
  const auto chunks = Export("mesh");
  ASSERT_EQ(chunks.size(), 3u);
  EXPECT_EQ(chunks[2].attribute().spec().name(), "t");
  EXPECT_THAT(Array<int32_t>(chunks[2].attribute().values()), ElementsAre(1, 2, 3, 4));
}

TEST_F(ImportRpcTest, DefaultsAndPoliciesTravelBothWays) {
  v1::ImportMeshRequest rows;
  v1::AttributeSpec* spec = rows.mutable_attribute()->mutable_spec();
  *spec = Spec("t", v1::ENTITY_KIND_CELL, v1::ATTRIBUTE_TYPE_UINT8, 3);
  spec->set_default_row(Bytes<uint8_t>({9, 8, 7}));
  spec->set_policy(v1::ATTRIBUTE_POLICY_MAX);
  rows.mutable_attribute()->set_values(Bytes<uint8_t>({1, 2, 3}));
  ASSERT_TRUE(ImportRequests({ImportHead("mesh", 4, 1), ImportPositions(SomePoints(4)), rows,
                              ImportElements(v1::ELEMENT_TYPE_TETRAHEDRON, {0, 1, 2, 3})})
                  .ok());
  EXPECT_EQ(GetSession("mesh").attributes(0).SerializeAsString(), spec->SerializeAsString());
  const auto chunks = Export("mesh");
  ASSERT_EQ(chunks.size(), 3u);
  EXPECT_EQ(chunks[2].attribute().spec().SerializeAsString(), spec->SerializeAsString());
  EXPECT_EQ(chunks[2].attribute().values(), Bytes<uint8_t>({1, 2, 3}));
}

TEST_F(ImportRpcTest, HilbertOrderIsToldBeforeTheResultInPieces) {
  const Mesh mesh = TetGrid(36, 36, 36);  // more cells than one message has room for ids
  v1::ImportMeshRequest head = ImportHead("mesh");
  head.mutable_header()->set_slot_order(v1::SLOT_ORDER_HILBERT);
  std::vector<v1::ImportMeshRequest> requests = {head};
  std::vector<Point> points;
  mesh.slots(EntityKind::kVertex).live().ForEach([&](Slot v) {
    points.push_back(mesh.Position(VertexId(v)));
  });
  requests.push_back(ImportPositions(points));
  const Slot num_cells = mesh.NumLive(EntityKind::kCell);
  for (Slot c = 0; c < num_cells;) {
    std::vector<Slot> ids;
    for (; c < num_cells && ids.size() < 100'000; ++c) {
      for (VertexId v : mesh.Vertices(CellId(c))) ids.push_back(v.slot());
    }
    requests.push_back(ImportElements(v1::ELEMENT_TYPE_TETRAHEDRON, ids));
  }
  PatientContext context;
  const auto stream = sessions().ImportMesh(&context);
  for (const auto& request : requests) ASSERT_TRUE(stream->Write(request));
  stream->WritesDone();
  std::map<v1::EntityKind, std::vector<Slot>> told;
  int messages = 0;
  v1::ImportMeshResponse response;
  while (stream->Read(&response)) {
    if (!response.has_ids()) continue;
    const auto ids = Array<Slot>(response.ids().ids());
    auto& all = told[response.ids().kind()];
    all.insert(all.end(), ids.begin(), ids.end());
    ++messages;
  }
  ASSERT_TRUE(stream->Finish().ok());
  EXPECT_TRUE(response.has_result());
  EXPECT_GT(messages, 2);
  ASSERT_EQ(told[v1::ENTITY_KIND_VERTEX].size(), points.size());
  ASSERT_EQ(told[v1::ENTITY_KIND_CELL].size(), num_cells);
  std::vector<Point> positions;
  for (const v1::ExportMeshResponse& chunk : Export("mesh")) {
    for (const Point& point : Array<Point>(chunk.vertices().positions())) positions.push_back(point);
  }
  ASSERT_EQ(positions.size(), points.size());
  for (size_t v = 0; v < positions.size(); ++v) {
    EXPECT_EQ(positions[told[v1::ENTITY_KIND_VERTEX][v]], points[v]);
  }
}

TEST_F(ImportRpcTest, IdsThatWaitToBeReadKeepNobodyFromImporting) {
  Limits limits;
  limits.max_concurrent_imports = 1;
  StartServer(limits);
  for (const char* name : {"mesh", "other"}) ASSERT_TRUE(CreateSession(name).ok());
  v1::ImportMeshRequest head = ImportHead("mesh");
  head.mutable_header()->set_slot_order(v1::SLOT_ORDER_HILBERT);
  PatientContext context;
  const auto stream = sessions().ImportMesh(&context);
  stream->Write(head);
  for (int i = 0; i < 30; ++i) stream->Write(ImportPositions(SomePoints(100'000)));  // 12 MB of ids
  stream->WritesDone();
  v1::ImportMeshResponse response;
  while (!response.has_ids()) ASSERT_TRUE(stream->Read(&response));
  EXPECT_TRUE(Import("other", TetGrid(2, 2, 2)).ok());
  size_t told = Array<Slot>(response.ids().ids()).size();
  while (stream->Read(&response)) told += response.ids().ids().size() / sizeof(Slot);
  EXPECT_TRUE(stream->Finish().ok());
  EXPECT_EQ(told, 3'000'000u);
}

TEST_F(ImportRpcTest, IdsCountAsAnAnswerBeforeAnythingIsChanged) {
  Limits limits;
  limits.max_answer_bytes = 100'000;
  StartServer(limits);
  ASSERT_TRUE(CreateSession("mesh").ok());
  v1::ImportMeshRequest head = ImportHead("mesh");
  head.mutable_header()->set_slot_order(v1::SLOT_ORDER_HILBERT);
  ExpectError(ImportRequests({head, ImportPositions(SomePoints(40'000))}), grpc::RESOURCE_EXHAUSTED,
              reason::kLimitExceeded, "limit", "max_answer_bytes");
  ExpectStillEmpty("mesh");
  EXPECT_TRUE(ImportRequests({ImportHead("mesh"), ImportPositions(SomePoints(40'000))}).ok());
}

TEST_F(ImportRpcTest, AnUnknownSlotOrderIsRefused) {
  v1::ImportMeshRequest head = ImportHead("mesh");
  head.mutable_header()->set_slot_order(static_cast<v1::SlotOrder>(9));
  ExpectError(ImportRequests({head}), grpc::INVALID_ARGUMENT, reason::kBadArgument, "field", "slot_order");
}

TEST_F(ImportRpcTest, ProgressIsReported) {
  const Mesh mesh = TetGrid(22, 22, 22);
  PatientContext context;
  const auto stream = sessions().ImportMesh(&context);
  stream->Write(ImportHead("mesh", mesh.NumLive(EntityKind::kVertex)));
  std::vector<Point> points;
  mesh.slots(EntityKind::kVertex).live().ForEach([&](Slot slot) {
    points.push_back(mesh.Position(VertexId(slot)));
  });
  stream->Write(ImportPositions(points));
  std::vector<Slot> ids;
  mesh.slots(EntityKind::kCell).live().ForEach([&](Slot slot) {
    for (VertexId v : mesh.Vertices(CellId(slot))) ids.push_back(v.slot());
  });
  stream->Write(ImportElements(v1::ELEMENT_TYPE_TETRAHEDRON, ids));
  stream->WritesDone();
  std::vector<v1::ImportProgress> reports;
  v1::ImportMeshResponse response;
  while (stream->Read(&response)) {
    if (response.has_progress()) reports.push_back(response.progress());
  }
  EXPECT_TRUE(stream->Finish().ok());
  EXPECT_TRUE(response.has_result());
  ASSERT_GE(reports.size(), 3u);
  EXPECT_EQ(reports.front().phase(), "receiving");
  EXPECT_EQ(reports.front().total(), points.size());
  EXPECT_EQ(reports.back().phase(), "building");
  EXPECT_EQ(reports.back().total(), points.size() + ids.size() / 4);
  EXPECT_GT(reports.back().done(), 0u);
}

TEST_F(ImportRpcTest, AnEmptyImportIsRevision1) {
  v1::ImportResult result;
  ASSERT_TRUE(ImportRequests({ImportHead("mesh")}, &result).ok());
  EXPECT_EQ(result.revision(), 1);
}

TEST_F(ImportRpcTest, ValidateOnlyLeavesTheSessionEmpty) {
  auto head = ImportHead("mesh");
  head.mutable_header()->set_validate_only(true);
  v1::ImportResult result;
  ASSERT_TRUE(ImportRequests({head, ImportPositions(SomePoints(3)),
                              ImportElements(v1::ELEMENT_TYPE_TRIANGLE, {0, 1, 2, 2, 1, 0})},
                             &result)
                  .ok());
  EXPECT_EQ(result.revision(), 0);
  EXPECT_EQ(result.session().counts().faces(), 2u);
  EXPECT_EQ(result.warnings(0).reason(), "DUPLICATE_ELEMENT");
  ExpectStillEmpty("mesh");
}

TEST_F(ImportRpcTest, ARetryGetsTheFirstAnswer) {
  auto head = ImportHead("mesh");
  head.mutable_header()->set_request_id("once");
  v1::ImportResult first, again;
  ASSERT_TRUE(ImportRequests({head, ImportPositions(SomePoints(3))}, &first).ok());
  MustApply(TetBatch("mesh"));
  ASSERT_TRUE(ImportRequests({head, ImportPositions(SomePoints(1)), ImportPositions({SomePoints(3)[1]}),
                              ImportPositions({SomePoints(3)[2]})},
                             &again)
                  .ok());
  EXPECT_EQ(first.SerializeAsString(), again.SerializeAsString());
  ExpectError(ImportRequests({head, ImportPositions(SomePoints(4))}), grpc::INVALID_ARGUMENT,
              reason::kRequestIdReused);
}

}  // namespace
}  // namespace dynmesh::testing
