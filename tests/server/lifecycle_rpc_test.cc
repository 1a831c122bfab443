// Starting, health, deadlines, draining.

#include <grpcpp/create_channel.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/security/credentials.h>
#include <unistd.h>

#include <atomic>
#include <semaphore>
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
        "dynmesh.v1.CheckService", "dynmesh.v1.RepairService", "dynmesh.v1.AdaptService",
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

/// A session "book" whose hub edge has 50,000 faces, and the slot of that edge. Its queries have all the
/// steps that they want.
class BusyTest : public LifecycleTest {
 protected:
  BusyTest() {
    Limits limits;
    limits.max_query_steps = uint64_t{1} << 62;
    StartServer(limits);
    EXPECT_TRUE(CreateSession("book").ok());
    EXPECT_TRUE(CreateSession("other").ok());
    MustApply(BookBatch("book", 50'000));
    const SessionPtr book = *server().registry().Find("book");
    EXPECT_TRUE(book->Read([this](const SessionView& view) {
                      hub_ = view.mesh.FindEdge(VertexId(0), VertexId(1)).slot();
                      return absl::OkStatus();
                    })
                    .ok());
  }

  /// Asks for what takes hours and is not waited for.
  grpc::Status AskForHours(absl::Duration deadline, int rows = 1'000'000) {
    grpc::ClientContext context;
    context.set_deadline(absl::ToChronoTime(absl::Now() + deadline));
    const auto stream = queries().GetNeighbors(&context, CellsOfEdges("book", hub_, rows));
    v1::GetNeighborsResponse response;
    while (stream->Read(&response)) {
    }
    return stream->Finish();
  }

  Slot hub_ = kNoSlot;
};

TEST_F(BusyTest, ACallThatNobodyWaitsForEnds) {
  // As many as there are threads of both kinds, and more.
  std::vector<std::thread> callers;
  for (int i = 0; i < 24; ++i) {
    callers.emplace_back([&, i] {
      EXPECT_EQ(AskForHours(absl::Milliseconds(300), i % 2 == 0 ? 1'000'000 : 19'000).error_code(),
                grpc::DEADLINE_EXCEEDED);
    });
  }
  for (std::thread& caller : callers) caller.join();
  MustApply(TetBatch("other"));
  MustApply(TetBatch("book"));  // a writer: the readers must be gone
  EXPECT_EQ(GetSession("book").revision(), 2);
}

TEST_F(BusyTest, DrainEndsWhatComputes) {
  std::vector<std::thread> callers;
  for (int i = 0; i < 4; ++i) {
    callers.emplace_back(
        [&, i] { EXPECT_FALSE(AskForHours(kPatience, i % 2 == 0 ? 1'000'000 : 19'000).ok()); });
  }
  MustApply(TetBatch("other"));  // a round trip or two, in which they get there
  const absl::Time begin = absl::Now();
  server().Drain(absl::Milliseconds(200));
  EXPECT_LT(absl::Now() - begin, absl::Seconds(20));
  for (std::thread& caller : callers) caller.join();
}

TEST_F(BusyTest, ALockedSessionKeepsNoThreadFromOthers) {
  std::binary_semaphore holds{0}, enough{0};
  std::thread reader([&] {
    const SessionPtr book = *server().registry().Find("book");
    EXPECT_TRUE(book->Read([&](const SessionView&) {
                      holds.release();
                      enough.acquire();
                      return absl::OkStatus();
                    })
                    .ok());
  });
  holds.acquire();
  constexpr int kCalls = 100;
  const v1::ApplyEditsRequest batch = TetBatch("book");
  v1::GetSessionRequest get;
  get.set_name("book");
  std::vector<PatientContext> contexts(2 * kCalls);
  std::vector<v1::ApplyEditsResponse> applied(kCalls);
  std::vector<v1::GetSessionResponse> got(kCalls);
  std::atomic<int> edited{0}, read{0}, failures{0};
  const auto count_in = [&](std::atomic<int>& answers) {
    return [&failures, &answers](const grpc::Status& status) {
      if (!status.ok()) ++failures;
      ++answers;
    };
  };
  for (int i = 0; i < kCalls; ++i) {
    edits().async()->ApplyEdits(&contexts[2 * i], &batch, &applied[i], count_in(edited));
    // Waits, too, unless it overtakes the first edit.
    sessions().async()->GetSession(&contexts[2 * i + 1], &get, &got[i], count_in(read));
  }
  for (int i = 0; i < 50; ++i) {
    MustApply(TetBatch("other"));
    EXPECT_EQ(GetSession("other").revision(), i + 1);
  }
  EXPECT_EQ(edited, 0);
  enough.release();
  reader.join();
  const absl::Time deadline = absl::Now() + kPatience;
  while (edited + read < 2 * kCalls && absl::Now() < deadline) std::this_thread::yield();
  EXPECT_EQ(edited, kCalls);
  EXPECT_EQ(read, kCalls);
  EXPECT_EQ(failures, 0);
  EXPECT_EQ(GetSession("book").revision(), 1 + kCalls);
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
