// Starting, health, deadlines, draining.

#include <grpcpp/create_channel.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/security/credentials.h>
#include <unistd.h>

#include <thread>

#include "absl/strings/match.h"
#include "server/health_probe.h"
#include "tests/server/server_support.h"
#include "tests/support/meshes.h"

namespace dynmesh::testing {
namespace {

class LifecycleTest : public ServerTest {};

TEST_F(LifecycleTest, HealthIsServingUntilTheServerDrains) {
  EXPECT_TRUE(ProbeHealth(address(), kPatience).ok());
  const std::string target = address();
  server().Drain(absl::ZeroDuration());
  EXPECT_EQ(ProbeHealth(target, absl::Seconds(2)).code(), absl::StatusCode::kUnavailable);
}

TEST_F(LifecycleTest, OnlyLoopbackIsServedWithoutBeingAsked) {
  for (const char* address : {"127.0.0.1:1", "127.8.9.10:1", "[::1]:1", "localhost:1"}) {
    EXPECT_TRUE(CheckLoopback(address).ok()) << address;
  }
  for (const char* address :
       {"0.0.0.0:1", "10.0.0.1:1", "[::]:1", "127.evil.example:1", "example.com:1", "1.127.0.0:1"}) {
    const absl::Status status = CheckLoopback(address);
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << address;
    EXPECT_TRUE(absl::StrContains(status.message(), "--allow_insecure")) << status;
  }
  for (const char* address :
       {"", "localhost", ":1", "localhost:", "localhost:http", "localhost:-1", "localhost:65536"}) {
    EXPECT_TRUE(absl::StrContains(CheckLoopback(address).message(), "host:port")) << address;
  }
  ServerOptions options;
  options.listen = {"0.0.0.0:0"};
  EXPECT_FALSE(Server::Start(options).ok());
  options.allow_insecure = true;
  EXPECT_TRUE(Server::Start(options).ok());
}

TEST_F(LifecycleTest, APortThatIsTakenIsRefused) {
  ServerOptions options;
  options.listen = {address()};
  const auto second = Server::Start(options);
  EXPECT_EQ(second.status().code(), absl::StatusCode::kUnavailable);
  options.listen.clear();
  EXPECT_FALSE(Server::Start(options).ok());
}

TEST_F(LifecycleTest, AUnixSocketServesAndBelongsToOneDaemon) {
  const std::string path = ::testing::TempDir() + "dynmesh-" + std::to_string(getpid()) + ".sock";
  ServerOptions options;
  options.listen.clear();
  options.unix_socket = path;
  auto server = Server::Start(options);
  ASSERT_TRUE(server.ok()) << server.status();
  EXPECT_EQ((*server)->addresses(), std::vector<std::string>{"unix:" + path});
  EXPECT_TRUE(ProbeHealth("unix:" + path, kPatience).ok());
  EXPECT_EQ(Server::Start(options).status().code(), absl::StatusCode::kUnavailable);
  EXPECT_TRUE(ProbeHealth("unix:" + path, kPatience).ok());
  *server = nullptr;
  EXPECT_TRUE(Server::Start(options).ok());
}

TEST_F(LifecycleTest, ReflectionListsTheServices) {
  // The request "list_services" of grpc.reflection.v1alpha, field 7, by hand.
  grpc::GenericStub stub(NewChannel());
  PatientContext context;
  const grpc::Slice bytes(std::string("\x3a\x01*"));
  const grpc::ByteBuffer request(&bytes, 1);
  grpc::CompletionQueue queue;
  const auto call =
      stub.PrepareCall(&context, "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo", &queue);
  void* tag;
  bool ok = false;
  const auto next = [&] { return queue.Next(&tag, &ok) && ok; };
  call->StartCall(nullptr);
  ASSERT_TRUE(next());
  call->Write(request, nullptr);
  ASSERT_TRUE(next());
  grpc::ByteBuffer response;
  call->Read(&response, nullptr);
  ASSERT_TRUE(next());
  std::vector<grpc::Slice> slices;
  ASSERT_TRUE(response.Dump(&slices).ok());
  std::string text;
  for (const grpc::Slice& slice : slices)
    text.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
  for (const char* service :
       {"dynmesh.v1.SessionService", "dynmesh.v1.EditService", "dynmesh.v1.QueryService",
        "dynmesh.v1.SubscriptionService", "grpc.health.v1.Health"}) {
    EXPECT_TRUE(absl::StrContains(text, service)) << service;
  }
  context.TryCancel();
  grpc::Status status;
  call->Finish(&status, nullptr);
  next();
}

TEST_F(LifecycleTest, ADeadlineThatPassesLeavesTheServerSound) {
  ASSERT_TRUE(CreateSession("mesh").ok());
  for (int i = 0; i < 50; ++i) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::microseconds(50 * i));
    v1::ApplyEditsResponse response;
    const grpc::Status status = edits().ApplyEdits(&context, TetBatch("mesh"), &response);
    EXPECT_TRUE(status.ok() || status.error_code() == grpc::DEADLINE_EXCEEDED) << status.error_message();
  }
  const int64_t revision = MustApply(TetBatch("mesh")).revision();
  EXPECT_EQ(GetSession("mesh").counts().cells(), static_cast<uint64_t>(revision));
}

/// A stream that is open while the server drains.
TEST_F(LifecycleTest, DrainEndsIdleStreamsWithTheReasonAndAtOnce) {
  ASSERT_TRUE(CreateSession("mesh").ok());
  PatientContext follow_context, edit_context;
  v1::SubscribeRequest follow;
  follow.set_session("mesh");
  const auto following = subscriptions().Subscribe(&follow_context, follow);
  v1::SubscribeResponse delta;
  ASSERT_TRUE(following->Read(&delta));
  const auto editing = edits().StreamEdits(&edit_context);
  v1::StreamEditsRequest batch;
  *batch.mutable_batch() = TetBatch("mesh");
  v1::StreamEditsResponse answer;
  ASSERT_TRUE(editing->Write(batch));
  ASSERT_TRUE(editing->Read(&answer));
  const absl::Time begin = absl::Now();
  std::thread drain([&] { server().Drain(absl::Seconds(30)); });
  while (following->Read(&delta)) {
  }
  ExpectError(following->Finish(), grpc::UNAVAILABLE, reason::kShuttingDown);
  EXPECT_FALSE(editing->Read(&answer));
  ExpectError(editing->Finish(), grpc::UNAVAILABLE, reason::kShuttingDown);
  drain.join();
  EXPECT_LT(absl::Now() - begin, absl::Seconds(20));
}

TEST_F(LifecycleTest, DrainLetsCallsUnderWayFinish) {
  ASSERT_TRUE(CreateSession("mesh").ok());
  const Mesh mesh = TetGrid(30, 30, 30);
  std::atomic<bool> building{false};
  v1::ImportResult result;
  grpc::Status status;
  std::thread import([&] {
    PatientContext context;
    const auto stream = sessions().ImportMesh(&context);
    stream->Write(ImportHead("mesh"));
    std::vector<Point> points;
    std::vector<Slot> ids;
    mesh.slots(EntityKind::kVertex).live().ForEach([&](Slot s) {
      points.push_back(mesh.Position(VertexId(s)));
    });
    mesh.slots(EntityKind::kCell).live().ForEach([&](Slot s) {
      for (VertexId v : mesh.Vertices(CellId(s))) ids.push_back(v.slot());
    });
    stream->Write(ImportPositions(points));
    stream->Write(ImportElements(v1::ELEMENT_TYPE_TETRAHEDRON, ids));
    stream->WritesDone();
    v1::ImportMeshResponse response;
    while (stream->Read(&response)) {
      if (response.has_progress() && response.progress().phase() == "building") building = true;
      if (response.has_result()) result = response.result();
    }
    status = stream->Finish();
    building = true;
  });
  while (!building) std::this_thread::yield();
  server().Drain(absl::Seconds(50));
  import.join();
  EXPECT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(result.session().counts().cells(), mesh.NumLive(EntityKind::kCell));
}

TEST_F(LifecycleTest, DrainCancelsWhatDoesNotEnd) {
  ASSERT_TRUE(CreateSession("mesh").ok());
  PatientContext context;
  const auto stream = sessions().ImportMesh(&context);
  stream->Write(ImportHead("mesh"));
  stream->Write(ImportPositions(SomePoints(100'000)));
  v1::ImportMeshResponse response;
  ASSERT_TRUE(stream->Read(&response));  // it is under way, and never half-closed
  const absl::Time begin = absl::Now();
  server().Drain(absl::Milliseconds(200));
  EXPECT_LT(absl::Now() - begin, absl::Seconds(30));
  while (stream->Read(&response)) {
  }
  EXPECT_FALSE(stream->Finish().ok());
}

TEST_F(LifecycleTest, AStuckReaderDoesNotHoldTheDrain) {
  ASSERT_TRUE(CreateSession("mesh").ok());
  PatientContext context;
  v1::SubscribeRequest request;
  request.set_session("mesh");
  request.set_codec(v1::DELTA_CODEC_RAW);
  const auto stream = subscriptions().Subscribe(&context, request);
  v1::SubscribeResponse delta;
  ASSERT_TRUE(stream->Read(&delta));
  for (int i = 0; i < 8; ++i) {
    v1::ApplyEditsRequest many = Batch("mesh");
    *many.add_edits()->mutable_add_vertices() = AddVerticesMessage(SomePoints(40'000));
    MustApply(many);
  }
  const absl::Time begin = absl::Now();
  server().Drain(absl::Milliseconds(300));
  EXPECT_LT(absl::Now() - begin, absl::Seconds(30));
}

TEST_F(LifecycleTest, ADestroyedServerLeavesNothingBehind) {
  for (int i = 0; i < 5; ++i) {
    StartServer({});
    ASSERT_TRUE(CreateSession("mesh").ok());
    auto context = std::make_unique<PatientContext>();
    v1::SubscribeRequest request;
    request.set_session("mesh");
    const auto stream = subscriptions().Subscribe(context.get(), request);
    v1::SubscribeResponse delta;
    ASSERT_TRUE(stream->Read(&delta));
    MustApply(TetBatch("mesh"));
    StartServer({});  // destroys the one before, with its stream open
    while (stream->Read(&delta)) {
    }
    EXPECT_FALSE(stream->Finish().ok());
  }
}

}  // namespace
}  // namespace dynmesh::testing
