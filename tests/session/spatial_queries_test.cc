#include "server/session/spatial_queries.h"

#include <atomic>
#include <cmath>
#include <thread>

#include "core/mesh/rings.h"
#include "server/session/session_errors.h"
#include "tests/session/session_support.h"
#include "tests/support/meshes.h"

namespace dynmesh::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

/// Calls fn with the session's mesh.
template <typename Fn>
void WithMesh(const Session& session, Fn fn) {
  EXPECT_TRUE(session
                  .Read([&](const SessionView& view) {
                    fn(view.mesh);
                    return absl::OkStatus();
                  })
                  .ok());
}

SessionPtr SessionOf(Daemon& daemon, const Mesh& mesh) {
  const SessionPtr session = daemon.NewSession();
  MustApply(*session, EditsOf(mesh));
  return session;
}

std::vector<Slot> SelectedIds(const Session& session, EntityKind kind, const Selection& selection) {
  const auto answer = QueryEntities(session, kind, selection);
  EXPECT_TRUE(answer.ok()) << answer.status();
  std::vector<Slot> ids;
  if (!answer.ok()) return ids;
  for (const EntitiesChunk& chunk : answer->chunks) ids.insert(ids.end(), chunk.ids.begin(), chunk.ids.end());
  return ids;
}

Selection With(Selection selection, bool boundary_only, absl::optional<Box> box) {
  selection.boundary_only = boundary_only;
  selection.box = box;
  return selection;
}

/// Joins chunks as a client does.
struct Rows {
  std::vector<size_t> sizes;
  std::vector<Slot> ids;
  std::vector<double> scores;
};
Rows Join(const ScoredAnswer& answer) {
  Rows rows;
  for (const ScoredChunk& chunk : answer.chunks) {
    EXPECT_LE(chunk.offsets.size() * 4 + chunk.ids.size() * 12, kChunkBytes);
    EXPECT_EQ(chunk.ids.size(), chunk.scores.size());
    for (size_t i = 1; i < chunk.offsets.size(); ++i) {
      rows.sizes.push_back(chunk.offsets[i] - chunk.offsets[i - 1]);
    }
    rows.ids.insert(rows.ids.end(), chunk.ids.begin(), chunk.ids.end());
    rows.scores.insert(rows.scores.end(), chunk.scores.begin(), chunk.scores.end());
  }
  return rows;
}

const Refusal kLimited{absl::StatusCode::kResourceExhausted, reason::kLimitExceeded};
const Refusal kBadArgument{absl::StatusCode::kInvalidArgument, reason::kBadArgument};
const Refusal kBadKind{absl::StatusCode::kInvalidArgument, reason::kBadEntityKind};
const Box kCorner{{-1, -1, -1}, {1, 1.5, 2}};

TEST(SelectionTest, FiltersCombineWithEveryWayToSelect) {
  Daemon daemon;
  const SessionPtr session = SessionOf(daemon, TetGrid(3, 3, 3));
  Selection range, ids;
  range.which = Selection::Range{5, 30};
  ids.which = std::vector<Slot>{20, 3, 9, 20, 41};
  for (EntityKind kind : kEntityKinds) {
    for (const Selection& base : {Selection(), range, ids}) {
      for (bool boundary_only : {false, true}) {
        for (const auto& box : {absl::optional<Box>(), absl::make_optional(kCorner)}) {
          if (boundary_only && kind == EntityKind::kCell) continue;
          std::vector<Slot> expected = SelectedIds(*session, kind, base);
          WithMesh(*session, [&](const Mesh& mesh) {
            std::erase_if(expected, [&](Slot slot) {
              return (boundary_only && !mesh.IsOnBoundary({kind, slot})) ||
                     (box.has_value() && !Meet(BoundsOf(mesh, {kind, slot}), *box));
            });
          });
          EXPECT_EQ(SelectedIds(*session, kind, With(base, boundary_only, box)), expected);
        }
      }
    }
  }
}

TEST(SelectionTest, CellsHaveNoBoundary) {
  Daemon daemon;
  const SessionPtr session = SessionOf(daemon, OneTet());
  EXPECT_EQ(RefusalOf(QueryEntities(*session, EntityKind::kCell, With({}, true, {}))), kBadKind);
}

TEST(SelectionTest, WhatFiltersHoldBackIsWorkToo) {
  Limits limits;
  limits.max_query_steps = 1000;
  Daemon daemon(limits);
  const SessionPtr session = SessionOf(daemon, TetGrid(3, 3, 3));
  Selection many;
  many.which = std::vector<Slot>(2000, 0);
  const auto refused =
      QueryEntities(*session, EntityKind::kCell, With(many, false, Box{{9, 9, 9}, {9, 9, 9}}));
  EXPECT_EQ(RefusalOf(refused), kLimited);
  EXPECT_EQ(MetadataOf(refused.status(), "limit"), "max_query_steps");
}

TEST(RingQueriesTest, RingsAreThoseOfTheMesh) {
  Daemon daemon;
  const SessionPtr session = SessionOf(daemon, TetGrid(3, 3, 3));
  for (EntityKind kind : kEntityKinds) {
    const auto answer = QueryNeighbors(*session, Neighborhood(Relation{kind, kind}, 3), {});
    ASSERT_TRUE(answer.ok()) << answer.status();
    WithMesh(*session, [&](const Mesh& mesh) {
      RingWalk walk(mesh, kind, WorkMeter::Unlimited());
      std::vector<Slot> row;
      for (const NeighborsChunk& chunk : answer->chunks) {
        for (size_t i = 0; i < chunk.ids.size(); ++i) {
          ASSERT_TRUE(walk.Walk(chunk.ids[i], 3, row).ok());
          EXPECT_EQ(row, std::vector<Slot>(chunk.neighbors.begin() + chunk.offsets[i],
                                           chunk.neighbors.begin() + chunk.offsets[i + 1]));
        }
      }
    });
  }
}

TEST(RingQueriesTest, RingsThatMakeNoSenseAreRefused) {
  Daemon daemon;
  const SessionPtr session = SessionOf(daemon, OneTet());
  const Relation same{EntityKind::kCell, EntityKind::kCell}, other{EntityKind::kCell, EntityKind::kVertex};
  EXPECT_EQ(RefusalOf(QueryNeighbors(*session, Neighborhood(other, 2), {})), kBadArgument);
  EXPECT_EQ(RefusalOf(QueryNeighbors(*session, Neighborhood(same, 0), {})), kBadArgument);
  const auto refused = QueryNeighbors(*session, Neighborhood(same, kMaxRings + 1), {});
  EXPECT_EQ(RefusalOf(refused), kBadArgument);
  EXPECT_EQ(MetadataOf(refused.status(), "field"), "rings");
  EXPECT_TRUE(QueryNeighbors(*session, Neighborhood(same, kMaxRings), {}).ok());
}

TEST(SpatialQueriesTest, AnswersFollowTheEdits) {
  Daemon daemon;
  const SessionPtr session = daemon.NewSession();
  const Box box{{9, 9, 9}, {11, 11, 11}};
  EXPECT_THAT(QueryInBox(*session, EntityKind::kVertex, box)->ids, IsEmpty());
  MustApply(*session, EditsOf(HexGrid(2, 2, 2)));
  EXPECT_THAT(QueryInBox(*session, EntityKind::kVertex, box)->ids, IsEmpty());
  EXPECT_THAT(QueryLocate(*session, {EntityKind::kCell, {{0.5, 0.5, 0.5}, {7, 7, 7}, {1, 1, 1}}})->ids,
              ElementsAre(0, kNoSlot, 0));
  MustApply(*session, {MoveVerticesEdit{{26}, {{10, 10, 10}}}});
  const auto moved = QueryInBox(*session, EntityKind::kVertex, box);
  EXPECT_THAT(moved->ids, ElementsAre(26));
  EXPECT_EQ(moved->revision, 2);
  EXPECT_THAT(QueryLocate(*session, {EntityKind::kCell, {{7, 7, 7}}})->ids, ElementsAre(7));
  MustApply(*session, {RemoveElementsEdit{EntityKind::kCell, {7}}, RemoveVerticesEdit{{26}}});
  EXPECT_THAT(QueryInBox(*session, EntityKind::kVertex, box)->ids, IsEmpty());
  EXPECT_THAT(QueryLocate(*session, {EntityKind::kCell, {{7, 7, 7}}})->ids, ElementsAre(kNoSlot));
}

TEST(SpatialQueriesTest, NearestVerticesAndHitsComeInRows) {
  Daemon daemon;
  const SessionPtr session = SessionOf(daemon, HexGrid(2, 2, 2));
  const auto nearest = QueryNearestVertices(*session, {{{0, 0, -1}, {2, 2, 2}}, 2});
  ASSERT_TRUE(nearest.ok()) << nearest.status();
  const Rows near = Join(*nearest);
  EXPECT_THAT(near.sizes, ElementsAre(2, 2));
  EXPECT_THAT(near.ids, ElementsAre(0, 1, 26, 17));
  EXPECT_THAT(near.scores, ElementsAre(1, std::sqrt(2.0), 0, 1));
  const std::vector<Ray> rays = {{{0.2, 0.3, -1}, {0, 0, 2}}, {{9, 9, 9}, {1, 0, 0}}};
  const Rows first = Join(*QueryRays(*session, {rays, {}}));
  EXPECT_THAT(first.sizes, ElementsAre(1, 0));
  EXPECT_THAT(first.scores, ElementsAre(0.5));
  const Rows all = Join(*QueryRays(*session, {rays, {RayTargets::kAnyFace, RayHits::kAll}}));
  EXPECT_THAT(all.sizes, ElementsAre(3, 0));
  EXPECT_THAT(all.scores, ElementsAre(0.5, 1, 1.5));
  EXPECT_EQ(QueryRays(*session, {})->chunks.size(), 1u) << "an empty answer says its revision";
  EXPECT_EQ(QueryNearestVertices(*session, {})->chunks.size(), 1u);
}

TEST(SpatialQueriesTest, ALongRowIsCut) {
  constexpr int kFaces = 100'000;
  Daemon daemon;
  const SessionPtr session = daemon.NewSession();
  AddElementsEdit faces{ElementType::kTriangle, {}};
  for (int i = 0; i < kFaces; ++i) faces.vertices.insert(faces.vertices.end(), {0, 1, 2});
  MustApply(*session, {AddVerticesEdit{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}}});
  MustApply(*session, {faces});
  const Ray through{{0.25, 0.25, 1}, {0, 0, -1}}, past{{5, 5, 1}, {0, 0, -1}};
  const auto answer =
      QueryRays(*session, {{past, through, past, through}, {RayTargets::kAnyFace, RayHits::kAll}});
  ASSERT_TRUE(answer.ok()) << answer.status();
  EXPECT_GT(answer->chunks.size(), 2u);
  const Rows rows = Join(*answer);
  EXPECT_THAT(rows.sizes, ElementsAre(0, kFaces, 0, kFaces));
  ASSERT_EQ(rows.ids.size(), 2u * kFaces);
  for (int i = 0; i < kFaces; ++i) ASSERT_EQ(rows.ids[kFaces + i], static_cast<Slot>(i));
}

TEST(SpatialQueriesTest, QuestionsThatMakeNoSenseAreRefused) {
  Daemon daemon;
  const SessionPtr session = SessionOf(daemon, OneTet());
  EXPECT_EQ(RefusalOf(QueryNearestVertices(*session, {{}, 0})), kBadArgument);
  EXPECT_EQ(RefusalOf(QueryNearestVertices(*session, {{}, kMaxNearest + 1})), kBadArgument);
  EXPECT_EQ(RefusalOf(QueryLocate(*session, {EntityKind::kEdge, {}})), kBadKind);
  EXPECT_EQ(RefusalOf(QueryLocate(*session, {EntityKind::kVertex, {}})), kBadKind);
  EXPECT_EQ(RefusalOf(QueryLocate(*session, {EntityKind::kFace, {}, -1})), kBadArgument);
  EXPECT_EQ(RefusalOf(QueryLocate(*session, {EntityKind::kFace, {}, std::nan("")})), kBadArgument);
  EXPECT_EQ(RefusalOf(QueryLocate(*session, {EntityKind::kCell, {}, 1})), kBadArgument);
}

/// 20,000 equal tetrahedra.
SessionPtr Pile(Daemon& daemon) {
  const SessionPtr session = daemon.NewSession();
  AddElementsEdit cells{ElementType::kTetrahedron, {}};
  for (int i = 0; i < 20'000; ++i) cells.vertices.insert(cells.vertices.end(), {0, 1, 2, 3});
  MustApply(*session, {AddVerticesEdit{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}});
  MustApply(*session, {cells});
  return session;
}

TEST(SpatialQueriesTest, WorkAndAnswersAreLimited) {
  Limits limits;
  limits.max_query_steps = 1'000'000;
  limits.max_query_bytes = 60'000;
  Daemon daemon(limits);
  const SessionPtr session = Pile(daemon);
  const Point inside = {0.1, 0.1, 0.1};
  EXPECT_TRUE(QueryLocate(*session, {EntityKind::kCell, std::vector<Point>(20, inside)}).ok());
  const auto steps = QueryLocate(*session, {EntityKind::kCell, std::vector<Point>(60, inside)});
  EXPECT_EQ(RefusalOf(steps), kLimited);
  EXPECT_EQ(MetadataOf(steps.status(), "limit"), "max_query_steps");
  const auto bytes = QueryInBox(*session, EntityKind::kCell, {inside, inside});
  EXPECT_EQ(RefusalOf(bytes), kLimited);
  EXPECT_EQ(MetadataOf(bytes.status(), "limit"), "max_query_bytes");
  EXPECT_EQ(
      MetadataOf(QueryNearestVertices(*session, {std::vector<Point>(20'000, inside), 1}).status(), "limit"),
      "max_query_bytes");
}

/// Stops at the n-th check.
class StopAt : public StopSignal {
 public:
  explicit StopAt(int check) : left_(check) {}
  absl::Status Check() const override { return --left_ > 0 ? absl::OkStatus() : CallCancelled(); }
  int left() const { return left_; }

 private:
  mutable int left_;
};

TEST(SpatialQueriesTest, WhatNobodyWaitsForStops) {
  Daemon daemon;
  const SessionPtr session = Pile(daemon);
  const Point inside = {0.1, 0.1, 0.1};
  const LocateQuestion question{EntityKind::kCell, std::vector<Point>(50, inside)};
  for (int check = 1; check <= 40; check += 3) {  // the first ones fall into the making of the index
    const StopAt stop(check);
    EXPECT_EQ(QueryLocate(*session, question, {stop}).status().code(), absl::StatusCode::kCancelled);
    EXPECT_EQ(stop.left(), 0) << "it went on";
  }
  const StopAt at_once(1);
  const auto cancelled = absl::StatusCode::kCancelled;
  EXPECT_EQ(QueryInBox(*session, EntityKind::kEdge, kCorner, {at_once}).status().code(), cancelled);
  EXPECT_EQ(QueryRays(*session, {{{inside, {1, 0, 0}}}, {}}, {at_once}).status().code(), cancelled);
  EXPECT_EQ(QueryNearestVertices(*session, {{inside}, 1}, {at_once}).status().code(), cancelled);
  EXPECT_THAT(QueryLocate(*session, {EntityKind::kCell, {inside}})->ids, ElementsAre(0));
}

TEST(SpatialIndexBytesTest, AnIndexIsMadeWhenAskedForAndCounted) {
  Daemon daemon;
  const SessionPtr session = SessionOf(daemon, TetGrid(4, 4, 4));
  EXPECT_EQ(session->Info()->index_bytes, 0u);
  EXPECT_FALSE(session->spatial().IsCurrent(EntityKind::kCell, 1));
  ASSERT_TRUE(QueryInBox(*session, EntityKind::kCell, kCorner).ok());
  EXPECT_TRUE(session->spatial().IsCurrent(EntityKind::kCell, 1));
  const uint64_t of_cells = session->Info()->index_bytes;
  EXPECT_GT(of_cells, 384u * sizeof(SpatialIndex::Entry));
  ASSERT_TRUE(QueryInBox(*session, EntityKind::kFace, kCorner).ok());
  EXPECT_GT(session->Info()->index_bytes, of_cells);
}

TEST(SpatialIndexBytesTest, AnIndexThatHasNoRoomIsRefused) {
  Limits limits;
  limits.max_session_bytes = 200'000;
  Daemon daemon(limits);
  const SessionPtr session = SessionOf(daemon, TetGrid(5, 5, 5));
  const auto refused = QueryInBox(*session, EntityKind::kFace, kCorner);
  EXPECT_EQ(RefusalOf(refused), kLimited);
  EXPECT_EQ(MetadataOf(refused.status(), "limit"), "max_session_bytes");
  EXPECT_EQ(session->Info()->index_bytes, 0u);
}

TEST(SpatialIndexBytesTest, AnIndexMakesRoomForEdits) {
  Limits limits;
  limits.max_session_bytes = 2'000'000;
  Daemon daemon(limits);
  const SessionPtr session =
      SessionOf(daemon, TetGrid(8, 8, 8));  // an index of cells outweighs 1000 vertices
  for (EntityKind kind : {EntityKind::kVertex, EntityKind::kCell, EntityKind::kFace}) {
    ASSERT_TRUE(QueryInBox(*session, kind, kCorner).ok());
  }
  const uint64_t with_indices = session->Info()->memory_bytes + session->Info()->index_bytes;
  EXPECT_LT(with_indices, limits.max_session_bytes);
  while (session->Info()->index_bytes > 0) {
    const auto applied = session->Apply({AddSomeVertices(1000)}, {});
    ASSERT_TRUE(applied.ok()) << applied.status();
  }
  EXPECT_TRUE(QueryInBox(*session, EntityKind::kCell, kCorner).ok());
}

TEST(SpatialIndexBytesTest, ReadersAndAnEditorSeeWholeRevisions) {
  Daemon daemon;
  const SessionPtr session = SessionOf(daemon, HexGrid(4, 4, 4));
  std::atomic<bool> stop{false};
  std::vector<std::thread> readers;
  for (int reader = 0; reader < 3; ++reader) {
    readers.emplace_back([&] {
      while (!stop) {
        // At revision r the moving vertex lies at height 4 + r, and nowhere else.
        const auto found = QueryInBox(*session, EntityKind::kVertex, {{4, 4, 4.5}, {4, 4, 1e9}});
        ASSERT_TRUE(found.ok()) << found.status();
        EXPECT_EQ(found->ids.size(), found->revision > 1 ? 1u : 0u);
        const auto nearest = QueryNearestVertices(*session, {{{4, 4, 1000}}, 1});
        ASSERT_TRUE(nearest.ok());
        EXPECT_EQ(nearest->chunks[0].ids[0], 124u);
        EXPECT_EQ(nearest->chunks[0].scores[0], 996 - (nearest->revision > 1 ? nearest->revision : 0));
      }
    });
  }
  for (int i = 2; i < 60; ++i) MustApply(*session, {MoveVerticesEdit{{124}, {{4, 4, 4.0 + i}}}});
  stop = true;
  for (std::thread& reader : readers) reader.join();
}

}  // namespace
}  // namespace dynmesh::testing
