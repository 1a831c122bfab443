// Imports that are refused, cancelled, too many at once, too large or too slow: nothing is left of them.

#include <cmath>

#include "absl/time/clock.h"
#include "tests/server/server_support.h"
#include "tests/support/meshes.h"

namespace dynmesh::testing {
namespace {

class ImportEndTest : public ServerTest {
 protected:
  ImportEndTest() { EXPECT_TRUE(CreateSession("mesh").ok()); }
};

struct ImportCase {
  const char* name;
  std::vector<v1::ImportMeshRequest> requests;
  grpc::StatusCode code;
  const char* reason;
  const char* key;
  const char* value;
};

TEST_F(ImportEndTest, HostileImportsAreRefusedByIndexAndLeaveNothing) {
  const auto head = ImportHead("mesh");
  const auto points = ImportPositions(SomePoints(4));
  const auto tet = ImportElements(v1::ELEMENT_TYPE_TETRAHEDRON, {0, 1, 2, 3});
  const double inf = INFINITY;
  v1::ImportMeshRequest half, odd_type, rows_with_ids, odd_rows;
  half.set_positions(std::string(23, '\0'));
  odd_type.mutable_elements()->set_type(static_cast<v1::ElementType>(200));
  *rows_with_ids.mutable_attribute()->mutable_spec() =
      Spec("t", v1::ENTITY_KIND_VERTEX, v1::ATTRIBUTE_TYPE_INT32, 1);
  odd_rows = rows_with_ids;
  rows_with_ids.mutable_attribute()->set_ids(Bytes<Slot>({0}));
  odd_rows.mutable_attribute()->set_values("12345");
  constexpr grpc::StatusCode kInvalid = grpc::INVALID_ARGUMENT;
  const std::vector<ImportCase> cases = {
      {"no message", {}, kInvalid, reason::kBadArgument, "field", "header"},
      {"no header", {points}, kInvalid, reason::kBadArgument, "field", "header"},
      {"two headers", {head, head}, kInvalid, reason::kBadArgument, "field", "header"},
      {"empty message", {head, v1::ImportMeshRequest()}, kInvalid, reason::kBadArgument, "field", "part"},
      {"empty header", {ImportHead("")}, kInvalid, reason::kBadSessionName, "field", "name"},
      {"no such session",
       {ImportHead("nobody")},
       grpc::NOT_FOUND,
       reason::kSessionNotFound,
       "session",
       "nobody"},
      {"NaN",
       {head, points, ImportPositions({{0, 0, 0}, {0, NAN, 0}})},
       kInvalid,
       reason::kNonFinite,
       "index",
       "5"},
      {"infinite", {head, ImportPositions({{0, 0, -inf}})}, kInvalid, reason::kNonFinite, "index", "0"},
      {"half a point", {head, half}, kInvalid, reason::kBadArrayLength, "index", "0"},
      {"half a tet",
       {head, points, tet, ImportElements(v1::ELEMENT_TYPE_TETRAHEDRON, {0, 1, 2})},
       kInvalid,
       reason::kBadArrayLength,
       "index",
       "1"},
      {"odd type", {head, points, odd_type}, kInvalid, reason::kBadElementType, "index", "0"},
      {"id out of range",
       {head, points, tet, ImportElements(v1::ELEMENT_TYPE_WIRE_EDGE, {0, 1, 1, 4})},
       kInvalid,
       reason::kUnknownEntity,
       "index",
       "2"},
      {"huge id",
       {head, points, ImportElements(v1::ELEMENT_TYPE_WIRE_EDGE, {0, 0xffffffffu})},
       kInvalid,
       reason::kUnknownEntity,
       "ids",
       "4294967295"},
      {"claims more vertices",
       {ImportHead("mesh", 100'000'000), points},
       kInvalid,
       reason::kCountMismatch,
       "actual",
       "4"},
      {"claims fewer elements",
       {ImportHead("mesh", 0, 1), points, tet, tet},
       kInvalid,
       reason::kCountMismatch,
       "actual",
       "2"},
      {"claims absurdly",
       {ImportHead("mesh", ~uint64_t{0})},
       grpc::RESOURCE_EXHAUSTED,
       reason::kLimitExceeded,
       "limit",
       "max_vertices"},
      {"rows with ids", {head, points, rows_with_ids}, kInvalid, reason::kBadArgument, "field", "ids"},
      {"odd rows", {head, points, odd_rows}, kInvalid, reason::kBadArrayLength, "index", "1"},
  };
  for (const ImportCase& hostile : cases) {
    SCOPED_TRACE(hostile.name);
    ExpectError(ImportRequests(hostile.requests), hostile.code, hostile.reason, hostile.key, hostile.value);
    ExpectStillEmpty("mesh");
  }
  ASSERT_TRUE(Import("mesh", OneTet()).ok());
  ExpectError(Import("mesh", OneTet()), grpc::FAILED_PRECONDITION, reason::kSessionNotEmpty, "revision", "1");
  EXPECT_EQ(GetSession("mesh").revision(), 1);
}

TEST_F(ImportEndTest, AnImportCancelledBeforeItsEndLeavesTheSessionEmpty) {
  for (int i = 0; i < 100; ++i) {
    PatientContext context;
    const auto stream = sessions().ImportMesh(&context);
    stream->Write(ImportHead("mesh"));
    for (int k = 0; k < i % 4; ++k) stream->Write(ImportPositions(SomePoints(100)));
    context.TryCancel();
    EXPECT_EQ(stream->Finish().error_code(), grpc::CANCELLED);
    ExpectStillEmpty("mesh");
  }
  ASSERT_TRUE(Import("mesh", OneTet()).ok());
}

TEST_F(ImportEndTest, AnImportCancelledWhileItIsBuiltIsDoneWholeOrNotAtAll) {
  const Mesh mesh = TetGrid(12, 12, 12);
  std::vector<Point> points;
  std::vector<Slot> ids;
  mesh.slots(EntityKind::kVertex).live().ForEach([&](Slot slot) {
    points.push_back(mesh.Position(VertexId(slot)));
  });
  mesh.slots(EntityKind::kCell).live().ForEach([&](Slot slot) {
    for (VertexId v : mesh.Vertices(CellId(slot))) ids.push_back(v.slot());
  });
  for (int i = 0; i < 20; ++i) {
    const std::string name = "s" + std::to_string(i);
    ASSERT_TRUE(CreateSession(name).ok());
    PatientContext context;
    const auto stream = sessions().ImportMesh(&context);
    stream->Write(ImportHead(name));
    stream->Write(ImportPositions(points));
    stream->Write(ImportElements(v1::ELEMENT_TYPE_TETRAHEDRON, ids));
    stream->WritesDone();
    v1::ImportMeshResponse response;
    while (stream->Read(&response) && response.progress().phase() != "building") {
    }
    context.TryCancel();
    EXPECT_EQ(stream->Finish().error_code(), grpc::CANCELLED);
    const v1::Session session = GetSession(name);
    EXPECT_TRUE(session.revision() == 0 || session.counts().cells() == mesh.NumLive(EntityKind::kCell));
  }
}

TEST_F(ImportEndTest, AConnectionThatDropsNeverLeavesAPartOfAMesh) {
  for (int i = 0; i < 20; ++i) {
    const auto stub = v1::SessionService::NewStub(NewChannel());
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::milliseconds(5 + i));
    const auto stream = stub->ImportMesh(&context);
    stream->Write(ImportHead("mesh"));
    while (stream->Write(ImportPositions(SomePoints(50)))) {
    }
    EXPECT_FALSE(stream->Finish().ok());
    ExpectStillEmpty("mesh");
  }
}

TEST_F(ImportEndTest, ImportsAtOnceAreLimited) {
  Limits limits;
  limits.max_concurrent_imports = 1;
  StartServer(limits);
  ASSERT_TRUE(CreateSession("mesh").ok());
  PatientContext context;
  const auto stream = sessions().ImportMesh(&context);
  stream->Write(ImportHead("mesh"));
  stream->Write(ImportPositions(SomePoints(100'000)));
  v1::ImportMeshResponse response;
  ASSERT_TRUE(stream->Read(&response));  // it has been let in
  ExpectError(ImportRequests({ImportHead("mesh")}), grpc::RESOURCE_EXHAUSTED, reason::kLimitExceeded, "limit",
              "max_concurrent_imports");
  stream->WritesDone();
  while (stream->Read(&response)) {
  }
  ASSERT_TRUE(stream->Finish().ok());
  ASSERT_TRUE(CreateSession("next").ok());
  EXPECT_TRUE(ImportRequests({ImportHead("next")}).ok());
}

TEST_F(ImportEndTest, IdleImportsMakeRoomForOthers) {
  Limits limits;
  limits.max_concurrent_imports = 2;
  limits.import_idle_timeout = absl::Milliseconds(300);
  StartServer(limits);
  for (const char* name : {"mesh", "idle", "silent"}) ASSERT_TRUE(CreateSession(name).ok());
  PatientContext idle_context, silent_context;
  const auto idle = sessions().ImportMesh(&idle_context);
  idle->Write(ImportHead("idle"));
  idle->Write(ImportPositions(SomePoints(100'000)));
  const auto silent = sessions().ImportMesh(&silent_context);
  silent->Write(ImportHead("silent"));
  v1::ImportMeshResponse response;
  while (idle->Read(&response)) EXPECT_EQ(response.progress().revision(), 0);
  ExpectError(idle->Finish(), grpc::DEADLINE_EXCEEDED, reason::kImportIdle, "limit", "import_idle_timeout");
  while (silent->Read(&response)) {
  }
  ExpectError(silent->Finish(), grpc::DEADLINE_EXCEEDED, reason::kImportIdle);
  EXPECT_TRUE(Import("mesh", TetGrid(3, 3, 3)).ok());
  EXPECT_TRUE(Import("idle", TetGrid(2, 2, 2)).ok());
}

TEST_F(ImportEndTest, AnImportMaySendWithPausesShorterThanTheTimeout) {
  Limits limits;
  limits.import_idle_timeout = absl::Milliseconds(400);
  StartServer(limits);
  ASSERT_TRUE(CreateSession("mesh").ok());
  PatientContext context;
  const auto stream = sessions().ImportMesh(&context);
  stream->Write(ImportHead("mesh"));
  const absl::Time end = absl::Now() + absl::Seconds(1);
  while (absl::Now() < end) {
    ASSERT_TRUE(stream->Write(ImportPositions(SomePoints(4))));
    GetSession("mesh");  // some of the time passes
  }
  stream->WritesDone();
  v1::ImportMeshResponse response;
  while (stream->Read(&response)) {
  }
  EXPECT_TRUE(stream->Finish().ok());
}

TEST_F(ImportEndTest, StagedBytesAreBoundedOverAllImports) {
  Limits limits;
  limits.max_staged_bytes = 3'000'000;
  StartServer(limits);
  for (const char* name : {"mesh", "other"}) ASSERT_TRUE(CreateSession(name).ok());
  PatientContext context;
  const auto stream = sessions().ImportMesh(&context);
  stream->Write(ImportHead("other"));
  stream->Write(ImportPositions(SomePoints(100'000)));
  v1::ImportMeshResponse response;
  while (response.progress().done() < 100'000) ASSERT_TRUE(stream->Read(&response));
  const std::vector<v1::ImportMeshRequest> second = {ImportHead("mesh"), ImportPositions(SomePoints(40'000))};
  ExpectError(ImportRequests(second), grpc::RESOURCE_EXHAUSTED, reason::kLimitExceeded, "limit",
              "max_staged_bytes");
  stream->WritesDone();
  while (stream->Read(&response)) {
  }
  EXPECT_TRUE(stream->Finish().ok());
  EXPECT_TRUE(ImportRequests(second).ok());
}

TEST_F(ImportEndTest, LargeMessagesAreRefusedByName) {
  Limits limits;
  limits.max_message_bytes = 10'000;
  StartServer(limits);
  ASSERT_TRUE(CreateSession("mesh").ok());
  ExpectError(ImportRequests({ImportHead("mesh"), ImportPositions(SomePoints(1000))}),
              grpc::RESOURCE_EXHAUSTED, reason::kLimitExceeded, "limit", "max_message_bytes");
  ExpectStillEmpty("mesh");
}

}  // namespace
}  // namespace dynmesh::testing
