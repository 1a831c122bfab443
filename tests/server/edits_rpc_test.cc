#include <cmath>
#include <functional>
#include <thread>

#include "tests/server/server_support.h"
#include "tests/support/meshes.h"

namespace dynmesh::testing {
namespace {

using ::testing::ElementsAre;

class EditsRpcTest : public ServerTest {
 protected:
  EditsRpcTest() { EXPECT_TRUE(CreateSession("mesh").ok()); }
};

v1::ApplyEditsRequest RemoveCells(const std::vector<Slot>& ids) {
  v1::ApplyEditsRequest request = Batch("mesh");
  v1::RemoveElements* remove = request.add_edits()->mutable_remove_elements();
  remove->set_kind(v1::ENTITY_KIND_CELL);
  remove->set_ids(Bytes(ids));
  return request;
}

TEST_F(EditsRpcTest, ABatchTellsNewIdsCountsAndChecksum) {
  const v1::ApplyEditsResponse response = MustApply(TetBatch("mesh"));
  EXPECT_EQ(response.revision(), 1);
  ASSERT_EQ(response.results_size(), 2);
  EXPECT_THAT(Array<Slot>(response.results(0).new_ids()), ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(Array<Slot>(response.results(1).new_ids()), ElementsAre(0));
  EXPECT_EQ(response.counts().edges(), 6u);
  const v1::Session session = GetSession("mesh");
  EXPECT_EQ(session.checksum().topology(), response.checksum().topology());
  EXPECT_EQ(session.checksum().geometry(), response.checksum().geometry());
}

TEST_F(EditsRpcTest, AllKindsOfEditsWork) {
  MustApply(TetBatch("mesh"));
  const v1::AttributeSpec spec = Spec("t", v1::ENTITY_KIND_VERTEX, v1::ATTRIBUTE_TYPE_FLOAT64, 0);
  v1::ApplyEditsRequest request = Batch("mesh");
  *request.add_edits()->mutable_add_attribute() = spec;
  v1::AttributeValues* values = request.add_edits()->mutable_set_attribute();
  *values->mutable_spec() = spec;
  values->set_ids(Bytes<Slot>({2}));
  values->set_values(Bytes<double>({1.5}));
  v1::MoveVertices* move = request.add_edits()->mutable_move_vertices();
  move->set_ids(Bytes<Slot>({1, 0}));
  move->set_positions(Bytes<Point>({{5, 6, 7}, {0, 0, 0}}));
  *request.add_edits()->mutable_add_vertices() = AddVerticesMessage({{1, 1, 1}});
  request.add_edits()->mutable_remove_vertices()->set_ids(Bytes<Slot>({0x80000000u}));
  v1::RemoveElements* remove = request.add_edits()->mutable_remove_elements();
  remove->set_kind(v1::ENTITY_KIND_CELL);
  remove->set_ids(Bytes<Slot>({0}));
  const v1::ApplyEditsResponse response = MustApply(request);
  EXPECT_EQ(response.revision(), 2);
  EXPECT_EQ(response.results_size(), 6);
  EXPECT_EQ(response.counts().vertices(), 4u);
  EXPECT_EQ(response.counts().edges(), 0u);
  EXPECT_EQ(GetSession("mesh").attributes(0).components(), 1u);
}

TEST_F(EditsRpcTest, OddElementsAreKeptWithAWarning) {
  MustApply(TetBatch("mesh"));
  v1::ApplyEditsRequest request = Batch("mesh");
  *request.add_edits()->mutable_add_elements() =
      Block(v1::ELEMENT_TYPE_TETRAHEDRON, {0, 1, 2, 3, 0, 1, 2, 2});
  const v1::ApplyEditsResponse response = MustApply(request);
  ASSERT_EQ(response.warnings_size(), 2);
  EXPECT_EQ(response.warnings(0).reason(), "DEGENERATE_ELEMENT");
  EXPECT_EQ(response.warnings(0).kind(), v1::ENTITY_KIND_CELL);
  EXPECT_THAT(Array<Slot>(response.warnings(0).ids()), ElementsAre(2));
  EXPECT_EQ(response.warnings(1).reason(), "DUPLICATE_ELEMENT");
  EXPECT_THAT(Array<Slot>(response.warnings(1).ids()), ElementsAre(1));
  EXPECT_EQ(response.warnings(1).count(), 1u);
}

/// A way to be refused: the batch as it is made, and what the answer says.
struct RefusalCase {
  const char* name;
  std::function<void(v1::ApplyEditsRequest*)> make;
  grpc::StatusCode code;
  const char* reason;
  const char* key;
  const char* value;
};

std::vector<RefusalCase> RefusalCases() {
  const auto attribute = [](const std::string& name, int components = 1) {
    return Spec(name, v1::ENTITY_KIND_VERTEX, v1::ATTRIBUTE_TYPE_FLOAT64, components);
  };
  using R = v1::ApplyEditsRequest;
  const auto ids = [](std::vector<Slot> slots) { return Bytes(slots); };
  return {
      {"removed", [=](R* r) { r->add_edits()->mutable_remove_vertices()->set_ids(ids({4})); },
       grpc::NOT_FOUND, reason::kEntityRemoved, "ids", "4"},
      {"unknown",
       [=](R* r) {
         r->add_edits()->mutable_remove_vertices()->set_ids(ids({5, 99}));
       },
       grpc::NOT_FOUND, reason::kUnknownEntity, "index", "1"},
      {"derived",
       [=](R* r) {
         r->add_edits()->mutable_remove_elements()->set_kind(v1::ENTITY_KIND_FACE);
         r->mutable_edits(0)->mutable_remove_elements()->set_ids(ids({1}));
       },
       grpc::FAILED_PRECONDITION, reason::kNotAnElement, "ids", "1"},
      {"in use", [=](R* r) { r->add_edits()->mutable_remove_vertices()->set_ids(ids({2})); },
       grpc::FAILED_PRECONDITION, reason::kVertexInUse, "ids", "2"},
      {"duplicate",
       [](R* r) {
         *r->add_edits()->mutable_add_elements() = Block(v1::ELEMENT_TYPE_TETRAHEDRON, {1, 0, 3, 2});
       },
       grpc::INVALID_ARGUMENT, reason::kDuplicateElement, "edit", "0"},
      {"not finite",
       [](R* r) {
         *r->add_edits()->mutable_add_vertices() = AddVerticesMessage({{0, 0, 0}, {0, std::nan(""), 0}});
       },
       grpc::INVALID_ARGUMENT, reason::kNonFinite, "index", "1"},
      {"positions cut short", [](R* r) { r->add_edits()->mutable_add_vertices()->set_positions("12345"); },
       grpc::INVALID_ARGUMENT, reason::kBadArrayLength, "field", "positions"},
      {"ids cut short", [](R* r) { r->add_edits()->mutable_remove_vertices()->set_ids("123"); },
       grpc::INVALID_ARGUMENT, reason::kBadArrayLength, "field", "ids"},
      {"half an element",
       [](R* r) {
         *r->add_edits()->mutable_add_elements() = Block(v1::ELEMENT_TYPE_TRIANGLE, {0, 1});
       },
       grpc::INVALID_ARGUMENT, reason::kBadArrayLength, "field", "vertices"},
      {"lengths differ",
       [=](R* r) {
         r->add_edits()->mutable_move_vertices()->set_ids(ids({0, 1}));
         r->mutable_edits(0)->mutable_move_vertices()->set_positions(Bytes<Point>({{0, 0, 0}}));
       },
       grpc::INVALID_ARGUMENT, reason::kBadArrayLength, "edit", "0"},
      {"no type",
       [](R* r) {
         *r->add_edits()->mutable_add_elements() = Block(v1::ELEMENT_TYPE_UNSPECIFIED, {0, 1});
       },
       grpc::INVALID_ARGUMENT, reason::kBadElementType, "edit", "0"},
      {"odd type",
       [](R* r) {
         *r->add_edits()->mutable_add_elements() = Block(static_cast<v1::ElementType>(-9), {0, 1});
       },
       grpc::INVALID_ARGUMENT, reason::kBadElementType, "edit", "0"},
      {"no kind", [=](R* r) { r->add_edits()->mutable_remove_elements()->set_ids(ids({0})); },
       grpc::INVALID_ARGUMENT, reason::kBadEntityKind, "field", "kind"},
      {"vertices are no elements",
       [](R* r) { r->add_edits()->mutable_remove_elements()->set_kind(v1::ENTITY_KIND_VERTEX); },
       grpc::INVALID_ARGUMENT, reason::kBadEntityKind, "field", "kind"},
      {"empty edit",
       [](R* r) {
         *r->add_edits()->mutable_add_vertices() = AddVerticesMessage({{0, 0, 0}});
         r->add_edits();
       },
       grpc::INVALID_ARGUMENT, reason::kBadArgument, "edit", "1"},
      {"attribute name", [=](R* r) { *r->add_edits()->mutable_add_attribute() = attribute("a b"); },
       grpc::INVALID_ARGUMENT, reason::kBadArgument, "edit", "0"},
      {"attribute components", [=](R* r) { *r->add_edits()->mutable_add_attribute() = attribute("a", -1); },
       grpc::INVALID_ARGUMENT, reason::kBadArgument, "edit", "0"},
      {"attribute type",
       [](R* r) {
         *r->add_edits()->mutable_add_attribute() =
             Spec("a", v1::ENTITY_KIND_VERTEX, static_cast<v1::AttributeType>(257), 1);
       },
       grpc::INVALID_ARGUMENT, reason::kBadArgument, "field", "type"},
      {"attribute policy",
       [=](R* r) {
         *r->add_edits()->mutable_add_attribute() = attribute("a");
         r->mutable_edits(0)->mutable_add_attribute()->set_policy(static_cast<v1::AttributePolicy>(257));
       },
       grpc::INVALID_ARGUMENT, reason::kBadArgument, "field", "policy"},
      {"attribute default of another length",
       [=](R* r) {
         *r->add_edits()->mutable_add_attribute() = attribute("a", 2);
         r->mutable_edits(0)->mutable_add_attribute()->set_default_row(Bytes<double>({1}));
       },
       grpc::INVALID_ARGUMENT, reason::kBadArrayLength, "field", "default_row"},
      {"attribute default not finite",
       [=](R* r) {
         *r->add_edits()->mutable_add_attribute() = attribute("a");
         r->mutable_edits(0)->mutable_add_attribute()->set_default_row(
             Bytes<double>({std::numeric_limits<double>::quiet_NaN()}));
       },
       grpc::INVALID_ARGUMENT, reason::kNonFinite, "field", "default_row"},
      {"attribute value of another type",
       [](R* r) {
         v1::AttributeValues* values = r->add_edits()->mutable_set_attribute();
         *values->mutable_spec() = Spec("t", v1::ENTITY_KIND_VERTEX, v1::ATTRIBUTE_TYPE_INT64, 1);
         values->set_ids(Bytes<Slot>({0, 1}));
         values->set_values(Bytes<int64_t>({1, (int64_t{1} << 53) + 1}));
       },
       grpc::INVALID_ARGUMENT, reason::kInexactValue, "index", "1"},
      {"attribute exists", [=](R* r) { *r->add_edits()->mutable_add_attribute() = attribute("t"); },
       grpc::ALREADY_EXISTS, reason::kAttributeExists, "attribute", "t"},
      {"attribute unknown",
       [=](R* r) { *r->add_edits()->mutable_set_attribute()->mutable_spec() = attribute("u"); },
       grpc::NOT_FOUND, reason::kUnknownAttribute, "attribute", "u"},
      {"rows of other components",
       [](R* r) {
         *r->add_edits()->mutable_set_attribute()->mutable_spec() =
             Spec("t", v1::ENTITY_KIND_VERTEX, v1::ATTRIBUTE_TYPE_FLOAT64, 3);
       },
       grpc::INVALID_ARGUMENT, reason::kBadArgument, "field", "components"},
      {"smoothing by nothing",
       [](R* r) {
         r->add_edits()->mutable_smooth_vertices()->set_ids(Bytes<Slot>({0}));
         r->mutable_edits(r->edits_size() - 1)->mutable_smooth_vertices()->set_factor(0);
       },
       grpc::INVALID_ARGUMENT, reason::kBadArgument, "field", "factor"},
      {"future", [](R* r) { r->set_as_of_revision(1000); }, grpc::OUT_OF_RANGE, reason::kRevisionInFuture,
       "actual", "3"},
      {"negative revision", [](R* r) { r->set_as_of_revision(-1); }, grpc::INVALID_ARGUMENT,
       reason::kBadArgument, "field", "as_of_revision"},
      {"conflict",
       [=](R* r) {
         r->set_as_of_revision(2);
         r->set_conflict_policy(v1::CONFLICT_POLICY_TOUCHED);
         r->add_edits()->mutable_remove_vertices()->set_ids(ids({5, 4}));
       },
       grpc::ABORTED, reason::kConflict, "ids", "4"},
      {"conflict with what", [](R* r) { r->set_conflict_policy(v1::CONFLICT_POLICY_TOUCHED); },
       grpc::INVALID_ARGUMENT, reason::kBadArgument, "field", "as_of_revision"},
      {"odd conflict policy", [](R* r) { r->set_conflict_policy(static_cast<v1::ConflictPolicy>(7)); },
       grpc::INVALID_ARGUMENT, reason::kBadArgument, "field", "conflict_policy"},
      {"other revision", [](R* r) { r->set_if_revision(1); }, grpc::ABORTED, reason::kRevisionMismatch,
       "expected", "1"},
      {"long request id", [](R* r) { r->set_request_id(std::string(129, 'r')); }, grpc::INVALID_ARGUMENT,
       reason::kBadArgument, "field", "request_id"},
      {"request id reused", [](R* r) { r->set_request_id("first"); }, grpc::INVALID_ARGUMENT,
       reason::kRequestIdReused, "field", "request_id"},
      {"odd session", [](R* r) { r->set_session("a b"); }, grpc::INVALID_ARGUMENT, reason::kBadSessionName,
       "field", "name"},
  };
}

TEST_F(EditsRpcTest, EachRefusalHasItsReasonAndChangesNothing) {
  ASSERT_TRUE(DeleteSession("mesh").ok());
  ASSERT_TRUE(CreateSession("mesh", v1::DUPLICATE_POLICY_REFUSE).ok());
  v1::ApplyEditsRequest first = TetBatch("mesh");
  first.set_request_id("first");
  MustApply(first);
  v1::ApplyEditsRequest second = Batch("mesh");
  *second.add_edits()->mutable_add_vertices() = AddVerticesMessage(SomePoints(2));
  *second.add_edits()->mutable_add_attribute() =
      Spec("t", v1::ENTITY_KIND_VERTEX, v1::ATTRIBUTE_TYPE_FLOAT64, 1);
  MustApply(second);
  v1::ApplyEditsRequest third = Batch("mesh");
  third.add_edits()->mutable_remove_vertices()->set_ids(Bytes<Slot>({4}));
  const v1::ApplyEditsResponse before = MustApply(third);
  for (const RefusalCase& refusal : RefusalCases()) {
    SCOPED_TRACE(refusal.name);
    v1::ApplyEditsRequest request = Batch("mesh");
    refusal.make(&request);
    ExpectError(Apply(request), refusal.code, refusal.reason, refusal.key, refusal.value);
    const v1::Session after = GetSession("mesh");
    EXPECT_EQ(after.revision(), before.revision());
    EXPECT_EQ(after.checksum().SerializeAsString(), before.checksum().SerializeAsString());
  }
}

TEST_F(EditsRpcTest, ValidateOnlyChangesNothing) {
  v1::ApplyEditsRequest request = TetBatch("mesh");
  request.set_validate_only(true);
  const v1::ApplyEditsResponse would_be = MustApply(request);
  EXPECT_EQ(would_be.revision(), 0);
  EXPECT_EQ(GetSession("mesh").revision(), 0);
  EXPECT_EQ(GetSession("mesh").counts().vertices(), 0u);
  request.set_validate_only(false);
  EXPECT_EQ(MustApply(request).checksum().SerializeAsString(), would_be.checksum().SerializeAsString());
}

TEST_F(EditsRpcTest, ARetryGetsTheFirstAnswer) {
  v1::ApplyEditsRequest request = TetBatch("mesh");
  request.set_request_id("r");
  request.set_if_revision(0);
  const v1::ApplyEditsResponse first = MustApply(request);
  MustApply(TetBatch("mesh"));
  v1::ApplyEditsResponse again = MustApply(request);
  EXPECT_EQ(again.durable_revision(), 2) << "that is of now";
  again.set_durable_revision(first.durable_revision());
  EXPECT_EQ(again.SerializeAsString(), first.SerializeAsString());
  EXPECT_EQ(GetSession("mesh").revision(), 2);
}

TEST_F(EditsRpcTest, ABatchWithoutEditsAnswersWithTheCurrentRevision) {
  MustApply(TetBatch("mesh"));
  EXPECT_EQ(MustApply(Batch("mesh")).revision(), 1);
  EXPECT_EQ(MustApply(Batch("mesh")).counts().cells(), 1u);
}

TEST_F(EditsRpcTest, IdsReadBeforeASlotWasReusedAreRefused) {
  MustApply(TetBatch("mesh"));
  MustApply(RemoveCells({0}));
  v1::ApplyEditsRequest again = Batch("mesh");
  *again.add_edits()->mutable_add_elements() = Block(v1::ELEMENT_TYPE_TETRAHEDRON, {0, 1, 2, 3});
  EXPECT_THAT(Array<Slot>(MustApply(again).results(0).new_ids()), ElementsAre(0));
  v1::ApplyEditsRequest stale = RemoveCells({0});
  stale.set_as_of_revision(1);
  ExpectError(Apply(stale), grpc::NOT_FOUND, reason::kEntityRemoved, "ids", "0");
  stale.set_as_of_revision(3);
  MustApply(stale);
}

TEST_F(EditsRpcTest, LimitsAreNamed) {
  Limits limits;
  limits.max_batch_edits = 3;
  limits.max_batch_items = 100;
  limits.max_vertices = 150;
  limits.max_cells = 1;
  limits.max_message_bytes = 20'000;
  StartServer(limits);
  ASSERT_TRUE(CreateSession("mesh").ok());
  const auto vertices = [](int n) {
    v1::ApplyEditsRequest request = Batch("mesh");
    *request.add_edits()->mutable_add_vertices() = AddVerticesMessage(SomePoints(n));
    return request;
  };
  const auto expect = [&](const v1::ApplyEditsRequest& request, const char* limit) {
    ExpectError(Apply(request), grpc::RESOURCE_EXHAUSTED, reason::kLimitExceeded, "limit", limit);
    EXPECT_EQ(GetSession("mesh").counts().cells(), GetSession("mesh").revision() > 0 ? 1u : 0u);
  };
  v1::ApplyEditsRequest many = Batch("mesh");
  for (int i = 0; i < 4; ++i) many.add_edits();
  expect(many, "max_batch_edits");
  expect(vertices(101), "max_batch_items");
  expect(vertices(900), "max_message_bytes");
  MustApply(TetBatch("mesh"));
  MustApply(vertices(100));
  expect(vertices(47), "max_vertices");
  expect(TetBatch("mesh"), "max_cells");
}

TEST_F(EditsRpcTest, FarTooLargeMessagesAreRefusedByGrpcItself) {
  v1::ApplyEditsRequest request = Batch("mesh");
  request.add_edits()->mutable_add_vertices()->set_positions(std::string(20 << 20, '\0'));
  EXPECT_EQ(Apply(request).error_code(), grpc::RESOURCE_EXHAUSTED);
  EXPECT_EQ(GetSession("mesh").revision(), 0);
}

// ---- StreamEdits ----

v1::StreamEditsRequest Streamed(const v1::ApplyEditsRequest& batch) {
  v1::StreamEditsRequest request;
  *request.mutable_batch() = batch;
  return request;
}

TEST_F(EditsRpcTest, AStreamAnswersEachBatchInOrderAndRefusesInBand) {
  PatientContext context;
  const auto stream = edits().StreamEdits(&context);
  constexpr int kBatches = 50;
  // All are written before the first answer is read: the stream is pipelined.
  for (int i = 0; i < kBatches; ++i) {
    ASSERT_TRUE(stream->Write(Streamed(i % 5 == 4 ? RemoveCells({99999}) : TetBatch("mesh"))));
  }
  ASSERT_TRUE(stream->WritesDone());
  v1::StreamEditsResponse response;
  int64_t revision = 0;
  for (int i = 0; i < kBatches; ++i) {
    ASSERT_TRUE(stream->Read(&response)) << i;
    if (i % 5 != 4) {
      EXPECT_EQ(response.applied().revision(), ++revision);
      continue;
    }
    EXPECT_EQ(response.error().code(), grpc::NOT_FOUND);
    EXPECT_EQ(response.error().reason(), reason::kUnknownEntity);
    EXPECT_EQ(response.error().metadata().at("ids"), "99999");
    EXPECT_EQ(response.error().revision(), revision);
    EXPECT_FALSE(response.error().message().empty());
  }
  EXPECT_FALSE(stream->Read(&response));
  EXPECT_TRUE(stream->Finish().ok());
  EXPECT_EQ(GetSession("mesh").revision(), revision);
}

TEST_F(EditsRpcTest, AStreamServesSeveralSessionsAndEmptyMessages) {
  ASSERT_TRUE(CreateSession("other").ok());
  PatientContext context;
  const auto stream = edits().StreamEdits(&context);
  v1::StreamEditsResponse response;
  ASSERT_TRUE(stream->Write(Streamed(TetBatch("other"))));
  ASSERT_TRUE(stream->Read(&response));
  EXPECT_EQ(response.applied().revision(), 1);
  ASSERT_TRUE(stream->Write(v1::StreamEditsRequest()));
  ASSERT_TRUE(stream->Read(&response));
  EXPECT_EQ(response.error().reason(), reason::kBadSessionName);
  ASSERT_TRUE(stream->Write(Streamed(TetBatch("mesh"))));
  ASSERT_TRUE(stream->Read(&response));
  EXPECT_EQ(response.applied().revision(), 1);
  ASSERT_TRUE(stream->WritesDone());
  EXPECT_FALSE(stream->Read(&response));
  EXPECT_TRUE(stream->Finish().ok());
}

TEST_F(EditsRpcTest, WhatAStreamQueuesIsBoundedAndRefusedInBand) {
  Limits limits;
  limits.max_queued_bytes = 50'000;
  StartServer(limits);
  ASSERT_TRUE(CreateSession("mesh").ok());
  v1::ApplyEditsRequest large = Batch("mesh");
  *large.add_edits()->mutable_add_vertices() = AddVerticesMessage(SomePoints(3000));
  PatientContext context;
  const auto stream = edits().StreamEdits(&context);
  v1::StreamEditsResponse response;
  ASSERT_TRUE(stream->Write(Streamed(TetBatch("mesh"))));
  ASSERT_TRUE(stream->Write(Streamed(large)));
  ASSERT_TRUE(stream->Write(Streamed(TetBatch("mesh"))));
  ASSERT_TRUE(stream->Read(&response));
  EXPECT_EQ(response.applied().revision(), 1);
  ASSERT_TRUE(stream->Read(&response));
  EXPECT_EQ(response.error().code(), grpc::RESOURCE_EXHAUSTED);
  EXPECT_EQ(response.error().metadata().at("limit"), "max_queued_bytes");
  ASSERT_TRUE(stream->Read(&response));
  EXPECT_EQ(response.applied().revision(), 2);
  ASSERT_TRUE(stream->WritesDone());
  EXPECT_TRUE(stream->Finish().ok());
  ExpectError(Apply(large), grpc::RESOURCE_EXHAUSTED, reason::kLimitExceeded, "limit", "max_queued_bytes");
}

TEST_F(EditsRpcTest, AStreamWithoutBatchesEndsWell) {
  PatientContext context;
  const auto stream = edits().StreamEdits(&context);
  ASSERT_TRUE(stream->WritesDone());
  v1::StreamEditsResponse response;
  EXPECT_FALSE(stream->Read(&response));
  EXPECT_TRUE(stream->Finish().ok());
}

TEST_F(EditsRpcTest, ACancelledStreamLeavesTheServerSound) {
  for (int i = 0; i < 20; ++i) {
    PatientContext context;
    const auto stream = edits().StreamEdits(&context);
    stream->Write(Streamed(TetBatch("mesh")));
    if (i % 2 == 0) {
      v1::StreamEditsResponse response;
      stream->Read(&response);
    }
    context.TryCancel();
    EXPECT_EQ(stream->Finish().error_code(), grpc::CANCELLED);
  }
  MustApply(TetBatch("mesh"));
}

TEST_F(EditsRpcTest, EditorsThatInsistOnTheRevisionLoseNothing) {
  constexpr int kEditors = 4, kBatches = 50;
  std::vector<std::thread> editors;
  std::atomic<int> aborted{0};
  for (int i = 0; i < kEditors; ++i) {
    editors.emplace_back([&] {
      const auto stub = v1::EditService::NewStub(NewChannel());
      int64_t revision = 0;
      for (int done = 0; done < kBatches;) {
        PatientContext context;
        v1::ApplyEditsRequest request = TetBatch("mesh");
        request.set_if_revision(revision);
        v1::ApplyEditsResponse response;
        const grpc::Status status = stub->ApplyEdits(&context, request, &response);
        if (status.ok()) {
          revision = response.revision();
          ++done;
          continue;
        }
        const RpcError error = ErrorOf(status);
        ASSERT_EQ(error.reason, reason::kRevisionMismatch);
        revision = std::stoll(error.metadata.at("actual"));
        ++aborted;
      }
    });
  }
  for (std::thread& editor : editors) editor.join();
  const v1::Session session = GetSession("mesh");
  EXPECT_EQ(session.revision(), kEditors * kBatches);
  EXPECT_EQ(session.counts().cells(), uint64_t{kEditors * kBatches});
  std::cout << "aborted " << aborted << "\n";
}

}  // namespace
}  // namespace dynmesh::testing
