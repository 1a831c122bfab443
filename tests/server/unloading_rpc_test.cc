// Sessions that are unloaded while clients use them, over gRPC and RocksDB.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "absl/time/clock.h"
#include "tests/server/server_support.h"
#include "tests/store/temporary_directory.h"
#include "tests/support/meshes.h"

namespace dynmesh::testing {
namespace {

class UnloadingRpcTest : public ServerTest {
 protected:
  UnloadingRpcTest() { Start(absl::ZeroDuration()); }
  ~UnloadingRpcTest() override { StartServer(Limits()); }  // the directory goes first

  void Start(absl::Duration idle_timeout, uint64_t max_loaded_bytes = 0) {
    ServerOptions options;
    options.data_dir = directory_.path();
    options.idle_timeout = idle_timeout;
    options.max_loaded_bytes = max_loaded_bytes;
    StartServerWith(std::move(options));
  }

  v1::SessionState StateOf(const std::string& name) {
    PatientContext context;
    v1::ListSessionsResponse response;
    EXPECT_TRUE(sessions().ListSessions(&context, {}, &response).ok());
    for (const v1::Session& session : response.sessions()) {
      if (session.name() == name) return session.state();
    }
    return v1::SESSION_STATE_UNSPECIFIED;
  }

  void AwaitUnloaded(const std::string& name) {
    const absl::Time deadline = absl::Now() + kPatience;
    while (StateOf(name) != v1::SESSION_STATE_STORED) {
      ASSERT_LT(absl::Now(), deadline) << name << " stays loaded";
      std::this_thread::yield();
    }
  }

  TemporaryDirectory directory_;
};

TEST_F(UnloadingRpcTest, TheServerUnloadsWhatIsIdleAndLoadsWhatIsUsed) {
  Start(absl::Milliseconds(1));
  ASSERT_TRUE(CreateSession("mesh").ok());
  for (int64_t revision = 1; revision <= 3; ++revision) {
    EXPECT_EQ(MustApply(TetBatch("mesh")).revision(), revision);
    const v1::Session loaded = GetSession("mesh");
    AwaitUnloaded("mesh");
    const v1::Session again = GetSession("mesh");
    EXPECT_EQ(again.etag(), loaded.etag());
    EXPECT_EQ(again.checksum().topology(), loaded.checksum().topology());
    EXPECT_EQ(again.state(), v1::SESSION_STATE_LOADED);
  }
}

TEST_F(UnloadingRpcTest, ABudgetThatIsTooSmallUnloadsWhatIsNotUsed) {
  Start(absl::ZeroDuration(), 1);
  for (const char* name : {"a", "b"}) {
    ASSERT_TRUE(CreateSession(name).ok());
    ASSERT_TRUE(Import(name, TetGrid(3, 3, 3)).ok());
  }
  for (const char* name : {"a", "b"}) AwaitUnloaded(name);
  EXPECT_EQ(MustApply(TetBatch("a")).revision(), 2);
}

/// Calls `work` on a thread until this is destroyed.
class Repeatedly {
 public:
  template <typename Fn>
  explicit Repeatedly(Fn work)
      : thread_([this, work] {
          while (!stop_) work();
        }) {}
  ~Repeatedly() {
    stop_ = true;
    thread_.join();
  }

 private:
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

TEST_F(UnloadingRpcTest, NoCallFailsBecauseSessionsAreUnloaded) {
  constexpr int kRounds = 40;
  for (const char* name : {"mesh", "streamed"}) ASSERT_TRUE(CreateSession(name).ok());
  absl::Time now = absl::Now() + absl::Hours(1);
  size_t num_unloaded = 0;
  {
    const Repeatedly unload([&] {
      num_unloaded +=
          server().registry().UnloadIdle(now += absl::Hours(1), {.idle_timeout = absl::ZeroDuration()});
      std::this_thread::yield();
    });
    std::thread streamer([&] {
      for (int round = 0; round < kRounds; ++round) {
        PatientContext context;
        const auto stream = edits().StreamEdits(&context);
        v1::StreamEditsRequest request;
        *request.mutable_batch() = TetBatch("streamed");
        EXPECT_TRUE(stream->Write(request));
        v1::StreamEditsResponse response;
        EXPECT_TRUE(stream->Read(&response));
        EXPECT_EQ(response.applied().revision(), round + 1) << response.error().message();
        stream->WritesDone();
        EXPECT_TRUE(stream->Finish().ok());
      }
    });
    std::thread importer([&] {
      for (int round = 0; round < kRounds; ++round) {
        EXPECT_TRUE(CreateSession("imported").ok());
        const grpc::Status status = Import("imported", TetGrid(2, 2, 2));
        EXPECT_TRUE(status.ok()) << status.error_message();
        EXPECT_EQ(GetSession("imported").counts().cells(), 48u);
        EXPECT_TRUE(DeleteSession("imported").ok());
      }
    });
    for (int round = 0; round < kRounds; ++round) {
      v1::ApplyEditsRequest batch = TetBatch("mesh");
      batch.set_request_id("edit " + std::to_string(round));
      EXPECT_EQ(MustApply(batch).revision(), round + 1);
      EXPECT_EQ(GetSession("mesh").counts().cells(), static_cast<uint64_t>(round) + 1);
      PatientContext context;
      v1::SubscribeRequest request;
      request.set_session("mesh");
      request.set_from_revision(round);
      const auto stream = subscriptions().Subscribe(&context, request);
      v1::SubscribeResponse response;
      EXPECT_TRUE(stream->Read(&response));
      EXPECT_EQ(response.revision(), round + 1);
      context.TryCancel();
      EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::CANCELLED);
      EXPECT_EQ(MustApply(batch).revision(), round + 1) << "a retry";
      EXPECT_NE(StateOf("mesh"), v1::SESSION_STATE_DAMAGED);
    }
    streamer.join();
    importer.join();
  }
  RecordProperty("num_unloaded", static_cast<int>(num_unloaded));
  Start(absl::ZeroDuration());
  EXPECT_EQ(GetSession("mesh").counts().cells(), uint64_t{kRounds});
  EXPECT_EQ(GetSession("streamed").counts().cells(), uint64_t{kRounds});
}

}  // namespace
}  // namespace dynmesh::testing
