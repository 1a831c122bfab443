#include <random>
#include <thread>

#include "core/codec/codec.h"
#include "core/delta/mirror.h"
#include "tests/server/server_support.h"
#include "tests/support/meshes.h"
#include "tests/support/oracle.h"

namespace dynmesh::testing {
namespace {

v1::SubscribeRequest From(int64_t revision, v1::DeltaCodec codec = v1::DELTA_CODEC_UNSPECIFIED) {
  v1::SubscribeRequest request;
  request.set_session("mesh");
  request.set_from_revision(revision);
  request.set_codec(codec);
  return request;
}

/// A client that follows into a mirror.
class Subscriber {
 public:
  Subscriber(v1::SubscriptionService::Stub& stub, const v1::SubscribeRequest& request,
             Mirror mirror = Mirror())
      : mirror_(std::move(mirror)), stream_(stub.Subscribe(&context_, request)) {}
  ~Subscriber() {
    context_.TryCancel();
    if (!finished_) Finish();
  }

  /// Reads one message and applies it; false at the end.
  bool ReadOne() {
    if (!stream_->Read(&last_)) return false;
    const auto delta = DecodeDelta(last_.delta());
    EXPECT_TRUE(delta.ok()) << delta.status();
    if (!delta.ok()) return false;
    EXPECT_EQ(delta->to_revision, last_.revision());
    EXPECT_EQ(delta->from_revision, last_.from_revision());
    EXPECT_EQ(delta->consistent, last_.consistent());
    EXPECT_GT(last_.commit_time_us(), 1'700'000'000'000'000);
    const absl::Status applied = mirror_.Apply(*delta);
    EXPECT_TRUE(applied.ok()) << applied;
    ++messages_;
    return true;
  }

  /// Reads until the mirror has a consistent copy of `revision`.
  void ReadTo(int64_t revision) {
    do {
      if (!ReadOne()) FAIL() << "the stream ended: " << Finish().error_message();
    } while (!last_.consistent() || mirror_.revision() < revision);
  }

  grpc::Status Finish() {
    finished_ = true;
    return stream_->Finish();
  }

  void Cancel() { context_.TryCancel(); }
  const Mirror& mirror() const { return mirror_; }
  const v1::SubscribeResponse& last() const { return last_; }
  int messages() const { return messages_; }

 private:
  PatientContext context_;
  Mirror mirror_;
  std::unique_ptr<grpc::ClientReader<v1::SubscribeResponse>> stream_;
  v1::SubscribeResponse last_;
  int messages_ = 0;
  bool finished_ = false;
};

class SubscribeRpcTest : public ServerTest {
 protected:
  SubscribeRpcTest() { EXPECT_TRUE(CreateSession("mesh").ok()); }

  void ExpectEqual(const Mirror& mirror) {
    const v1::Session session = GetSession("mesh");
    EXPECT_EQ(mirror.revision(), session.revision());
    EXPECT_EQ(mirror.checksum().topology, session.checksum().topology());
    EXPECT_EQ(mirror.checksum().geometry, session.checksum().geometry());
    EXPECT_EQ(mirror.num_vertices(), session.counts().vertices());
    EXPECT_EQ(mirror.num_elements(EntityKind::kCell), session.counts().cells());
  }

  /// Removes, moves and adds at random; returns the revision.
  int64_t EditAtRandom(std::mt19937& rng, const Mirror& mirror) {
    v1::ApplyEditsRequest request = TetBatch("mesh");
    std::vector<Slot> cells;
    for (Slot slot = 0; slot < mirror.SlotLimit(EntityKind::kCell); ++slot) {
      if (mirror.TypeAt(EntityKind::kCell, slot) != ElementType::kUnspecified && rng() % 20 == 0)
        cells.push_back(slot);
    }
    request.add_edits()->mutable_remove_elements()->set_kind(v1::ENTITY_KIND_CELL);
    request.mutable_edits(2)->mutable_remove_elements()->set_ids(Bytes(cells));
    v1::MoveVertices* move = request.add_edits()->mutable_move_vertices();
    move->set_ids(Bytes<Slot>({Slot(rng() % 8)}));
    move->set_positions(Bytes<Point>({{rng() * 1e-9, rng() * 1e-9, 1}}));
    return MustApply(request).revision();
  }
};

TEST_F(SubscribeRpcTest, AFollowerStaysEqualWithEachCodec) {
  const uint32_t seed = 31;
  SCOPED_TRACE(seed);
  std::mt19937 rng(seed);
  ASSERT_TRUE(Import("mesh", TetGrid(3, 3, 3)).ok());
  int64_t revision = 1;
  for (v1::DeltaCodec codec :
       {v1::DELTA_CODEC_UNSPECIFIED, v1::DELTA_CODEC_RAW, v1::DELTA_CODEC_ZSTD, v1::DELTA_CODEC_DRACO}) {
    Subscriber subscriber(subscriptions(), From(0, codec));
    subscriber.ReadTo(revision);
    ExpectEqual(subscriber.mirror());
    for (int i = 0; i < 30; ++i) {
      revision = EditAtRandom(rng, subscriber.mirror());
      subscriber.ReadTo(revision);
      EXPECT_EQ(subscriber.last().revision(), revision);
    }
    ExpectEqual(subscriber.mirror());
    EXPECT_GT(subscriber.last().raw_topology_bytes(), 0u);
    EXPECT_GT(subscriber.last().topology_bytes(), 0u);
  }
}

TEST_F(SubscribeRpcTest, TheFirstDeltaComesEvenWhenItIsEmpty) {
  Subscriber fresh(subscriptions(), From(0));
  ASSERT_TRUE(fresh.ReadOne());
  EXPECT_TRUE(fresh.last().consistent());
  EXPECT_EQ(fresh.last().revision(), 0);
  MustApply(TetBatch("mesh"));
  PatientContext context;
  const auto stream = subscriptions().Subscribe(&context, From(1));
  v1::SubscribeResponse response;
  ASSERT_TRUE(stream->Read(&response));
  EXPECT_EQ(response.revision(), 1);
  EXPECT_EQ(response.from_revision(), 1);
  context.TryCancel();
  EXPECT_EQ(stream->Finish().error_code(), grpc::CANCELLED);
}

TEST_F(SubscribeRpcTest, ResumesFromTheLastConsistentRevision) {
  std::mt19937 rng(8);
  ASSERT_TRUE(Import("mesh", TetGrid(2, 2, 2)).ok());
  Mirror mirror;
  int64_t revision = 1;
  for (int round = 0; round < 10; ++round) {
    {
      Subscriber subscriber(subscriptions(), From(mirror.revision()), mirror);
      subscriber.ReadTo(revision);
      mirror = subscriber.mirror();
    }
    ExpectEqual(mirror);
    for (int i = 0; i < 5; ++i) revision = EditAtRandom(rng, Mirror());
  }
}

TEST_F(SubscribeRpcTest, ALargeSnapshotComesInMessagesBelowTheLimit) {
  const Mesh mesh = TetGrid(22, 22, 22);
  ASSERT_TRUE(Import("mesh", mesh, nullptr, 50'000).ok());
  Subscriber subscriber(subscriptions(), From(0, v1::DELTA_CODEC_RAW));
  do {
    ASSERT_TRUE(subscriber.ReadOne());
    EXPECT_LT(subscriber.last().ByteSizeLong(), size_t{4} << 20);
  } while (!subscriber.last().consistent());
  EXPECT_GT(subscriber.messages(), 1);
  ExpectEqual(subscriber.mirror());
  EXPECT_TRUE(ModelOf(subscriber.mirror()) == ModelOf(mesh));
}

TEST_F(SubscribeRpcTest, QuantisedFollowersProveTheirTopology) {
  ASSERT_TRUE(Import("mesh", TetGrid(3, 3, 3)).ok());
  v1::SubscribeRequest request = From(0);
  request.set_position_bits(10);
  Subscriber subscriber(subscriptions(), request, Mirror(Mirror::Geometry::kQuantized));
  subscriber.ReadTo(1);
  EXPECT_EQ(PeekDelta(subscriber.last().delta())->position_bits, 10);
  for (int i = 0; i < 10; ++i) subscriber.ReadTo(MustApply(TetBatch("mesh")).revision());
}

TEST_F(SubscribeRpcTest, FollowersShareOneEncoding) {
  constexpr int kFollowers = 16, kRounds = 20;
  std::vector<std::unique_ptr<Subscriber>> followers;
  for (int i = 0; i < kFollowers; ++i) {
    followers.push_back(std::make_unique<Subscriber>(subscriptions(), From(0)));
    followers.back()->ReadTo(0);
  }
  const SessionPtr session = *server().registry().Find("mesh");
  const uint64_t before = session->deltas().num_encodings();
  for (int round = 0; round < kRounds; ++round) {
    const int64_t revision = MustApply(TetBatch("mesh")).revision();
    for (auto& follower : followers) follower->ReadTo(revision);
  }
  EXPECT_EQ(session->deltas().num_encodings() - before, uint64_t{kRounds});
  for (auto& follower : followers) ExpectEqual(follower->mirror());
  EXPECT_EQ(GetSession("mesh").followers(), uint32_t{kFollowers});
}

TEST_F(SubscribeRpcTest, ASlowReaderGetsFewerDeltasAndIsNeverDropped) {
  // Enough changed bytes that flow control holds the stream, whatever its window.
  Subscriber slow(subscriptions(), From(0, v1::DELTA_CODEC_RAW));
  ASSERT_TRUE(slow.ReadOne());
  int64_t revision = 0;
  v1::ApplyEditsRequest many = Batch("mesh");
  *many.add_edits()->mutable_add_vertices() = AddVerticesMessage(SomePoints(40'000));
  revision = MustApply(many).revision();
  std::vector<Slot> ids(40'000);
  for (Slot slot = 0; slot < ids.size(); ++slot) ids[slot] = slot;
  for (int i = 0; i < 60; ++i) {
    v1::ApplyEditsRequest request = Batch("mesh");
    v1::MoveVertices* move = request.add_edits()->mutable_move_vertices();
    move->set_ids(Bytes(ids));
    auto points = SomePoints(40'000);
    points[0][0] = i;
    move->set_positions(Bytes(points));
    revision = MustApply(request).revision();
  }
  slow.ReadTo(revision);
  ExpectEqual(slow.mirror());
  EXPECT_LT(slow.messages(), 45);
  std::cout << "revisions " << revision << " messages " << slow.messages() << "\n";
}

TEST_F(SubscribeRpcTest, MinIntervalIsHonoured) {
  v1::SubscribeRequest request = From(0);
  request.set_min_interval_ms(100);
  Subscriber subscriber(subscriptions(), request);
  ASSERT_TRUE(subscriber.ReadOne());
  const absl::Time begin = absl::Now();
  int64_t revision = 0;
  for (int i = 0; i < 20; ++i) revision = MustApply(TetBatch("mesh")).revision();
  subscriber.ReadTo(revision);
  EXPECT_LE(subscriber.messages(), 2 + (absl::Now() - begin) / absl::Milliseconds(100));
  ExpectEqual(subscriber.mirror());
}

TEST_F(SubscribeRpcTest, DeletionEndsTheStream) {
  Subscriber subscriber(subscriptions(), From(0));
  ASSERT_TRUE(subscriber.ReadOne());
  ASSERT_TRUE(DeleteSession("mesh").ok());
  EXPECT_FALSE(subscriber.ReadOne());
  ExpectError(subscriber.Finish(), grpc::NOT_FOUND, reason::kSessionDeleted, "session", "mesh");
}

TEST_F(SubscribeRpcTest, ANamesakeIsNotResumed) {
  MustApply(TetBatch("mesh"));
  Subscriber first(subscriptions(), From(0));
  first.ReadTo(1);
  const std::string uid = first.last().session_uid();
  EXPECT_FALSE(uid.empty());
  EXPECT_EQ(GetSession("mesh").uid(), uid);
  v1::SubscribeRequest resume = From(1);
  resume.set_session_uid(uid);
  {
    PatientContext context;
    const auto again = subscriptions().Subscribe(&context, resume);
    v1::SubscribeResponse nothing_new;
    ASSERT_TRUE(again->Read(&nothing_new));
    EXPECT_EQ(nothing_new.session_uid(), uid);
    context.TryCancel();
  }
  ASSERT_TRUE(DeleteSession("mesh").ok());
  ASSERT_TRUE(CreateSession("mesh").ok());
  EXPECT_NE(GetSession("mesh").uid(), uid);
  for (int i = 0; i < 3; ++i) {  // also where the revision would lie in the future
    Subscriber refused(subscriptions(), resume);
    EXPECT_FALSE(refused.ReadOne());
    ExpectError(refused.Finish(), grpc::ABORTED, reason::kSessionRecreated, "expected", uid);
    MustApply(TetBatch("mesh"));
  }
}

TEST_F(SubscribeRpcTest, OddRequestsAreRefused) {
  MustApply(TetBatch("mesh"));
  const auto expect = [&](const v1::SubscribeRequest& request, grpc::StatusCode code, const char* why,
                          const char* key, const char* value) {
    Subscriber subscriber(subscriptions(), request);
    EXPECT_FALSE(subscriber.ReadOne());
    ExpectError(subscriber.Finish(), code, why, key, value);
  };
  constexpr auto kInvalid = grpc::INVALID_ARGUMENT;
  expect(From(2), grpc::OUT_OF_RANGE, reason::kRevisionInFuture, "actual", "1");
  expect(From(-1), kInvalid, reason::kBadArgument, "field", "from_revision");
  expect(From(0, static_cast<v1::DeltaCodec>(4)), kInvalid, reason::kBadArgument, "field", "codec");
  v1::SubscribeRequest request = From(0);
  request.set_position_bits(31);
  expect(request, kInvalid, reason::kBadArgument, "field", "position_bits");
  request = From(0);
  request.set_min_interval_ms(3'600'001);
  expect(request, kInvalid, reason::kBadArgument, "field", "min_interval_ms");
  request.set_min_interval_ms(INT64_MIN);
  expect(request, kInvalid, reason::kBadArgument, "field", "min_interval_ms");
  request = From(0);
  request.set_session("nobody");
  expect(request, grpc::NOT_FOUND, reason::kSessionNotFound, "session", "nobody");
  request.set_session("");
  expect(request, kInvalid, reason::kBadSessionName, "field", "name");
  EXPECT_EQ(GetSession("mesh").followers(), 0u);
}

TEST_F(SubscribeRpcTest, FollowersAreLimited) {
  Limits limits;
  limits.max_followers = 2;
  StartServer(limits);
  ASSERT_TRUE(CreateSession("mesh").ok());
  Subscriber first(subscriptions(), From(0)), second(subscriptions(), From(0));
  ASSERT_TRUE(first.ReadOne() && second.ReadOne());
  Subscriber third(subscriptions(), From(0));
  EXPECT_FALSE(third.ReadOne());
  ExpectError(third.Finish(), grpc::RESOURCE_EXHAUSTED, reason::kLimitExceeded, "limit", "max_followers");
}

TEST_F(SubscribeRpcTest, CancelledStreamsAreForgotten) {
  ASSERT_TRUE(Import("mesh", TetGrid(10, 10, 10)).ok());
  const SessionPtr session = *server().registry().Find("mesh");
  for (int i = 0; i < 40; ++i) {
    Subscriber subscriber(subscriptions(), From(0));
    if (i % 3 > 0) subscriber.ReadOne();
    if (i % 3 > 1) MustApply(TetBatch("mesh"));
    subscriber.Cancel();
    EXPECT_EQ(subscriber.Finish().error_code(), grpc::CANCELLED);
  }
  const absl::Time deadline = absl::Now() + kPatience;
  while (session->followers().size() > 0 && absl::Now() < deadline) std::this_thread::yield();
  EXPECT_EQ(session->followers().size(), 0u);
}

TEST_F(SubscribeRpcTest, ADeadlineEndsTheStream) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::milliseconds(50));
  const auto stream = subscriptions().Subscribe(&context, From(0));
  v1::SubscribeResponse response;
  while (stream->Read(&response)) {
  }
  EXPECT_EQ(stream->Finish().error_code(), grpc::DEADLINE_EXCEEDED);
}

TEST_F(SubscribeRpcTest, EditorsReadersAndFollowersAtOnce) {
  ASSERT_TRUE(Import("mesh", TetGrid(4, 4, 4)).ok());
  constexpr int kEditors = 3, kBatches = 40;
  std::vector<std::thread> threads;
  for (int i = 0; i < kEditors; ++i) {
    threads.emplace_back([&, i] {
      std::mt19937 rng(i);
      for (int batch = 0; batch < kBatches; ++batch) EditAtRandom(rng, Mirror());
    });
  }
  for (int i = 0; i < 3; ++i) {
    threads.emplace_back([&, i] {
      const auto stub = v1::SubscriptionService::NewStub(NewChannel());
      Subscriber subscriber(*stub, From(0, static_cast<v1::DeltaCodec>(i)));
      subscriber.ReadTo(1 + kEditors * kBatches);
      ExpectEqual(subscriber.mirror());
    });
  }
  for (std::thread& thread : threads) thread.join();
}

}  // namespace
}  // namespace dynmesh::testing
