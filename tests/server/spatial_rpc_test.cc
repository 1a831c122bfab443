#include <cmath>
#include <limits>

#include "core/spatial/spatial_search.h"
#include "tests/server/server_support.h"
#include "tests/support/meshes.h"

namespace dynmesh::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

/// What arrived, the chunks joined.
struct Rows {
  std::vector<size_t> sizes;
  std::vector<Slot> ids;
  std::vector<double> scores;
};

class SpatialRpcTest : public ServerTest {
 protected:
  SpatialRpcTest() { EXPECT_TRUE(CreateSession("mesh").ok()); }

  /// Reads a stream to its end; `take` gets each chunk.
  template <typename Response, typename Request, typename Take>
  grpc::Status Ask(std::unique_ptr<grpc::ClientReader<Response>> (v1::QueryService::Stub::*rpc)(
                       grpc::ClientContext*, const Request&),
                   Request request, Take take) {
    PatientContext context;
    request.set_session("mesh");
    const auto stream = (queries().*rpc)(&context, request);
    Response response;
    while (stream->Read(&response)) {
      EXPECT_LE(response.ByteSizeLong(), (size_t{1} << 20) + 1000);
      EXPECT_GE(response.revision(), 0);
      take(response);
    }
    return stream->Finish();
  }

  grpc::Status InBox(const v1::FindInBoxRequest& request, std::vector<Slot>* ids = nullptr) {
    return Ask<v1::FindInBoxResponse>(&v1::QueryService::Stub::FindInBox, request, [&](const auto& response) {
      if (ids != nullptr) Append(Array<Slot>(response.ids()), ids);
    });
  }
  grpc::Status Nearest(const v1::FindNearestVerticesRequest& request, Rows* rows = nullptr) {
    return Ask<v1::FindNearestVerticesResponse>(&v1::QueryService::Stub::FindNearestVertices, request,
                                                [&](const auto& response) {
                                                  if (rows != nullptr)
                                                    Join(response, Array<double>(response.distances()), rows);
                                                });
  }
  grpc::Status Locate(const v1::LocatePointsRequest& request, std::vector<Slot>* ids = nullptr) {
    return Ask<v1::LocatePointsResponse>(&v1::QueryService::Stub::LocatePoints, request,
                                         [&](const auto& response) {
                                           if (ids != nullptr) Append(Array<Slot>(response.ids()), ids);
                                         });
  }
  grpc::Status Rays(const v1::CastRaysRequest& request, Rows* rows = nullptr) {
    return Ask<v1::CastRaysResponse>(&v1::QueryService::Stub::CastRays, request, [&](const auto& response) {
      if (rows != nullptr) Join(response, Array<double>(response.parameters()), rows);
    });
  }

  static void Append(const std::vector<Slot>& more, std::vector<Slot>* ids) {
    ids->insert(ids->end(), more.begin(), more.end());
  }
  template <typename Response>
  static void Join(const Response& response, const std::vector<double>& scores, Rows* rows) {
    const auto offsets = Array<uint32_t>(response.offsets());
    for (size_t i = 1; i < offsets.size(); ++i) rows->sizes.push_back(offsets[i] - offsets[i - 1]);
    Append(Array<Slot>(response.ids()), &rows->ids);
    rows->scores.insert(rows->scores.end(), scores.begin(), scores.end());
  }
};

v1::Box BoxMessage(const Point& low, const Point& high) {
  v1::Box box;
  box.set_low(Bytes<Point>({low}));
  box.set_high(Bytes<Point>({high}));
  return box;
}

v1::FindInBoxRequest InBoxRequest(v1::EntityKind kind, const v1::Box& box) {
  v1::FindInBoxRequest request;
  request.set_kind(kind);
  *request.mutable_box() = box;
  return request;
}

v1::FindNearestVerticesRequest NearestRequest(const std::vector<Point>& points, uint32_t count) {
  v1::FindNearestVerticesRequest request;
  request.set_points(Bytes(points));
  request.set_count(count);
  return request;
}

v1::LocatePointsRequest LocateRequest(v1::EntityKind kind, const std::vector<Point>& points,
                                      double tolerance = 0) {
  v1::LocatePointsRequest request;
  request.set_kind(kind);
  request.set_points(Bytes(points));
  request.set_tolerance(tolerance);
  return request;
}

v1::CastRaysRequest RaysRequest(const std::vector<Point>& origins, const std::vector<Point>& directions) {
  v1::CastRaysRequest request;
  request.set_origins(Bytes(origins));
  request.set_directions(Bytes(directions));
  return request;
}

void ExpectInvalid(const grpc::Status& status, const char* why, const char* field, const char* index = "") {
  ExpectError(status, grpc::INVALID_ARGUMENT, why, "field", field);
  EXPECT_EQ(ErrorOf(status).metadata["index"], index);
}

TEST_F(SpatialRpcTest, AnswersAreThoseOfTheMesh) {
  ASSERT_TRUE(Import("mesh", HexGrid(2, 2, 2)).ok());
  std::vector<Slot> ids;
  ASSERT_TRUE(InBox(InBoxRequest(v1::ENTITY_KIND_VERTEX, BoxMessage({0, 0, 0}, {2, 1, 0})), &ids).ok());
  EXPECT_THAT(ids, ElementsAre(0, 1, 2, 3, 4, 5));
  Rows rows;
  ASSERT_TRUE(Nearest(NearestRequest({{2, 2, 3}, {0, 0, 0}}, 2), &rows).ok());
  EXPECT_THAT(rows.sizes, ElementsAre(2, 2));
  EXPECT_THAT(rows.ids, ElementsAre(26, 23, 0, 1));
  EXPECT_THAT(rows.scores, ElementsAre(1, std::sqrt(2.0), 0, 1));
  ids.clear();
  ASSERT_TRUE(Locate(LocateRequest(v1::ENTITY_KIND_CELL, {{1.5, 0.5, 0.5}, {3, 3, 3}}), &ids).ok());
  EXPECT_THAT(ids, ElementsAre(1, kNoSlot));
  ids.clear();
  ASSERT_TRUE(Locate(LocateRequest(v1::ENTITY_KIND_FACE, {{-0.1, 0.5, 0.5}}, 0.2), &ids).ok());
  EXPECT_NE(ids[0], kNoSlot);
  v1::CastRaysRequest request = RaysRequest({{0.2, 0.3, -1}}, {{0, 0, 2}});
  rows = {};
  ASSERT_TRUE(Rays(request, &rows).ok());
  EXPECT_THAT(rows.scores, ElementsAre(0.5));
  request.set_hits(v1::RAY_HITS_ALL);
  request.set_targets(v1::RAY_TARGETS_ANY_FACE);
  rows = {};
  ASSERT_TRUE(Rays(request, &rows).ok());
  EXPECT_THAT(rows.sizes, ElementsAre(3));
  EXPECT_THAT(rows.scores, ElementsAre(0.5, 1, 1.5));
}

TEST_F(SpatialRpcTest, AnEmptySessionAnswersWithOneChunk) {
  int chunks = 0;
  const auto count = [&](const auto&) { ++chunks; };
  EXPECT_TRUE(Ask<v1::LocatePointsResponse>(&v1::QueryService::Stub::LocatePoints,
                                            LocateRequest(v1::ENTITY_KIND_CELL, {}), count)
                  .ok());
  EXPECT_TRUE(
      Ask<v1::CastRaysResponse>(&v1::QueryService::Stub::CastRays, v1::CastRaysRequest(), count).ok());
  EXPECT_TRUE(Ask<v1::FindInBoxResponse>(&v1::QueryService::Stub::FindInBox,
                                         InBoxRequest(v1::ENTITY_KIND_CELL, BoxMessage({0, 0, 0}, {1, 1, 1})),
                                         count)
                  .ok());
  EXPECT_TRUE(Ask<v1::FindNearestVerticesResponse>(&v1::QueryService::Stub::FindNearestVertices,
                                                   v1::FindNearestVerticesRequest(), count)
                  .ok());
  EXPECT_EQ(chunks, 4);
  Rows rows;
  EXPECT_TRUE(Nearest(NearestRequest({{0, 0, 0}}, 3), &rows).ok());
  EXPECT_THAT(rows.sizes, ElementsAre(0));
}

TEST_F(SpatialRpcTest, NumbersThatAreNoneAreRefused) {
  ASSERT_TRUE(Import("mesh", OneTet()).ok());
  for (double bad : {kNan, kInf, -kInf}) {
    const std::vector<Point> points = {{0, 0, 0}, {1, bad, 1}};
    const std::vector<Point> good = {{1, 2, 3}, {4, 5, 6}};
    ExpectInvalid(Nearest(NearestRequest(points, 1)), reason::kNonFinite, "points", "1");
    ExpectInvalid(Locate(LocateRequest(v1::ENTITY_KIND_CELL, points)), reason::kNonFinite, "points", "1");
    ExpectInvalid(Rays(RaysRequest(points, good)), reason::kNonFinite, "origins", "1");
    ExpectInvalid(Rays(RaysRequest(good, points)), reason::kNonFinite, "directions", "1");
    const auto box = InBoxRequest(v1::ENTITY_KIND_CELL, BoxMessage({0, 0, 0}, {1, 1, bad}));
    ExpectInvalid(InBox(box), reason::kNonFinite, "box.high", "0");
    ExpectInvalid(Locate(LocateRequest(v1::ENTITY_KIND_FACE, good, bad)), reason::kNonFinite, "tolerance");
  }
}

TEST_F(SpatialRpcTest, ArraysOfOddLengthAreRefused) {
  v1::FindNearestVerticesRequest nearest;
  nearest.set_points(std::string(25, 'x'));
  ExpectInvalid(Nearest(nearest), reason::kBadArrayLength, "points", "1");
  v1::CastRaysRequest rays = RaysRequest({{0, 0, 0}, {1, 1, 1}}, {{1, 0, 0}});
  ExpectInvalid(Rays(rays), reason::kBadArrayLength, "directions", "1");
  rays.set_directions("short");
  ExpectInvalid(Rays(rays), reason::kBadArrayLength, "directions", "0");
  v1::FindInBoxRequest box;
  box.set_kind(v1::ENTITY_KIND_FACE);
  ExpectInvalid(InBox(box), reason::kBadArrayLength, "box.low", "0");
  *box.mutable_box() = BoxMessage({0, 0, 0}, {1, 1, 1});
  box.mutable_box()->set_high(Bytes<Point>({{1, 1, 1}, {2, 2, 2}}));
  ExpectInvalid(InBox(box), reason::kBadArrayLength, "box.high", "1");
}

TEST_F(SpatialRpcTest, QuestionsThatMakeNoSenseAreRefused) {
  ExpectInvalid(InBox(InBoxRequest(v1::ENTITY_KIND_CELL, BoxMessage({0, 2, 0}, {1, 1, 1}))),
                reason::kBadArgument, "box");
  ExpectInvalid(InBox(InBoxRequest(v1::ENTITY_KIND_UNSPECIFIED, BoxMessage({}, {}))), reason::kBadEntityKind,
                "kind");
  ExpectInvalid(Nearest(NearestRequest({}, 10'001)), reason::kBadArgument, "count");
  ExpectInvalid(Nearest(NearestRequest({}, 0xffffffffu)), reason::kBadArgument, "count");
  ExpectInvalid(Locate(LocateRequest(v1::ENTITY_KIND_EDGE, {})), reason::kBadEntityKind, "kind");
  ExpectInvalid(Locate(LocateRequest(v1::ENTITY_KIND_FACE, {}, -0.5)), reason::kBadArgument, "tolerance");
  ExpectInvalid(Locate(LocateRequest(v1::ENTITY_KIND_CELL, {}, 0.5)), reason::kBadArgument, "tolerance");
  ExpectInvalid(Rays(RaysRequest({{}, {}, {}}, {{1, 0, 0}, {0, 1, 0}, {-0.0, 0, 0}})), reason::kBadArgument,
                "directions", "2");
  v1::CastRaysRequest rays;
  rays.set_hits(static_cast<v1::RayHits>(7));
  ExpectInvalid(Rays(rays), reason::kBadArgument, "hits");
  rays.set_hits(v1::RAY_HITS_ALL);
  rays.set_targets(static_cast<v1::RayTargets>(-1));
  ExpectInvalid(Rays(rays), reason::kBadArgument, "targets");
  ASSERT_TRUE(DeleteSession("mesh").ok());
  ExpectError(Rays(v1::CastRaysRequest()), grpc::NOT_FOUND, reason::kSessionNotFound);
}

TEST_F(SpatialRpcTest, SelectionsMayBeFiltered) {
  ASSERT_TRUE(Import("mesh", HexGrid(3, 3, 3)).ok());
  const auto select = [&](const v1::Selection& selection, std::vector<Slot>* ids) {
    v1::GetEntitiesRequest request;
    request.set_kind(v1::ENTITY_KIND_VERTEX);
    *request.mutable_selection() = selection;
    return Ask<v1::GetEntitiesResponse>(
        &v1::QueryService::Stub::GetEntities, request,
        [&](const auto& response) { Append(Array<Slot>(response.ids()), ids); });
  };
  v1::Selection selection = SelectAll();
  selection.set_boundary_only(true);
  std::vector<Slot> ids;
  ASSERT_TRUE(select(selection, &ids).ok());
  EXPECT_EQ(ids.size(), 64u - 8);
  *selection.mutable_box() = BoxMessage({0, 0, 0}, {1, 1, 1});
  ids.clear();
  ASSERT_TRUE(select(selection, &ids).ok());
  EXPECT_EQ(ids.size(), 7u);
  selection.set_ids(Bytes<Slot>({21, 20, 0, 63}));
  ids.clear();
  ASSERT_TRUE(select(selection, &ids).ok());
  EXPECT_THAT(ids, ElementsAre(20, 0));
  selection.mutable_box()->set_low(Bytes<Point>({{kNan, 0, 0}}));
  ExpectInvalid(select(selection, &ids), reason::kNonFinite, "selection.box.low", "0");
  *selection.mutable_box() = BoxMessage({1, 1, 1}, {0, 0, 0});
  ExpectInvalid(select(selection, &ids), reason::kBadArgument, "selection.box");
}

TEST_F(SpatialRpcTest, NeighborsMayBeRings) {
  ASSERT_TRUE(Import("mesh", HexGrid(5, 1, 1)).ok());
  v1::GetNeighborsRequest request;
  request.set_from(v1::ENTITY_KIND_CELL);
  request.set_to(v1::ENTITY_KIND_CELL);
  *request.mutable_selection() = SelectIds({2});
  const auto neighbors = [&](uint32_t rings, std::vector<Slot>* ids) {
    request.set_rings(rings);
    return Ask<v1::GetNeighborsResponse>(
        &v1::QueryService::Stub::GetNeighbors, request,
        [&](const auto& response) { Append(Array<Slot>(response.neighbors()), ids); });
  };
  std::vector<Slot> ids;
  for (uint32_t rings : {0, 1}) {
    ids.clear();
    ASSERT_TRUE(neighbors(rings, &ids).ok());
    EXPECT_THAT(ids, ElementsAre(1, 3));
  }
  ids.clear();
  ASSERT_TRUE(neighbors(2, &ids).ok());
  EXPECT_THAT(ids, ElementsAre(0, 1, 3, 4));
  ExpectInvalid(neighbors(1001, &ids), reason::kBadArgument, "rings");
  request.set_to(v1::ENTITY_KIND_FACE);
  ExpectInvalid(neighbors(2, &ids), reason::kBadArgument, "rings");
}

TEST_F(SpatialRpcTest, LargeAnswersComeInChunks) {
  const Mesh mesh = TetGrid(25, 25, 25);
  ASSERT_TRUE(Import("mesh", mesh, nullptr, 50'000).ok());
  std::vector<Slot> ids;
  ASSERT_TRUE(InBox(InBoxRequest(v1::ENTITY_KIND_FACE, BoxMessage({0, 0, 0}, {99, 99, 99})), &ids).ok());
  EXPECT_EQ(ids.size(), mesh.NumLive(EntityKind::kFace));
  Rows rows;
  ASSERT_TRUE(Nearest(NearestRequest(std::vector<Point>(40, Point{1, 1, 1}), 9000), &rows).ok());
  EXPECT_EQ(rows.sizes, std::vector<size_t>(40, 9000));
  EXPECT_EQ(rows.ids.size(), 40u * 9000);
  EXPECT_GT(GetSession("mesh").index_bytes(), 28u * mesh.NumLive(EntityKind::kFace));
}

TEST_F(SpatialRpcTest, WorkIsLimited) {
  Limits limits;
  limits.max_query_steps = 100'000;
  StartServer(limits);
  ASSERT_TRUE(CreateSession("mesh").ok());
  MustApply(BookBatch("mesh", 20'000));
  ExpectError(
      Rays(RaysRequest(std::vector<Point>(50, Point{0.5, 0.2, -9}), std::vector<Point>(50, Point{0, 0, 1}))),
      grpc::RESOURCE_EXHAUSTED, reason::kLimitExceeded, "limit", "max_query_steps");
}

TEST_F(SpatialRpcTest, CancelledQueriesLeaveTheServerSound) {
  ASSERT_TRUE(Import("mesh", TetGrid(12, 12, 12)).ok());
  for (int i = 0; i < 20; ++i) {
    PatientContext context;
    v1::FindInBoxRequest request = InBoxRequest(v1::ENTITY_KIND_FACE, BoxMessage({0, 0, 0}, {99, 99, 99}));
    request.set_session("mesh");
    const auto stream = queries().FindInBox(&context, request);
    v1::FindInBoxResponse response;
    if (i % 2 == 0) stream->Read(&response);
    context.TryCancel();
    stream->Finish();
  }
  std::vector<Slot> ids;
  EXPECT_TRUE(Locate(LocateRequest(v1::ENTITY_KIND_CELL, {{99, 99, 99}}), &ids).ok());
  EXPECT_THAT(ids, ElementsAre(kNoSlot));
}

}  // namespace
}  // namespace dynmesh::testing
