// AdaptSession over gRPC: progress and result, revisions that others see, refusals, cancellation.

#include "dynmesh/v1/adapt.grpc.pb.h"
#include "tests/server/server_support.h"
#include "tests/support/meshes.h"

namespace dynmesh::testing {
namespace {

using ::testing::AnyOf;
using ::testing::IsEmpty;

class AdaptRpcTest : public ServerTest {
 protected:
  AdaptRpcTest() { Start({}); }

  void Start(const Limits& limits) {
    StartServer(limits);
    EXPECT_TRUE(CreateSession("mesh").ok());
    adapt_ = v1::AdaptService::NewStub(NewChannel());
  }

  static v1::AdaptSessionRequest Request(double target_length) {
    v1::AdaptSessionRequest request;
    request.set_session("mesh");
    request.set_target_length(target_length);
    return request;
  }

  struct Answer {
    std::vector<v1::AdaptProgress> progress;
    v1::AdaptResult result;
  };

  grpc::Status Adapt(const v1::AdaptSessionRequest& request, Answer* answer = nullptr) {
    PatientContext context;
    const auto stream = adapt_->AdaptSession(&context, request);
    v1::AdaptSessionResponse response;
    while (stream->Read(&response)) {
      if (answer != nullptr && response.has_progress()) answer->progress.push_back(response.progress());
      if (answer != nullptr && response.has_result()) answer->result = response.result();
    }
    return stream->Finish();
  }

  std::vector<std::string> Violations() {
    PatientContext context;
    v1::ValidateSessionRequest request;
    request.set_session("mesh");
    v1::ValidateSessionResponse response;
    EXPECT_TRUE(sessions().ValidateSession(&context, request, &response).ok());
    return {response.violations().begin(), response.violations().end()};
  }

  std::unique_ptr<v1::AdaptService::Stub> adapt_;
};

TEST_F(AdaptRpcTest, TellsProgressThenWhatCameOfIt) {
  ASSERT_TRUE(Import("mesh", TetGrid(2, 2, 2)).ok());
  Answer answer;
  const grpc::Status status = Adapt(Request(0.6), &answer);
  ASSERT_TRUE(status.ok()) << status.error_message();
  ASSERT_FALSE(answer.progress.empty());
  EXPECT_GE(answer.progress[0].revision(), 2);
  EXPECT_EQ(answer.progress[0].pass(), 2);
  EXPECT_GT(answer.progress[0].elements(), 48);
  EXPECT_GT(answer.progress[0].smallest_angle(), 12);
  const v1::AdaptResult& result = answer.result;
  EXPECT_EQ(result.revision(), GetSession("mesh").revision());
  EXPECT_EQ(result.before().elements(), 48);
  EXPECT_NEAR(result.before().smallest_angle(), 45, 1e-9);
  EXPECT_EQ(result.after().elements(), GetSession("mesh").element_counts().cells());
  EXPECT_GT(result.after().share_in_band(), result.before().share_in_band());
  EXPECT_GT(result.splits(), 0);
  EXPECT_THAT(result.end(), AnyOf(v1::ADAPT_END_CONVERGED, v1::ADAPT_END_MAX_PASSES));
  EXPECT_THAT(Violations(), IsEmpty());
}

TEST_F(AdaptRpcTest, RefusalsNameWhatOffends) {
  ASSERT_TRUE(Import("mesh", HexGrid(1, 1, 1)).ok());
  const auto invalid = grpc::StatusCode::INVALID_ARGUMENT;
  ExpectError(Adapt(Request(1)), grpc::StatusCode::FAILED_PRECONDITION, reason::kNotSimplex, "ids", "0");
  ASSERT_TRUE(DeleteSession("mesh").ok());
  ExpectError(Adapt(Request(1)), grpc::StatusCode::NOT_FOUND, reason::kSessionNotFound);
  ASSERT_TRUE(CreateSession("mesh").ok());
  ASSERT_TRUE(Import("mesh", OneTet()).ok());
  ExpectError(Adapt(Request(0)), invalid, reason::kBadArgument, "field", "target_length");
  ExpectError(Adapt(Request(-1)), invalid, reason::kBadArgument, "field", "target_length");
  v1::AdaptSessionRequest request = Request(1);
  request.set_feature_angle(181);
  ExpectError(Adapt(request), invalid, reason::kBadArgument, "field", "feature_angle");
  request = Request(1);
  request.set_min_quality(std::nan(""));
  ExpectError(Adapt(request), invalid, reason::kBadArgument, "field", "min_quality");
  request = Request(1);
  request.set_max_passes(1001);
  ExpectError(Adapt(request), invalid, reason::kBadArgument, "field", "max_passes");
  request = Request(0);
  request.set_size_attribute("none");
  ExpectError(Adapt(request), grpc::StatusCode::NOT_FOUND, reason::kUnknownAttribute, "attribute", "none");
  EXPECT_EQ(GetSession("mesh").revision(), 1);
}

TEST_F(AdaptRpcTest, ACancelledCallLeavesASoundSessionAndItsPlace) {
  Start(Limits{.max_concurrent_adaptations = 1});
  ASSERT_TRUE(Import("mesh", TetGrid(4, 4, 4)).ok());
  PatientContext context;
  v1::AdaptSessionRequest request = Request(0.05);
  request.set_max_elements(2'000'000);
  const auto stream = adapt_->AdaptSession(&context, request);
  v1::AdaptSessionResponse response;
  ASSERT_TRUE(stream->Read(&response));
  EXPECT_TRUE(response.has_progress());
  context.TryCancel();
  while (stream->Read(&response)) {
  }
  EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::CANCELLED);
  EXPECT_GT(GetSession("mesh").revision(), 1);
  EXPECT_THAT(Violations(), IsEmpty());
  const absl::Time deadline = absl::Now() + absl::Seconds(60);
  grpc::Status next;
  do {  // the place is free as soon as the step under way has ended
    v1::AdaptSessionRequest small = Request(0.05);
    small.set_max_elements(1);
    small.set_max_passes(1);
    next = Adapt(small);
  } while (next.error_code() == grpc::StatusCode::RESOURCE_EXHAUSTED && absl::Now() < deadline);
  EXPECT_TRUE(next.ok()) << next.error_message();
}

TEST_F(AdaptRpcTest, MaxElementsEndsTheSplits) {
  ASSERT_TRUE(Import("mesh", TetGrid(2, 2, 2)).ok());
  v1::AdaptSessionRequest request = Request(1e-3);
  request.set_max_elements(500);
  Answer answer;
  ASSERT_TRUE(Adapt(request, &answer).ok());
  EXPECT_EQ(answer.result.end(), v1::ADAPT_END_MAX_ELEMENTS);
  EXPECT_LT(answer.result.after().elements(), 600);
}

TEST_F(AdaptRpcTest, SmoothingIsAnEditLikeOthers) {
  ASSERT_TRUE(Import("mesh", TetGrid(2, 2, 2)).ok());
  v1::ApplyEditsRequest move = Batch("mesh");
  move.add_edits()->mutable_move_vertices()->set_ids(Bytes(std::vector<Slot>{13}));
  move.mutable_edits(0)->mutable_move_vertices()->set_positions(Bytes(std::vector<Point>{{1.4, 1.3, 0.7}}));
  MustApply(move);
  v1::ApplyEditsRequest smooth = Batch("mesh");
  v1::SmoothVertices* vertices = smooth.add_edits()->mutable_smooth_vertices();
  vertices->set_ids(Bytes(std::vector<Slot>{0, 13}));
  vertices->set_iterations(3);
  EXPECT_EQ(MustApply(smooth).results(0).num_moved(), 1);
  vertices->set_factor(2);
  ExpectError(Apply(smooth), grpc::StatusCode::INVALID_ARGUMENT, reason::kBadArgument, "field", "factor");
  vertices->set_factor(1);
  vertices->set_method(static_cast<v1::SmoothMethod>(99));
  ExpectError(Apply(smooth), grpc::StatusCode::INVALID_ARGUMENT, reason::kBadArgument, "field", "method");
}

}  // namespace
}  // namespace dynmesh::testing
