#include "server/session/queries.h"

#include <map>

#include "core/codec/surface_codec.h"
#include "server/session/export.h"
#include "server/session/row_walk.h"
#include "server/session/session_errors.h"
#include "tests/session/session_support.h"
#include "tests/support/meshes.h"
#include "tests/support/oracle.h"

namespace dynmesh::testing {
namespace {

using ::testing::ElementsAre;

/// Joins chunks as a client does: ids, differences of offsets, neighbours.
CsrTable Join(const NeighborsAnswer& answer, std::vector<Slot>* ids) {
  CsrTable table;
  for (const NeighborsChunk& chunk : answer.chunks) {
    EXPECT_EQ(chunk.offsets.size(), chunk.ids.size() + 1);
    EXPECT_LE((chunk.ids.size() * 2 + chunk.neighbors.size()) * sizeof(Slot), kChunkBytes);
    for (size_t i = 0; i < chunk.ids.size(); ++i) {
      table.offsets.push_back(table.offsets.back() + chunk.offsets[i + 1] - chunk.offsets[i]);
    }
    ids->insert(ids->end(), chunk.ids.begin(), chunk.ids.end());
    table.ids.insert(table.ids.end(), chunk.neighbors.begin(), chunk.neighbors.end());
  }
  EXPECT_EQ(table.offsets.back(), table.ids.size());
  return table;
}

std::vector<Slot> LiveSlots(const Mesh& mesh, EntityKind kind) {
  std::vector<Slot> slots;
  mesh.slots(kind).live().ForEach([&](Slot slot) { slots.push_back(slot); });
  return slots;
}

Selection Ids(std::vector<Slot> ids, int64_t as_of = 0) {
  Selection selection;
  selection.which = std::move(ids);
  selection.as_of_revision = as_of;
  return selection;
}

Selection Range(Slot begin, Slot end) {
  Selection selection;
  selection.which = Selection::Range{begin, end};
  return selection;
}

TEST(QueriesTest, All16RelationsAreThoseOfTheMesh) {
  Daemon daemon;
  int number = 0;
  for (NamedMesh& named : AllMeshes()) {
    SCOPED_TRACE(named.name);
    const SessionPtr session = daemon.NewSession("m" + std::to_string(number++));
    MustApply(*session, EditsOf(named.mesh));
    ASSERT_TRUE(session
                    ->Read([&](const SessionView& view) {
                      EXPECT_EQ(view.mesh.checksum(), ByDimension(named.mesh).checksum());
                      return absl::OkStatus();
                    })
                    .ok());
    for (EntityKind from : kEntityKinds) {
      for (EntityKind to : kEntityKinds) {
        const auto answer = QueryNeighbors(*session, Relation{from, to}, {});
        ASSERT_TRUE(answer.ok()) << answer.status();
        EXPECT_EQ(answer->revision, 1);
        std::vector<Slot> ids;
        const CsrTable table = Join(*answer, &ids);
        EXPECT_TRUE(session
                        ->Read([&](const SessionView& view) {
                          EXPECT_EQ(ids, LiveSlots(view.mesh, from));
                          const CsrTable expected = Neighbors(view.mesh, {from, to}, ids);
                          EXPECT_EQ(table.offsets, expected.offsets);
                          EXPECT_EQ(table.ids, expected.ids);
                          return absl::OkStatus();
                        })
                        .ok());
      }
    }
  }
}

TEST(QueriesTest, SelectionsKeepTheirOrder) {
  Daemon daemon;
  const SessionPtr session = daemon.NewSession();
  MustApply(*session, EditsOf(TetGrid(2, 2, 2)));
  const auto ids_of = [&](const Selection& selection) {
    std::vector<Slot> ids;
    const auto answer = QueryNeighbors(*session, Relation{EntityKind::kVertex, EntityKind::kCell}, selection);
    EXPECT_TRUE(answer.ok()) << answer.status();
    if (answer.ok()) Join(*answer, &ids);
    return ids;
  };
  EXPECT_THAT(ids_of(Ids({5, 2, 5, 0})), ElementsAre(5, 2, 5, 0));
  EXPECT_THAT(ids_of(Range(24, 1000)), ElementsAre(24, 25, 26));
  EXPECT_THAT(ids_of(Range(5, 5)), ElementsAre());
  EXPECT_THAT(ids_of(Range(7, 3)), ElementsAre());
  EXPECT_THAT(ids_of(Ids({})), ElementsAre());
}

TEST(QueriesTest, AnswersWithoutRowsHaveAChunkAllTheSame) {
  Daemon daemon;
  const SessionPtr session = daemon.NewSession();
  EXPECT_EQ(QueryNeighbors(*session, Relation{EntityKind::kVertex, EntityKind::kCell}, {})->chunks.size(),
            1u);
  EXPECT_EQ(QueryEntities(*session, EntityKind::kCell, {})->chunks.size(), 1u);
  EXPECT_EQ(ExportSession(*session)->chunks.size(), 1u);
}

TEST(QueriesTest, IdsThatAreNotLiveAreNamed) {
  Daemon daemon;
  const SessionPtr session = daemon.NewSession();
  MustApply(*session, AddTet());
  MustApply(*session, AddTet());
  MustApply(*session, {RemoveElementsEdit{EntityKind::kCell, {0}}});
  const Relation relation{EntityKind::kCell, EntityKind::kVertex};
  const auto removed = QueryNeighbors(*session, relation, Ids({1, 0}));
  EXPECT_EQ(RefusalOf(removed), (Refusal{absl::StatusCode::kNotFound, reason::kEntityRemoved}));
  EXPECT_EQ(MetadataOf(removed.status(), "ids"), "0");
  const auto unknown = QueryNeighbors(*session, relation, Ids({1, 7, 0, 9}));
  EXPECT_EQ(RefusalOf(unknown), (Refusal{absl::StatusCode::kNotFound, reason::kUnknownEntity}));
  EXPECT_EQ(MetadataOf(unknown.status(), "ids"), "7,0,9");
  EXPECT_EQ(MetadataOf(unknown.status(), "kind"), "cell");
  const auto younger = QueryNeighbors(*session, relation, Ids({1}, 1));
  EXPECT_EQ(RefusalOf(younger), (Refusal{absl::StatusCode::kNotFound, reason::kEntityRemoved}));
  EXPECT_TRUE(QueryNeighbors(*session, relation, Ids({1}, 2)).ok());
  EXPECT_EQ(RefusalOf(QueryNeighbors(*session, relation, Ids({1}, 4))),
            (Refusal{absl::StatusCode::kOutOfRange, reason::kRevisionInFuture}));
  EXPECT_EQ(RefusalOf(QueryNeighbors(*session, relation, Ids({1}, -1))),
            (Refusal{absl::StatusCode::kInvalidArgument, reason::kBadArgument}));
}

TEST(QueriesTest, ARowLongerThanAChunkIsCut) {
  Daemon daemon;
  const SessionPtr session = daemon.NewSession();
  const Slot n = 600'000;
  AddElementsEdit spokes{ElementType::kWireEdge, {}};
  for (Slot i = 1; i <= n; ++i) spokes.vertices.insert(spokes.vertices.end(), {kNewVertex, kNewVertex | i});
  AddVerticesEdit vertices;
  vertices.positions.resize(n + 1);
  MustApply(*session, {vertices});
  for (Slot& slot : spokes.vertices) slot &= ~kNewVertex;
  MustApply(*session, {spokes});
  const auto answer =
      QueryNeighbors(*session, Relation{EntityKind::kVertex, EntityKind::kVertex}, Ids({1, 0, 2}));
  ASSERT_TRUE(answer.ok()) << answer.status();
  EXPECT_GT(answer->chunks.size(), 3u);
  std::vector<Slot> ids;
  const CsrTable table = Join(*answer, &ids);
  EXPECT_THAT(ids, ElementsAre(1, 0, 2));
  EXPECT_THAT(table.Row(0), ElementsAre(0));
  EXPECT_THAT(table.Row(2), ElementsAre(0));
  ASSERT_EQ(table.Row(1).size(), n);
  for (Slot i = 0; i < n; ++i) ASSERT_EQ(table.Row(1)[i], i + 1);
}

TEST(QueriesTest, AnswersAreLimited) {
  Limits limits;
  limits.max_query_bytes = 2000;
  Daemon daemon(limits);
  const SessionPtr session = daemon.NewSession();
  MustApply(*session, EditsOf(TetGrid(3, 3, 3)));
  const Refusal limited{absl::StatusCode::kResourceExhausted, reason::kLimitExceeded};
  const auto neighbors = QueryNeighbors(*session, Relation{EntityKind::kCell, EntityKind::kEdge}, {});
  EXPECT_EQ(RefusalOf(neighbors), limited);
  EXPECT_EQ(MetadataOf(neighbors.status(), "limit"), "max_query_bytes");
  EXPECT_EQ(RefusalOf(QueryEntities(*session, EntityKind::kVertex, {})), limited);
  EXPECT_EQ(RefusalOf(ExportSession(*session)), limited);
  EXPECT_EQ(RefusalOf(QuerySurface(*session)), limited);
  EXPECT_TRUE(QueryNeighbors(*session, Relation{EntityKind::kCell, EntityKind::kEdge}, Range(0, 10)).ok());
}

TEST(QueriesTest, EntitiesTellWhatTheyAre) {
  Daemon daemon;
  const SessionPtr session = daemon.NewSession();
  MustApply(*session, EditsOf(TetWithDanglers()));
  MustApply(*session, {AddElementsEdit{ElementType::kWireEdge, {0, 1}}});
  const auto check = [&](EntityKind kind) {
    const auto answer = QueryEntities(*session, kind, {});
    ASSERT_TRUE(answer.ok());
    ASSERT_EQ(answer->chunks.size(), 1u);
    const EntitiesChunk& chunk = answer->chunks[0];
    ASSERT_TRUE(session
                    ->Read([&](const SessionView& view) {
                      const Mesh& mesh = view.mesh;
                      EXPECT_EQ(chunk.ids, LiveSlots(mesh, kind));
                      for (size_t i = 0; i < chunk.ids.size(); ++i) {
                        const EntityId id(kind, chunk.ids[i]);
                        EXPECT_EQ(chunk.flags[i],
                                  mesh.IsElement(id) + 2 * mesh.IsOnBoundary(id) + 4 * mesh.IsDuplicate(id));
                        EXPECT_EQ(chunk.born_revisions[i], mesh.slots(kind).Born(id.slot));
                        if (kind == EntityKind::kVertex) {
                          EXPECT_EQ(chunk.positions[i], mesh.Position(VertexId(id.slot)));
                          continue;
                        }
                        EXPECT_EQ(chunk.types[i], mesh.Type(id));
                        const auto row = absl::MakeConstSpan(chunk.vertices)
                                             .subspan(chunk.vertex_offsets[i],
                                                      chunk.vertex_offsets[i + 1] - chunk.vertex_offsets[i]);
                        EXPECT_EQ(row, mesh.VerticesOf(id));
                      }
                      return absl::OkStatus();
                    })
                    .ok());
  };
  for (EntityKind kind : kEntityKinds) check(kind);
}

TEST(QueriesTest, BoundaryIsThatOfTheMesh) {
  Daemon daemon;
  const SessionPtr session = daemon.NewSession();
  MustApply(*session, EditsOf(TetGrid(3, 2, 2)));
  for (EntityKind kind : {EntityKind::kVertex, EntityKind::kEdge, EntityKind::kFace}) {
    const auto answer = QueryBoundary(*session, kind);
    ASSERT_TRUE(answer.ok());
    std::vector<Slot> expected;
    ASSERT_TRUE(session
                    ->Read([&](const SessionView& view) {
                      view.mesh.Boundary(kind).ForEach([&](Slot slot) { expected.push_back(slot); });
                      return absl::OkStatus();
                    })
                    .ok());
    EXPECT_EQ(answer->ids, expected);
    EXPECT_FALSE(expected.empty());
  }
  EXPECT_EQ(RefusalOf(QueryBoundary(*session, EntityKind::kCell)),
            (Refusal{absl::StatusCode::kInvalidArgument, reason::kBadEntityKind}));
}

/// A book: `n` triangles that share the edge between vertices 0 and 1, and no cell.
std::vector<Edit> Book(int n) {
  AddElementsEdit pages{ElementType::kTriangle, {}};
  for (int i = 0; i < n; ++i) {
    pages.vertices.insert(pages.vertices.end(), {kNewVertex, kNewVertex | 1, kNewVertex | Slot(2 + i)});
  }
  return {AddSomeVertices(n + 2), pages};
}

Slot HubEdge(const Session& session) {
  Slot hub = kNoSlot;
  EXPECT_TRUE(session
                  .Read([&](const SessionView& view) {
                    hub = view.mesh.FindEdge(VertexId(0), VertexId(1)).slot();
                    return absl::OkStatus();
                  })
                  .ok());
  return hub;
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

TEST(QueriesTest, WorkIsLimitedWhereTheAnswerIsEmpty) {
  Limits limits;
  limits.max_query_steps = 1'000'000;
  Daemon daemon(limits);
  const SessionPtr session = daemon.NewSession();
  MustApply(*session, Book(20'000));
  const Slot hub = HubEdge(*session);
  const Relation relation{EntityKind::kEdge, EntityKind::kCell};
  EXPECT_TRUE(QueryNeighbors(*session, relation, Ids(std::vector<Slot>(40, hub))).ok());
  const auto refused = QueryNeighbors(*session, relation, Ids(std::vector<Slot>(60, hub)));
  EXPECT_EQ(RefusalOf(refused), (Refusal{absl::StatusCode::kResourceExhausted, reason::kLimitExceeded}));
  EXPECT_EQ(MetadataOf(refused.status(), "limit"), "max_query_steps");
}

TEST(QueriesTest, WhatNobodyWaitsForIsNotBegunAndStopsWithinARow) {
  Daemon daemon;
  const SessionPtr session = daemon.NewSession();
  MustApply(*session, Book(200'000));
  const Relation relation{EntityKind::kEdge, EntityKind::kCell};
  const Selection one_row = Ids({HubEdge(*session)});
  for (int check = 1; check <= 20; ++check) {
    const StopAt stop(check);
    EXPECT_EQ(QueryNeighbors(*session, relation, one_row, {stop}).status().code(),
              absl::StatusCode::kCancelled);
    EXPECT_EQ(stop.left(), 0) << "it went on";
  }
  const StopAt never(1000);
  EXPECT_TRUE(QueryNeighbors(*session, relation, one_row, {never}).ok());
  EXPECT_LE(1000 - never.left(), 200'000 / int{QueryBudget::kStepsPerCheck} + 2);
  const StopAt at_once(1);
  EXPECT_EQ(QueryEntities(*session, EntityKind::kFace, {}, {at_once}).status().code(),
            absl::StatusCode::kCancelled);
  EXPECT_EQ(ExportSession(*session, {at_once}).status().code(), absl::StatusCode::kCancelled);
  EXPECT_EQ(QuerySurface(*session, {at_once}).status().code(), absl::StatusCode::kCancelled);
  EXPECT_EQ(QueryBoundary(*session, EntityKind::kEdge, {at_once}).status().code(),
            absl::StatusCode::kCancelled);
}

TEST(QueriesTest, LongRowsAreTheSameRows) {
  const Limits limits;
  for (const NamedMesh& named : AllMeshes()) {
    SCOPED_TRACE(named.name);
    for (EntityKind from : kEntityKinds) {
      for (EntityKind to : kEntityKinds) {
        QueryBudget budget(limits, {});
        const Relation relation{from, to};
        RowWalk walk(named.mesh, relation, budget, /*long_row=*/0);
        std::vector<Slot> row;
        for (Slot slot : LiveSlots(named.mesh, from)) {
          ASSERT_TRUE(walk.Walk(slot, row).ok());
          std::vector<Slot> expected;
          AppendNeighbors(named.mesh, relation, slot, expected);
          EXPECT_EQ(row, expected) << EntityKindName(from) << " " << slot << " to " << EntityKindName(to);
        }
      }
    }
  }
}

TEST(QueriesTest, AnswersThatWaitAreCounted) {
  Daemon daemon;
  const SessionPtr session = daemon.NewSession();
  MustApply(*session, EditsOf(TetGrid(10, 10, 10)));
  const auto budget = std::make_shared<Budget>("max_answer_bytes", 300'000);
  const auto query = [&](Lease& lease) {
    return QueryEntities(*session, EntityKind::kCell, Range(0, 4000), {StopSignal::Never(), &lease});
  };
  {
    Lease first(budget), second(budget);
    const auto answer = query(first);
    ASSERT_TRUE(answer.ok()) << answer.status();
    EXPECT_GE(first.held(), answer->chunks[0].vertices.size() * sizeof(Slot));
    const auto refused = query(second);
    EXPECT_EQ(RefusalOf(refused), (Refusal{absl::StatusCode::kResourceExhausted, reason::kLimitExceeded}));
    EXPECT_EQ(MetadataOf(refused.status(), "limit"), "max_answer_bytes");
    first.Shrink(first.held());
    EXPECT_TRUE(query(second).ok());
  }
  EXPECT_EQ(budget->used(), 0u);
}

TEST(QueriesTest, SurfaceHasTheBoundaryAndTheFacesThatAreElements) {
  Daemon daemon;
  const SessionPtr session = daemon.NewSession();
  EXPECT_EQ(EncodeSurface(QuerySurface(*session)->surface, 14).status().code(),
            absl::StatusCode::kFailedPrecondition);
  MustApply(*session, EditsOf(HexGrid(2, 1, 1)));
  MustApply(*session,
            {AddVerticesEdit{{{9, 9, 9}}}, AddElementsEdit{ElementType::kTriangle, {0, 1, kNewVertex}}});
  const auto answer = QuerySurface(*session);
  ASSERT_TRUE(answer.ok()) << answer.status();
  EXPECT_EQ(answer->revision, 2);
  const auto surface = DecodeSurface(*EncodeSurface(answer->surface, 14));
  ASSERT_TRUE(surface.ok()) << surface.status();
  EXPECT_EQ(surface->triangles.size(), 10u * 2 + 1);
}

/// Imports an export: elements in the order of their ids.
Mesh Rebuild(const ExportAnswer& answer) {
  Mesh mesh;
  std::map<EntityId, std::pair<ElementType, std::vector<VertexId>>> elements;
  for (const ExportChunk& chunk : answer.chunks) {
    if (const auto* vertices = std::get_if<ExportedVertices>(&chunk)) {
      for (const Point& position : vertices->positions) EXPECT_TRUE(mesh.AddVertex(position).ok());
    }
    if (const auto* block = std::get_if<ExportedElements>(&chunk)) {
      const int k = NumVertices(block->type);
      for (size_t i = 0; i < block->ids.size(); ++i) {
        elements[{KindOf(block->type), block->ids[i]}] = {
            block->type, {block->vertices.begin() + i * k, block->vertices.begin() + (i + 1) * k}};
      }
    }
  }
  for (const auto& [id, element] : elements) EXPECT_EQ(*mesh.AddElement(element.first, element.second), id);
  Commit(mesh);
  return mesh;
}

TEST(ExportTest, AnExportRebuildsTheSession) {
  Daemon daemon;
  int number = 0;
  for (NamedMesh& named : AllMeshes()) {
    SCOPED_TRACE(named.name);
    const SessionPtr session = daemon.NewSession("m" + std::to_string(number++));
    MustApply(*session, EditsOf(named.mesh));
    const auto answer = ExportSession(*session);
    ASSERT_TRUE(answer.ok());
    EXPECT_EQ(answer->revision, 1);
    EXPECT_EQ(Rebuild(*answer).checksum(), ChecksumOf(*session));
  }
}

TEST(ExportTest, AttributesTravelWithTheirIds) {
  Daemon daemon;
  const SessionPtr session = daemon.NewSession();
  const AttributeSpec spec{"t", EntityKind::kFace, AttributeType::kInt32, 1};
  MustApply(*session, AddTet());
  MustApply(*session,
            {AddAttributeEdit{spec}, AddAttributeEdit{{"none", EntityKind::kCell, AttributeType::kInt32, 1}},
             SetAttributeEdit{spec, {2}, {7, 0, 0, 0}}});
  const auto answer = ExportSession(*session);
  ASSERT_TRUE(answer.ok());
  const auto& rows = std::get<ExportedRows>(answer->chunks[2]);
  EXPECT_EQ(rows.spec, spec);
  EXPECT_THAT(rows.ids, ElementsAre(2));
  EXPECT_THAT(rows.rows, ElementsAre(7, 0, 0, 0));
  EXPECT_THAT(std::get<ExportedRows>(answer->chunks[3]).ids, ElementsAre(0));
}

}  // namespace
}  // namespace dynmesh::testing
