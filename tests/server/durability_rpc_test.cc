// Sessions on disk, over gRPC and RocksDB.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>

#include "tests/server/server_support.h"
#include "tests/store/temporary_directory.h"
#include "tests/support/meshes.h"

namespace dynmesh::testing {
namespace {

class DurabilityRpcTest : public ServerTest {
 protected:
  DurabilityRpcTest() { StartServer({}, directory_.path()); }
  ~DurabilityRpcTest() override { StartServer({}); }  // the directory goes first

  void Restart() { StartServer({}, directory_.path()); }

  grpc::Status Create(const std::string& name, v1::Durability durability) {
    PatientContext context;
    v1::CreateSessionRequest request;
    request.set_name(name);
    request.mutable_settings()->set_durability(durability);
    v1::CreateSessionResponse response;
    return sessions().CreateSession(&context, request, &response);
  }

  v1::ListSessionsResponse List() {
    PatientContext context;
    v1::ListSessionsResponse response;
    EXPECT_TRUE(sessions().ListSessions(&context, {}, &response).ok());
    return response;
  }

  static v1::StreamEditsRequest Streamed(const v1::ApplyEditsRequest& batch) {
    v1::StreamEditsRequest request;
    *request.mutable_batch() = batch;
    return request;
  }

  TemporaryDirectory directory_;
};

TEST_F(DurabilityRpcTest, RepliesSayWhatIsOnDisk) {
  ASSERT_TRUE(Create("mesh", v1::DURABILITY_UNSPECIFIED).ok());
  EXPECT_EQ(GetSession("mesh").settings().durability(), v1::DURABILITY_SYNC);
  const v1::ApplyEditsResponse applied = MustApply(TetBatch("mesh"));
  EXPECT_EQ(applied.durable_revision(), 1);
  PatientContext context;
  v1::UndoEditsRequest undo;
  undo.set_session("mesh");
  v1::UndoEditsResponse undone;
  ASSERT_TRUE(edits().UndoEdits(&context, undo, &undone).ok());
  EXPECT_EQ(undone.durable_revision(), 2);
  EXPECT_EQ(GetSession("mesh").durable_revision(), 2);
}

TEST_F(DurabilityRpcTest, AfterARestartASessionIsListedBeforeItIsReadAndServesWhenItIsUsed) {
  ASSERT_TRUE(Create("mesh", v1::DURABILITY_ASYNC).ok());
  ASSERT_TRUE(Import("mesh", TetGrid(4, 4, 4)).ok());
  MustApply(TetBatch("mesh"));
  const v1::Session before = GetSession("mesh");
  Restart();
  const v1::ListSessionsResponse listed = List();
  ASSERT_EQ(listed.sessions_size(), 1);
  EXPECT_EQ(listed.sessions(0).state(), v1::SESSION_STATE_STORED);
  EXPECT_EQ(listed.sessions(0).revision(), before.revision());
  const v1::Session after = GetSession("mesh");
  EXPECT_EQ(after.state(), v1::SESSION_STATE_LOADED);
  EXPECT_EQ(after.uid(), before.uid());
  EXPECT_EQ(after.checksum().topology(), before.checksum().topology());
  EXPECT_EQ(after.checksum().geometry(), before.checksum().geometry());
  EXPECT_EQ(after.counts().faces(), before.counts().faces());
  EXPECT_EQ(MustApply(TetBatch("mesh")).revision(), before.revision() + 1);
}

TEST_F(DurabilityRpcTest, SessionsThatAreNotLoadedAreListedInPagesAmongOthers) {
  std::vector<std::string> names;
  for (const char* name : {"a", "b", "c", "d", "e", "f", "g"}) {
    names.push_back(name);
    ASSERT_TRUE(Create(name, v1::DURABILITY_SYNC).ok());
  }
  Restart();
  GetSession("c");
  GetSession("f");
  std::vector<std::string> listed, loaded;
  v1::ListSessionsRequest request;
  request.set_page_size(2);
  do {
    PatientContext context;
    v1::ListSessionsResponse response;
    ASSERT_TRUE(sessions().ListSessions(&context, request, &response).ok());
    EXPECT_LE(response.sessions_size(), 2);
    for (const v1::Session& session : response.sessions()) {
      listed.push_back(session.name());
      if (session.state() == v1::SESSION_STATE_LOADED) loaded.push_back(session.name());
    }
    request.set_page_token(response.next_page_token());
  } while (!request.page_token().empty());
  EXPECT_EQ(listed, names);
  EXPECT_THAT(loaded, ::testing::ElementsAre("c", "f"));
}

TEST_F(DurabilityRpcTest, ADelayThatIsNoneIsRefused) {
  ServerOptions options;
  options.listen = {"127.0.0.1:0"};
  for (const absl::Duration delay : {absl::Seconds(-1), absl::Seconds(11), absl::InfiniteDuration()}) {
    const TemporaryDirectory directory;
    options.data_dir = directory.path();
    options.async_delay = delay;
    const auto started = Server::Start(options);
    EXPECT_EQ(started.status().code(), absl::StatusCode::kInvalidArgument) << delay;
  }
}

TEST_F(DurabilityRpcTest, AStreamIsAnsweredInOrderAndWhenItsBatchesAreOnDisk) {
  ASSERT_TRUE(Create("mesh", v1::DURABILITY_SYNC).ok());
  PatientContext context;
  const auto stream = edits().StreamEdits(&context);
  constexpr int kBatches = 200;
  std::thread writer([&] {
    for (int i = 0; i < kBatches; ++i) {
      EXPECT_TRUE(stream->Write(Streamed(i % 10 == 9 ? Batch("no such session") : TetBatch("mesh"))));
    }
    EXPECT_TRUE(stream->WritesDone());
  });
  v1::StreamEditsResponse response;
  int64_t revision = 0;
  for (int i = 0; i < kBatches; ++i) {
    ASSERT_TRUE(stream->Read(&response)) << i;
    if (i % 10 == 9) {
      EXPECT_TRUE(response.has_error()) << i;
      continue;
    }
    EXPECT_EQ(response.applied().revision(), ++revision);
    EXPECT_GE(response.applied().durable_revision(), revision);
  }
  writer.join();
  EXPECT_TRUE(stream->Finish().ok());
  Restart();
  EXPECT_EQ(GetSession("mesh").revision(), revision);
}

TEST_F(DurabilityRpcTest, ManyEditorsShareTheDiskAndNothingIsLost) {
  constexpr int kEditors = 16, kBatches = 10;
  constexpr int kSessions = 4;
  for (int i = 0; i < kSessions; ++i) {
    ASSERT_TRUE(Create("mesh" + std::to_string(i), v1::DURABILITY_SYNC).ok());
  }
  std::vector<std::thread> editors;
  for (int i = 0; i < kEditors; ++i) {
    editors.emplace_back([&, name = "mesh" + std::to_string(i % kSessions)] {
      for (int k = 0; k < kBatches; ++k) MustApply(TetBatch(name));
    });
  }
  for (std::thread& editor : editors) editor.join();
  Restart();
  for (int i = 0; i < kSessions; ++i) {
    const v1::Session session = GetSession("mesh" + std::to_string(i));
    EXPECT_EQ(session.revision(), kEditors / kSessions * kBatches);
    EXPECT_EQ(session.counts().cells(), static_cast<uint64_t>(kEditors / kSessions * kBatches));
  }
}

}  // namespace
}  // namespace dynmesh::testing
