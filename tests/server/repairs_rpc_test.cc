// RepairSession over gRPC.

#include "dynmesh/v1/repairs.grpc.pb.h"
#include "tests/server/server_support.h"
#include "tests/support/meshes.h"

namespace dynmesh::testing {
namespace {

using ::testing::ElementsAre;

class RepairsRpcTest : public ServerTest {
 protected:
  RepairsRpcTest() : repairs_(v1::RepairService::NewStub(NewChannel())) {
    EXPECT_TRUE(CreateSession("mesh").ok());
    request_.set_session("mesh");
  }

  /// Reads to the end; progress must come before the result.
  grpc::Status Repair(v1::RepairResult* result = nullptr) {
    PatientContext context;
    const auto stream = repairs_->RepairSession(&context, request_);
    v1::RepairSessionResponse response;
    bool has_result = false;
    uint32_t steps_done = 0;
    while (stream->Read(&response)) {
      EXPECT_FALSE(has_result);
      has_result = response.has_result();
      if (has_result && result != nullptr) *result = response.result();
      if (has_result) continue;
      EXPECT_EQ(response.progress().steps_total(), uint32_t(request_.steps_size()));
      EXPECT_GE(response.progress().steps_done(), steps_done);
      steps_done = response.progress().steps_done();
    }
    const grpc::Status status = stream->Finish();
    EXPECT_EQ(has_result, status.ok());
    return status;
  }

  v1::RepairSessionRequest request_;
  std::unique_ptr<v1::RepairService::Stub> repairs_;
};

TEST_F(RepairsRpcTest, FindingsNameWhatWasRepaired) {
  ASSERT_TRUE(Import("mesh", BowTie()).ok());
  request_.add_steps()->mutable_remove_duplicates()->set_isolated_vertices(true);
  request_.add_steps()->mutable_split_non_manifold();
  request_.add_steps()->mutable_weld()->set_tolerance(0);
  request_.set_validate_only(true);
  v1::RepairResult dry, result;
  ASSERT_TRUE(Repair(&dry).ok());
  EXPECT_EQ(dry.revision(), 1);
  EXPECT_EQ(GetSession("mesh").counts().vertices(), 7u);
  request_.set_validate_only(false);
  request_.mutable_steps()->RemoveLast();
  ASSERT_TRUE(Repair(&result).ok());
  EXPECT_EQ(result.revision(), 2);
  ASSERT_EQ(result.steps_size(), 2);
  EXPECT_EQ(result.steps(0).findings_size(), 0);
  ASSERT_EQ(result.steps(1).findings_size(), 2);
  EXPECT_EQ(result.steps(1).findings(0).kind(), v1::REPAIR_FINDING_KIND_SPLIT);
  EXPECT_EQ(result.steps(1).findings(0).count(), 1u);
  EXPECT_THAT(Array<Slot>(result.steps(1).findings(0).ids()), ElementsAre(0));
  EXPECT_EQ(result.steps(1).findings(1).kind(), v1::REPAIR_FINDING_KIND_ADDED);
  EXPECT_THAT(Array<uint8_t>(result.steps(1).findings(1).entity_kinds()),
              ElementsAre(v1::ENTITY_KIND_VERTEX));
  EXPECT_EQ(result.counts().vertices(), 8u);
  EXPECT_EQ(result.checksum().topology(), GetSession("mesh").checksum().topology());
  EXPECT_EQ(dry.steps(2).findings(0).kind(), v1::REPAIR_FINDING_KIND_MERGED);
}

TEST_F(RepairsRpcTest, OptionsArriveAsTheyWereSent) {
  ASSERT_TRUE(Import("mesh", Octahedron()).ok());
  request_.set_validate_only(true);
  const auto count = [&](v1::RepairFindingKind kind) {
    v1::RepairResult result;
    EXPECT_TRUE(Repair(&result).ok());
    uint64_t sum = 0;
    for (const v1::RepairFinding& finding : result.steps(0).findings()) {
      sum += finding.kind() == kind ? finding.count() : 0;
    }
    return sum;
  };
  auto* duplicates = request_.add_steps()->mutable_remove_duplicates();
  EXPECT_EQ(count(v1::REPAIR_FINDING_KIND_DEGENERATE), 0u);
  duplicates->set_max_measure(1e9);
  EXPECT_EQ(count(v1::REPAIR_FINDING_KIND_DEGENERATE), 8u);
  duplicates->set_any_shape(true);
  EXPECT_EQ(count(v1::REPAIR_FINDING_KIND_DEGENERATE), 0u);
  request_.mutable_steps(0)->mutable_weld()->set_tolerance(1e9);
  EXPECT_EQ(count(v1::REPAIR_FINDING_KIND_MERGED), 5u);
  request_.mutable_steps(0)->mutable_orient()->set_by_majority(true);
  EXPECT_EQ(count(v1::REPAIR_FINDING_KIND_REVERSED), 0u);
  request_.mutable_steps(0)->mutable_fill_holes()->set_max_edges(3);
  EXPECT_EQ(count(v1::REPAIR_FINDING_KIND_FILLED), 0u);
}

TEST_F(RepairsRpcTest, BadRequestsAreRefusedByName) {
  request_.add_steps();
  ExpectError(Repair(), grpc::StatusCode::INVALID_ARGUMENT, reason::kBadArgument, "step", "0");
  request_.mutable_steps(0)->mutable_weld()->set_tolerance(-1);
  ExpectError(Repair(), grpc::StatusCode::INVALID_ARGUMENT, reason::kBadArgument, "field", "tolerance");
  request_.mutable_steps(0)->mutable_orient();
  request_.set_if_revision(7);
  ExpectError(Repair(), grpc::StatusCode::ABORTED, reason::kRevisionMismatch, "actual", "0");
  request_.clear_if_revision();
  request_.set_request_id(std::string(200, 'x'));
  ExpectError(Repair(), grpc::StatusCode::INVALID_ARGUMENT, reason::kBadArgument, "field", "request_id");
  request_.clear_request_id();
  request_.set_session("nobody");
  ExpectError(Repair(), grpc::StatusCode::NOT_FOUND, reason::kSessionNotFound);
  request_.set_session("mesh");
  for (int i = 0; i < 30; ++i) request_.add_steps()->mutable_orient();
  ExpectError(Repair(), grpc::StatusCode::INVALID_ARGUMENT, reason::kBadArgument, "field", "steps");
}

TEST_F(RepairsRpcTest, ARetryOfARequestIdIsAnsweredAgain) {
  ASSERT_TRUE(Import("mesh", BowTie()).ok());
  request_.add_steps()->mutable_split_non_manifold();
  request_.set_request_id("once");
  v1::RepairResult first, second;
  ASSERT_TRUE(Repair(&first).ok());
  ASSERT_TRUE(Repair(&second).ok());
  EXPECT_EQ(first.SerializeAsString(), second.SerializeAsString());
  EXPECT_EQ(GetSession("mesh").revision(), 2);
}

TEST_F(RepairsRpcTest, ACancelledRepairLeavesTheSessionToOthers) {
  ASSERT_TRUE(Import("mesh", HexGrid(20, 20, 20)).ok());
  for (int i = 0; i < 10; ++i) request_.add_steps()->mutable_split_non_manifold();
  grpc::ClientContext context;
  const auto stream = repairs_->RepairSession(&context, request_);
  v1::RepairSessionResponse response;
  EXPECT_TRUE(stream->Read(&response));  // it has begun
  context.TryCancel();
  while (stream->Read(&response)) {
  }
  EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::CANCELLED);
  MustApply(TetBatch("mesh"));
  EXPECT_EQ(GetSession("mesh").revision(), 2);
}

}  // namespace
}  // namespace dynmesh::testing
