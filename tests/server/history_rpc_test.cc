#include "tests/server/server_support.h"

namespace dynmesh::testing {
namespace {

class HistoryRpcTest : public ServerTest {
 protected:
  HistoryRpcTest() { EXPECT_TRUE(CreateSession("mesh").ok()); }

  grpc::Status Undo(const v1::UndoEditsRequest& request, v1::UndoEditsResponse* response) {
    PatientContext context;
    return edits().UndoEdits(&context, request, response);
  }
  grpc::Status Redo(const v1::RedoEditsRequest& request, v1::RedoEditsResponse* response) {
    PatientContext context;
    return edits().RedoEdits(&context, request, response);
  }

  template <typename Request>
  static Request Steps(uint32_t count) {
    Request request;
    request.set_session("mesh");
    request.set_count(count);
    return request;
  }
};

TEST_F(HistoryRpcTest, BatchesAreUndoneAndRedone) {
  for (int i = 0; i < 3; ++i) MustApply(TetBatch("mesh"));
  const std::string last = GetSession("mesh").checksum().SerializeAsString();
  v1::UndoEditsResponse undone;
  ASSERT_TRUE(Undo(Steps<v1::UndoEditsRequest>(2), &undone).ok());
  EXPECT_EQ(undone.revision(), 4);
  EXPECT_EQ(undone.count(), 2u);
  EXPECT_EQ(undone.counts().cells(), 1u);
  EXPECT_EQ(undone.undoable_batches(), 1u);
  EXPECT_EQ(undone.redoable_batches(), 2u);
  const v1::Session session = GetSession("mesh");
  EXPECT_EQ(session.checksum().SerializeAsString(), undone.checksum().SerializeAsString());
  EXPECT_EQ(session.undoable_batches(), 1u);
  EXPECT_EQ(session.redoable_batches(), 2u);
  EXPECT_GT(session.history_bytes(), 0u);
  v1::RedoEditsResponse redone;
  ASSERT_TRUE(Redo(Steps<v1::RedoEditsRequest>(0), &redone).ok());  // one
  EXPECT_EQ(redone.count(), 1u);
  ASSERT_TRUE(Redo(Steps<v1::RedoEditsRequest>(1), &redone).ok());
  EXPECT_EQ(redone.revision(), 6);
  EXPECT_EQ(redone.checksum().SerializeAsString(), last);
  EXPECT_EQ(redone.counts().cells(), 3u);
}

TEST_F(HistoryRpcTest, RefusalsHaveTheirReasonAndChangeNothing) {
  MustApply(TetBatch("mesh"));
  v1::UndoEditsResponse undone;
  v1::RedoEditsResponse redone;
  v1::UndoEditsRequest request = Steps<v1::UndoEditsRequest>(0xffffffffu);
  ExpectError(Undo(request, &undone), grpc::FAILED_PRECONDITION, reason::kNothingToUndo, "available", "1");
  ExpectError(Redo(Steps<v1::RedoEditsRequest>(1), &redone), grpc::FAILED_PRECONDITION,
              reason::kNothingToRedo);
  request.set_count(1);
  request.set_if_revision(7);
  ExpectError(Undo(request, &undone), grpc::ABORTED, reason::kRevisionMismatch, "actual", "1");
  request.set_if_revision(1);
  request.set_request_id(std::string(129, 'r'));
  ExpectError(Undo(request, &undone), grpc::INVALID_ARGUMENT, reason::kBadArgument, "field", "request_id");
  request.set_session("none");
  ExpectError(Undo(request, &undone), grpc::NOT_FOUND, reason::kSessionNotFound);
  EXPECT_EQ(GetSession("mesh").revision(), 1);
}

TEST_F(HistoryRpcTest, LimitsAreTheServers) {
  StartServer(Limits{.max_undo_batches = 1});
  ASSERT_TRUE(CreateSession("mesh").ok());
  for (int i = 0; i < 2; ++i) MustApply(TetBatch("mesh"));
  v1::UndoEditsResponse undone;
  ExpectError(Undo(Steps<v1::UndoEditsRequest>(2), &undone), grpc::FAILED_PRECONDITION,
              reason::kNothingToUndo);
  EXPECT_TRUE(Undo(Steps<v1::UndoEditsRequest>(1), &undone).ok());
}

}  // namespace
}  // namespace dynmesh::testing
