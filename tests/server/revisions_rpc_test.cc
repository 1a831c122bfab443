// Earlier revisions, forks and snapshots over gRPC and RocksDB.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "dynmesh/v1/history.grpc.pb.h"
#include "tests/server/server_support.h"
#include "tests/store/temporary_directory.h"
#include "tests/support/meshes.h"

namespace dynmesh::testing {
namespace {

using ::testing::ElementsAre;

class RevisionsRpcTest : public ServerTest {
 protected:
  RevisionsRpcTest() { Restart(); }
  ~RevisionsRpcTest() override { StartServer({}); }  // the directory goes first

  void Restart() {
    StartServer({}, directory_.path());
    history_ = v1::HistoryService::NewStub(NewChannel());
  }
  v1::HistoryService::Stub& history() { return *history_; }

  /// Revisions 1 to 3: an import, a tetrahedron, another one.
  void MakeThree() {
    ASSERT_TRUE(CreateSession("mesh").ok());
    ASSERT_TRUE(Import("mesh", TetGrid(2, 2, 2)).ok());
    for (const char* message : {"add one", "add another"}) {
      v1::ApplyEditsRequest batch = TetBatch("mesh");
      batch.mutable_note()->set_author("ann");
      batch.mutable_note()->set_message(message);
      MustApply(batch);
    }
  }

  grpc::Status List(const v1::ListRevisionsRequest& request, v1::ListRevisionsResponse* response) {
    PatientContext context;
    return history().ListRevisions(&context, request, response);
  }

  grpc::Status Restore(const v1::RestoreSessionRequest& request,
                       v1::RestoreSessionResponse* response = nullptr) {
    PatientContext context;
    v1::RestoreSessionResponse ignored;
    return history().RestoreSession(&context, request, response == nullptr ? &ignored : response);
  }

  static v1::RestoreSessionRequest BackTo(int64_t revision) {
    v1::RestoreSessionRequest request;
    request.set_session("mesh");
    request.set_target_revision(revision);
    return request;
  }

  grpc::Status Fork(const v1::ForkSessionRequest& request, v1::ForkSessionResponse* response) {
    PatientContext context;
    return history().ForkSession(&context, request, response);
  }

  static v1::ForkSessionRequest ForkOf(const std::string& source, const std::string& name) {
    v1::ForkSessionRequest request;
    request.set_session(source);
    request.set_name(name);
    return request;
  }

  grpc::Status Snap(const std::string& name, int64_t revision = 0, const std::string& session = "mesh") {
    PatientContext context;
    v1::CreateSnapshotRequest request;
    request.set_session(session);
    request.set_name(name);
    request.set_revision(revision);
    v1::CreateSnapshotResponse response;
    return history().CreateSnapshot(&context, request, &response);
  }

  TemporaryDirectory directory_;
  std::unique_ptr<v1::HistoryService::Stub> history_;
};

bool SameChecksum(const v1::Checksum& a, const v1::Checksum& b) {
  return a.topology() == b.topology() && a.geometry() == b.geometry();
}

TEST_F(RevisionsRpcTest, RevisionsAreListedInPages) {
  MakeThree();
  for (int restarts = 0; restarts < 2; ++restarts) {
    std::vector<std::string> lines;
    v1::ListRevisionsRequest request;
    request.set_session("mesh");
    request.set_page_size(2);
    do {
      v1::ListRevisionsResponse response;
      ASSERT_TRUE(List(request, &response).ok());
      EXPECT_EQ(response.revision(), 3);
      EXPECT_EQ(response.oldest_revision(), 1);
      for (const v1::Revision& each : response.revisions()) {
        lines.push_back(std::to_string(each.revision()) + " " + v1::RevisionKind_Name(each.kind()) + " " +
                        each.note().author() + ": " + each.note().message());
        EXPECT_GT(each.size_bytes(), 0u);
        EXPECT_GT(each.commit_time().seconds(), 0);
      }
      request.set_page_token(response.next_page_token());
    } while (!request.page_token().empty());
    EXPECT_THAT(lines, ElementsAre("3 REVISION_KIND_EDIT ann: add another",
                                   "2 REVISION_KIND_EDIT ann: add one", "1 REVISION_KIND_IMPORT : "));
    Restart();
  }
}

TEST_F(RevisionsRpcTest, ASessionGoesBackAndItsFollowersSeeARevision) {
  MakeThree();
  const v1::Checksum third = GetSession("mesh").checksum();
  v1::RestoreSessionResponse restored;
  ASSERT_TRUE(Restore(BackTo(1), &restored).ok());
  EXPECT_EQ(restored.revision(), 4);
  EXPECT_EQ(restored.target_revision(), 1);
  EXPECT_EQ(restored.durable_revision(), 4);
  EXPECT_EQ(restored.counts().cells(), GetSession("mesh").counts().cells());
  EXPECT_TRUE(SameChecksum(restored.checksum(), GetSession("mesh").checksum()));
  EXPECT_FALSE(SameChecksum(restored.checksum(), third));
  Restart();
  ASSERT_TRUE(Restore(BackTo(3), &restored).ok());
  EXPECT_TRUE(SameChecksum(restored.checksum(), third));
}

TEST_F(RevisionsRpcTest, RequestsThatCannotBeMetAreRefusedAndChangeNothing) {
  MakeThree();
  ExpectError(Restore(BackTo(4)), grpc::StatusCode::OUT_OF_RANGE, "REVISION_IN_FUTURE", "actual", "3");
  ExpectError(Restore(BackTo(-1)), grpc::StatusCode::INVALID_ARGUMENT, "BAD_ARGUMENT", "field", "revision");
  v1::RestoreSessionRequest request;
  request.set_session("mesh");
  ExpectError(Restore(request), grpc::StatusCode::INVALID_ARGUMENT, "BAD_ARGUMENT", "field", "target");
  request.set_snapshot("none");
  ExpectError(Restore(request), grpc::StatusCode::NOT_FOUND, "SNAPSHOT_NOT_FOUND", "snapshot", "none");
  request = BackTo(1);
  request.set_if_revision(2);
  ExpectError(Restore(request), grpc::StatusCode::ABORTED, "REVISION_MISMATCH", "actual", "3");
  request = BackTo(1);
  request.mutable_note()->set_message(std::string(4097, 'm'));
  ExpectError(Restore(request), grpc::StatusCode::INVALID_ARGUMENT, "BAD_ARGUMENT", "field", "note.message");
  v1::ListRevisionsRequest list;
  list.set_session("mesh");
  list.set_page_token("nonsense");
  v1::ListRevisionsResponse listed;
  ExpectError(List(list, &listed), grpc::StatusCode::INVALID_ARGUMENT, "BAD_PAGE_TOKEN");
  list.set_session("none");
  ExpectError(List(list, &listed), grpc::StatusCode::NOT_FOUND, "SESSION_NOT_FOUND");
  request = BackTo(1);
  request.set_validate_only(true);
  v1::RestoreSessionResponse dry;
  ASSERT_TRUE(Restore(request, &dry).ok());
  EXPECT_EQ(dry.revision(), 3);
  EXPECT_EQ(GetSession("mesh").revision(), 3);
}

TEST_F(RevisionsRpcTest, CopiesForGoingBackAndForForksAreLimited) {
  MakeThree();
  Limits limits;
  limits.max_backup_bytes = 1000;
  StartServer(limits, directory_.path());
  history_ = v1::HistoryService::NewStub(NewChannel());
  ExpectError(Restore(BackTo(1)), grpc::StatusCode::RESOURCE_EXHAUSTED, "LIMIT_EXCEEDED", "limit",
              "max_backup_bytes");
  v1::ForkSessionResponse response;
  ExpectError(Fork(ForkOf("mesh", "fork"), &response), grpc::StatusCode::RESOURCE_EXHAUSTED, "LIMIT_EXCEEDED",
              "limit", "max_backup_bytes");
  EXPECT_EQ(GetSession("mesh").revision(), 3);
}

TEST_F(RevisionsRpcTest, ARetryOfGoingBackGetsTheFirstAnswer) {
  MakeThree();
  v1::RestoreSessionRequest request = BackTo(2);
  request.set_request_id("back");
  for (int restarts = 0; restarts < 2; ++restarts) {
    v1::RestoreSessionResponse restored;
    ASSERT_TRUE(Restore(request, &restored).ok());
    EXPECT_EQ(restored.revision(), 4);
    Restart();
  }
  request.set_target_revision(1);
  ExpectError(Restore(request), grpc::StatusCode::INVALID_ARGUMENT, "REQUEST_ID_REUSED");
  EXPECT_EQ(GetSession("mesh").revision(), 4);
}

TEST_F(RevisionsRpcTest, AForkBeginsWithARevisionAndGoesOnAlone) {
  MakeThree();
  v1::ForkSessionRequest request = ForkOf("mesh", "fork");
  request.set_source_revision(2);
  request.set_request_id("fork-1");
  request.mutable_note()->set_message("try something");
  v1::ForkSessionResponse response;
  ASSERT_TRUE(Fork(request, &response).ok());
  EXPECT_EQ(response.revision(), 2);
  EXPECT_EQ(response.session().name(), "fork");
  EXPECT_NE(response.session().uid(), GetSession("mesh").uid());
  EXPECT_EQ(MustApply(TetBatch("fork")).revision(), 3);
  EXPECT_EQ(MustApply(TetBatch("fork")).revision(), 4);
  EXPECT_EQ(GetSession("mesh").revision(), 3);
  Restart();
  v1::ForkSessionResponse again;
  ASSERT_TRUE(Fork(request, &again).ok()) << "a retry";
  EXPECT_EQ(again.session().uid(), response.session().uid());
  EXPECT_EQ(again.revision(), 2);
  request.set_request_id("");
  ExpectError(Fork(request, &again), grpc::StatusCode::ALREADY_EXISTS, "SESSION_EXISTS");
  v1::ListRevisionsRequest list;
  list.set_session("fork");
  v1::ListRevisionsResponse listed;
  ASSERT_TRUE(List(list, &listed).ok());
  ASSERT_EQ(listed.revisions_size(), 3);
  EXPECT_EQ(listed.revisions(2).kind(), v1::REVISION_KIND_CREATION);
  EXPECT_EQ(listed.revisions(2).note().message(), "try something");
}

TEST_F(RevisionsRpcTest, AForkKeepsTheSettingsButTheDurabilityThatItIsGiven) {
  MakeThree();
  v1::ForkSessionRequest request = ForkOf("mesh", "passing");
  request.set_durability(v1::DURABILITY_NONE);
  v1::ForkSessionResponse response;
  ASSERT_TRUE(Fork(request, &response).ok());
  EXPECT_EQ(response.revision(), 3);
  EXPECT_EQ(response.session().settings().durability(), v1::DURABILITY_NONE);
  ExpectError(Snap("a", 0, "passing"), grpc::StatusCode::FAILED_PRECONDITION, "NO_HISTORY", "session",
              "passing");
  v1::ForkSessionRequest second = ForkOf("passing", "kept");
  second.set_durability(v1::DURABILITY_SYNC);
  ASSERT_TRUE(Fork(second, &response).ok()) << "what it is now can be forked";
  Restart();
  EXPECT_TRUE(SameChecksum(GetSession("kept").checksum(), GetSession("mesh").checksum()));
  ExpectError(Fork(ForkOf("mesh", "../x"), &response), grpc::StatusCode::INVALID_ARGUMENT,
              "BAD_SESSION_NAME");
}

TEST_F(RevisionsRpcTest, SnapshotsAreKeptListedAndDeleted) {
  MakeThree();
  ASSERT_TRUE(Snap("before", 2).ok());
  ASSERT_TRUE(Snap("after").ok());
  ExpectError(Snap("after"), grpc::StatusCode::ALREADY_EXISTS, "SNAPSHOT_EXISTS");
  ExpectError(Snap("bad name"), grpc::StatusCode::INVALID_ARGUMENT, "BAD_SNAPSHOT_NAME");
  Restart();
  v1::ListSnapshotsRequest list;
  list.set_session("mesh");
  v1::ListSnapshotsResponse listed;
  PatientContext context;
  ASSERT_TRUE(history().ListSnapshots(&context, list, &listed).ok());
  ASSERT_EQ(listed.snapshots_size(), 2);
  EXPECT_EQ(listed.snapshots(0).name(), "after");
  EXPECT_EQ(listed.snapshots(0).revision(), 3);
  EXPECT_EQ(listed.snapshots(1).revision(), 2);
  v1::RestoreSessionRequest request;
  request.set_session("mesh");
  request.set_snapshot("before");
  v1::RestoreSessionResponse restored;
  ASSERT_TRUE(Restore(request, &restored).ok());
  EXPECT_EQ(restored.target_revision(), 2);
  request.set_request_id("back");
  ASSERT_TRUE(Restore(request, &restored).ok());
  v1::ForkSessionRequest fork = ForkOf("mesh", "fork");
  fork.set_snapshot("before");
  fork.set_request_id("fork");
  v1::ForkSessionResponse forked;
  ASSERT_TRUE(Fork(fork, &forked).ok());
  EXPECT_EQ(forked.revision(), 2);
  v1::DeleteSnapshotRequest deletion;
  deletion.set_session("mesh");
  deletion.set_name("before");
  PatientContext first, second;
  v1::DeleteSnapshotResponse deleted;
  EXPECT_TRUE(history().DeleteSnapshot(&first, deletion, &deleted).ok());
  ExpectError(history().DeleteSnapshot(&second, deletion, &deleted), grpc::StatusCode::NOT_FOUND,
              "SNAPSHOT_NOT_FOUND");
  v1::RestoreSessionResponse again;
  ASSERT_TRUE(Restore(request, &again).ok()) << "a retry needs no snapshot";
  EXPECT_EQ(again.revision(), restored.revision());
  EXPECT_EQ(again.target_revision(), 2);
  EXPECT_TRUE(Fork(fork, &forked).ok());
}

TEST_F(RevisionsRpcTest, RetentionIsASettingThatCanBeChanged) {
  ASSERT_TRUE(CreateSession("mesh").ok());
  v1::UpdateSessionRequest request;
  request.mutable_session()->set_name("mesh");
  request.mutable_update_mask()->add_paths("settings.retention");
  v1::Retention* retention = request.mutable_session()->mutable_settings()->mutable_retention();
  retention->set_max_revisions(7);
  retention->mutable_max_age()->set_seconds(3600);
  retention->mutable_max_age()->set_nanos(500'000'000);
  PatientContext context;
  v1::UpdateSessionResponse response;
  ASSERT_TRUE(sessions().UpdateSession(&context, request, &response).ok());
  Restart();
  const v1::Retention kept = GetSession("mesh").settings().retention();
  EXPECT_EQ(kept.max_revisions(), 7u);
  EXPECT_EQ(kept.max_age().seconds(), 3600);
  EXPECT_EQ(kept.max_age().nanos(), 500'000'000);
  EXPECT_EQ(kept.max_bytes(), 0u);
  retention->mutable_max_age()->set_seconds(-1);
  PatientContext second;
  ExpectError(sessions().UpdateSession(&second, request, &response), grpc::StatusCode::INVALID_ARGUMENT,
              "BAD_ARGUMENT", "field", "retention.max_age");
}

TEST_F(RevisionsRpcTest, ARetryOfAnImportGetsTheFirstAnswerAfterARestart) {
  ASSERT_TRUE(CreateSession("mesh").ok());
  v1::ImportMeshRequest head = ImportHead("mesh");
  head.mutable_header()->set_request_id("import-1");
  const std::vector<v1::ImportMeshRequest> requests = {
      head, ImportPositions(SomePoints(4)), ImportElements(v1::ELEMENT_TYPE_TETRAHEDRON, {0, 1, 2, 3})};
  v1::ImportResult first, again;
  ASSERT_TRUE(ImportRequests(requests, &first).ok());
  MustApply(TetBatch("mesh"));
  Restart();
  ASSERT_TRUE(ImportRequests(requests, &again).ok());
  EXPECT_EQ(again.SerializeAsString(), first.SerializeAsString());
  EXPECT_EQ(GetSession("mesh").revision(), 2);
}

}  // namespace
}  // namespace dynmesh::testing
