#include "server/session/follower.h"

#include <cmath>

#include "absl/time/clock.h"
#include "tests/session/session_support.h"
#include "tests/support/meshes.h"
#include "tests/support/oracle.h"
#include "tests/support/rows.h"

namespace dynmesh::testing {
namespace {

using Acknowledge = RecordingSink::Acknowledge;

void ExpectEqual(RecordingSink& sink, Session& session) {
  EXPECT_TRUE(sink.error().ok()) << sink.error();
  sink.WithMirror([&](const Mirror& mirror) {
    EXPECT_TRUE(session
                    .Read([&](const SessionView& view) {
                      EXPECT_EQ(mirror.revision(), view.mesh.revision());
                      EXPECT_EQ(mirror.checksum(), view.mesh.checksum());
                      EXPECT_TRUE(ModelOf(mirror) == ModelOf(view.mesh));
                      ExpectSameRows(mirror.attributes(), view.mesh);
                      return absl::OkStatus();
                    })
                    .ok());
  });
}

/// Applies `count` random batches.
void EditAtRandom(Session& session, RandomBatches& batches, int count) {
  for (int i = 0; i < count; ++i) {
    const auto result = session.Apply(batches.Next(), {.as_of_revision = session.revision()});
    result.ok() ? batches.Applied(**result) : batches.Refused();
  }
}

class FollowerTest : public ::testing::Test {
 protected:
  Daemon daemon_;
};

TEST_F(FollowerTest, AnEmptySessionIsToldAtOnce) {
  const SessionPtr session = daemon_.NewSession();
  RecordingSink sink(daemon_.workers(), Acknowledge::kByHand);
  ASSERT_TRUE(sink.Follow(session, {}).ok());
  const PayloadPtr first = sink.TakeOne();
  EXPECT_TRUE(first->consistent);
  EXPECT_EQ(first->revision, 0);
  EXPECT_EQ(session->Info()->followers, 1u);
}

TEST_F(FollowerTest, AFollowerThatHasEverythingIsToldSoOnce) {
  const SessionPtr session = daemon_.NewSession();
  MustApply(*session, AddTet());
  RecordingSink sink(daemon_.workers(), Acknowledge::kByHand);
  ASSERT_TRUE(sink.Follow(session, {.from_revision = 1}).ok());
  const PayloadPtr first = sink.TakeOne();
  EXPECT_TRUE(first->consistent);
  EXPECT_EQ(first->from_revision, 1);
  EXPECT_EQ(first->revision, 1);
  EXPECT_TRUE(DecodeDelta(first->delta)->empty());
  MustApply(*session, AddTet());
  const PayloadPtr second = sink.TakeOne();
  EXPECT_EQ(second->from_revision, 1);
  EXPECT_EQ(second->revision, 2);
}

TEST_F(FollowerTest, StaysEqualUnderRandomEditsWithEachCodec) {
  for (Codec codec : {Codec::kUnspecified, Codec::kRaw, Codec::kZstd, Codec::kDraco}) {
    const uint32_t seed = 100 + static_cast<int>(codec);
    SCOPED_TRACE(seed);
    const SessionPtr session = daemon_.NewSession("s" + std::to_string(seed));
    RecordingSink sink(daemon_.workers(), Acknowledge::kAtOnce);
    ASSERT_TRUE(sink.Follow(session, {.codec = codec}).ok());
    RandomBatches batches(seed);
    for (int round = 0; round < 5; ++round) {
      EditAtRandom(*session, batches, 40);
      sink.AwaitRevision(session->revision());
      ExpectEqual(sink, *session);
    }
  }
}

TEST_F(FollowerTest, ResumesFromAnyOldRevision) {
  const uint32_t seed = 55;
  SCOPED_TRACE(seed);
  const SessionPtr session = daemon_.NewSession();
  RandomBatches batches(seed);
  EditAtRandom(*session, batches, 30);
  RecordingSink sink(daemon_.workers(), Acknowledge::kAtOnce);
  ASSERT_TRUE(sink.Follow(session, {}).ok());
  sink.AwaitRevision(session->revision());
  for (int round = 0; round < 5; ++round) {
    sink.follower().End(absl::CancelledError("offline"));
    EXPECT_EQ(sink.AwaitEnd().code(), absl::StatusCode::kCancelled);
    EditAtRandom(*session, batches, 20);
    // A new stream that goes on with the mirror: replayed into a second sink from the old revision.
    RecordingSink resumed(daemon_.workers(), Acknowledge::kByHand);
    ASSERT_TRUE(resumed.Follow(session, {.from_revision = sink.mirror_revision()}).ok());
    const PayloadPtr payload = resumed.TakeOne();
    EXPECT_EQ(payload->from_revision, sink.mirror_revision());
    sink.WithMirror([&](Mirror& mirror) { EXPECT_TRUE(mirror.Apply(*DecodeDelta(payload->delta)).ok()); });
    ExpectEqual(sink, *session);
  }
}

TEST_F(FollowerTest, ASlowReaderGetsFewerLargerDeltas) {
  const SessionPtr session = daemon_.NewSession();
  RecordingSink slow(daemon_.workers(), Acknowledge::kByHand);
  ASSERT_TRUE(slow.Follow(session, {}).ok());
  ASSERT_NE(slow.TakeOne(), nullptr);
  MustApply(*session, AddTet());
  slow.AwaitUnacknowledged();
  RandomBatches batches(5);
  EditAtRandom(*session, batches, 100);
  EXPECT_EQ(slow.TakeOne()->revision, 1);
  EXPECT_EQ(slow.TakeOne()->revision, session->revision());
  EXPECT_GT(session->revision(), 50);
  ExpectEqual(slow, *session);
}

TEST_F(FollowerTest, FollowersAtTheSameRevisionShareOneEncoding) {
  const SessionPtr session = daemon_.NewSession();
  constexpr int kFollowers = 20;
  std::vector<std::unique_ptr<RecordingSink>> sinks;
  for (int i = 0; i < kFollowers; ++i) {
    sinks.push_back(std::make_unique<RecordingSink>(daemon_.workers(), Acknowledge::kAtOnce));
    ASSERT_TRUE(sinks.back()->Follow(session, {}).ok());
  }
  for (auto& sink : sinks) sink->AwaitRevision(0);
  constexpr int kRounds = 50;
  const uint64_t before = session->deltas().num_encodings();
  for (int round = 1; round <= kRounds; ++round) {
    MustApply(*session, AddTet());
    for (auto& sink : sinks) sink->AwaitRevision(round);
  }
  EXPECT_EQ(session->deltas().num_encodings() - before, uint64_t{kRounds});
  for (auto& sink : sinks) ExpectEqual(*sink, *session);
}

TEST_F(FollowerTest, ALargeSnapshotComesInPartsAndIsExactAtTheEnd) {
  const SessionPtr session = daemon_.NewSession();
  MustApply(*session, EditsOf(TetGrid(24, 24, 24)));
  RecordingSink sink(daemon_.workers(), Acknowledge::kByHand);
  ASSERT_TRUE(sink.Follow(session, {}).ok());
  EXPECT_FALSE(sink.TakeOne()->consistent);
  PayloadPtr last = sink.TakeOne();
  while (!last->consistent) last = sink.TakeOne();
  EXPECT_EQ(last->revision, 1);
  ExpectEqual(sink, *session);
  for (const PayloadPtr& payload : sink.payloads()) EXPECT_LT(payload->delta.size(), size_t{4} << 20);
}

TEST_F(FollowerTest, ASnapshotThatIsEditedMeanwhileIsClosedByADelta) {
  const SessionPtr session = daemon_.NewSession();
  MustApply(*session, EditsOf(TetGrid(24, 24, 24)));
  RecordingSink sink(daemon_.workers(), Acknowledge::kByHand);
  ASSERT_TRUE(sink.Follow(session, {}).ok());
  const uint32_t seed = 77;
  SCOPED_TRACE(seed);
  std::mt19937 rng(seed);
  PayloadPtr last = sink.TakeOne();
  EXPECT_FALSE(last->consistent);
  for (int i = 0; !last->consistent; ++i) {
    if (i < 4) {
      const Slot cell = rng() % 80'000;
      const auto removed = session->Apply({RemoveElementsEdit{EntityKind::kCell, {cell, cell + 1, cell + 2}},
                                           MoveVerticesEdit{{Slot(rng() % 1000)}, {{0.1, 0.2, 0.3}}}},
                                          {});
      ASSERT_TRUE(removed.ok()) << removed.status();
      MustApply(*session, AddTet());
    }
    last = sink.TakeOne();
  }
  while (sink.mirror_revision() < session->revision()) sink.TakeOne();
  ExpectEqual(sink, *session);
}

TEST_F(FollowerTest, WideAttributeRowsDoNotMakeLargeMessages) {
  const SessionPtr session = daemon_.NewSession();
  const AttributeSpec wide{"wide", EntityKind::kVertex, AttributeType::kFloat64, 16};
  MustApply(*session, {AddSomeVertices(60'000), AddAttributeEdit{wide}});
  SetAttributeEdit rows{wide, {}, {}};
  std::mt19937 rng(9);
  for (Slot slot = 0; slot < 60'000; ++slot) {
    rows.slots.push_back(slot);
    for (int i = 0; i < 16; ++i) {
      const double value = std::ldexp(static_cast<double>(rng()), -7) + rng();
      const auto* bytes = reinterpret_cast<const uint8_t*>(&value);
      rows.rows.insert(rows.rows.end(), bytes, bytes + 8);
    }
  }
  MustApply(*session, {rows});
  RecordingSink sink(daemon_.workers(), Acknowledge::kAtOnce);
  ASSERT_TRUE(sink.Follow(session, {}).ok());
  sink.AwaitRevision(2);
  ExpectEqual(sink, *session);
  for (const PayloadPtr& payload : sink.payloads()) EXPECT_LT(payload->delta.size(), size_t{4} << 20);
}

TEST_F(FollowerTest, QuantisedPositionsKeepTheirGrid) {
  const SessionPtr session = daemon_.NewSession();
  RecordingSink sink(daemon_.workers(), Acknowledge::kAtOnce, Mirror::Geometry::kQuantized);
  ASSERT_TRUE(sink.Follow(session, {.position_bits = 12}).ok());  // no vertex yet: no grid
  MustApply(*session, EditsOf(TetGrid(4, 4, 4)));
  sink.AwaitRevision(1);
  std::vector<Point> before;
  sink.WithMirror([&](const Mirror& mirror) {
    for (Slot slot = 0; slot < mirror.SlotLimit(EntityKind::kVertex); ++slot) {
      before.push_back(mirror.Position(VertexId(slot)));
    }
  });
  const double step = 1.25 * 4 / 4096;
  ASSERT_TRUE(session
                  ->Read([&](const SessionView& view) {
                    for (Slot slot = 0; slot < before.size(); ++slot) {
                      for (int axis = 0; axis < 3; ++axis) {
                        EXPECT_NEAR(before[slot][axis], view.mesh.Position(VertexId(slot))[axis], step);
                      }
                    }
                    return absl::OkStatus();
                  })
                  .ok());
  MustApply(*session, {AddSomeVertices(3), MoveVerticesEdit{{0}, {{0.5, 0.5, 0.5}}}});
  sink.AwaitRevision(2);
  RecordingSink late(daemon_.workers(), Acknowledge::kAtOnce, Mirror::Geometry::kQuantized);
  ASSERT_TRUE(late.Follow(session, {.position_bits = 12}).ok());
  late.AwaitRevision(2);
  late.WithMirror([&](const Mirror& mirror) {
    for (Slot slot = 1; slot < before.size(); ++slot)
      EXPECT_EQ(mirror.Position(VertexId(slot)), before[slot]);
  });
  EXPECT_TRUE(sink.error().ok()) << sink.error();
  EXPECT_TRUE(late.error().ok()) << late.error();
}

TEST_F(FollowerTest, AnyBoundingBoxCanBeQuantised) {
  const std::vector<std::vector<Point>> clouds = {
      {{1e300, 0, 0}},                             // no extent at all
      {{-1.7e308, 0, 0}, {1.7e308, 1, -1.7e308}},  // an extent that is no number
      {{0, 0, 0}, {5e-324, 0, 0}},
      {{1e17, 1e17, 1e17}, {1e17 + 16, 1e17, 1e17}},
  };
  for (size_t i = 0; i < clouds.size(); ++i) {
    const SessionPtr session = daemon_.NewSession("s" + std::to_string(i));
    MustApply(*session, {AddVerticesEdit{clouds[i]}});
    for (int bits : {1, 16, 30}) {
      RecordingSink sink(daemon_.workers(), Acknowledge::kAtOnce, Mirror::Geometry::kQuantized);
      ASSERT_TRUE(sink.Follow(session, {.position_bits = bits}).ok());
      sink.AwaitRevision(1);
      EXPECT_TRUE(sink.error().ok()) << i << " " << bits << " " << sink.error();
    }
  }
}

TEST_F(FollowerTest, MinIntervalLiesBetweenConsistentDeltas) {
  const SessionPtr session = daemon_.NewSession();
  RecordingSink sink(daemon_.workers(), Acknowledge::kByHand);
  const absl::Duration interval = absl::Milliseconds(80);
  ASSERT_TRUE(sink.Follow(session, {.min_interval = interval}).ok());
  ASSERT_NE(sink.TakeOne(), nullptr);
  absl::Time last = absl::Now();
  for (int round = 0; round < 3; ++round) {
    MustApply(*session, AddTet());
    MustApply(*session, AddTet());
    sink.TakeOne();
    EXPECT_GE(absl::Now() - last, interval - absl::Milliseconds(1));
    last = absl::Now();
  }
  EXPECT_EQ(sink.payloads().size(), 4u);
  ExpectEqual(sink, *session);
}

TEST_F(FollowerTest, DeletionEndsIdlePausingAndSendingFollowers) {
  const SessionPtr session = daemon_.NewSession();
  RecordingSink idle(daemon_.workers(), Acknowledge::kByHand);
  RecordingSink pausing(daemon_.workers(), Acknowledge::kByHand);
  RecordingSink sending(daemon_.workers(), Acknowledge::kByHand);
  ASSERT_TRUE(idle.Follow(session, {}).ok());
  ASSERT_TRUE(pausing.Follow(session, {.min_interval = absl::Hours(1)}).ok());
  idle.TakeOne();
  pausing.TakeOne();
  MustApply(*session, AddTet());
  idle.TakeOne();
  ASSERT_TRUE(sending.Follow(session, {}).ok());
  sending.AwaitUnacknowledged();
  ASSERT_TRUE(session->Delete("").ok());
  const Refusal deleted{absl::StatusCode::kNotFound, reason::kSessionDeleted};
  EXPECT_EQ(RefusalOf(idle.AwaitEnd()), deleted);
  EXPECT_EQ(RefusalOf(pausing.AwaitEnd()), deleted);
  sending.TakeOne();
  EXPECT_EQ(RefusalOf(sending.AwaitEnd()), deleted);
  EXPECT_EQ(session->followers().size(), 0u);
  RecordingSink late(daemon_.workers(), Acknowledge::kAtOnce);
  EXPECT_EQ(RefusalOf(late.Follow(session, {})), deleted);
}

TEST_F(FollowerTest, APeerThatIsGoneEndsTheFollower) {
  const SessionPtr session = daemon_.NewSession();
  RecordingSink sink(daemon_.workers(), Acknowledge::kByHand);
  ASSERT_TRUE(sink.Follow(session, {}).ok());
  sink.TakeOne();
  sink.follower().End(absl::CancelledError("gone"));
  EXPECT_EQ(sink.AwaitEnd().code(), absl::StatusCode::kCancelled);
  EXPECT_EQ(session->followers().size(), 0u);
  MustApply(*session, AddTet());
}

TEST_F(FollowerTest, OddOptionsAreRefused) {
  const SessionPtr session = daemon_.NewSession();
  MustApply(*session, AddTet());
  const auto refusal = [&](const FollowOptions& options) {
    RecordingSink sink(daemon_.workers(), Acknowledge::kAtOnce);
    return RefusalOf(sink.Follow(session, options));
  };
  const Refusal bad{absl::StatusCode::kInvalidArgument, reason::kBadArgument};
  EXPECT_EQ(refusal({.from_revision = 2}),
            (Refusal{absl::StatusCode::kOutOfRange, reason::kRevisionInFuture}));
  EXPECT_EQ(refusal({.from_revision = -1}), bad);
  EXPECT_EQ(refusal({.position_bits = 31}), bad);
  EXPECT_EQ(refusal({.position_bits = -1}), bad);
  EXPECT_EQ(refusal({.min_interval = absl::Milliseconds(-1)}), bad);
  EXPECT_EQ(refusal({.min_interval = absl::Hours(2)}), bad);
  EXPECT_EQ(session->followers().size(), 0u);
}

TEST(FollowerLimitsTest, FollowersOfASessionAreLimited) {
  Limits limits;
  limits.max_followers = 1;
  Daemon daemon(limits);
  const SessionPtr session = daemon.NewSession();
  {
    RecordingSink first(daemon.workers(), Acknowledge::kAtOnce);
    ASSERT_TRUE(first.Follow(session, {}).ok());
    RecordingSink second(daemon.workers(), Acknowledge::kAtOnce);
    const absl::Status refused = second.Follow(session, {});
    EXPECT_EQ(RefusalOf(refused), (Refusal{absl::StatusCode::kResourceExhausted, reason::kLimitExceeded}));
    EXPECT_EQ(MetadataOf(refused, "limit"), "max_followers");
  }
  RecordingSink third(daemon.workers(), Acknowledge::kAtOnce);
  EXPECT_TRUE(third.Follow(session, {}).ok());
}

}  // namespace
}  // namespace dynmesh::testing
