// Backups and restores over gRPC.

#include <gmock/gmock.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>
#include <gtest/gtest.h>

#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "dynmesh/v1/backups.grpc.pb.h"
#include "tests/server/server_support.h"
#include "tests/store/temporary_directory.h"
#include "tests/support/meshes.h"

namespace dynmesh::testing {
namespace {

using ::testing::IsEmpty;

v1::RestoreBackupRequest Head(const std::string& name, const std::string& request_id = "") {
  v1::RestoreBackupRequest request;
  request.mutable_header()->set_name(name);
  request.mutable_header()->set_request_id(request_id);
  return request;
}

v1::RestoreBackupRequest Data(const std::string& bytes) {
  v1::RestoreBackupRequest request;
  request.set_data(bytes);
  return request;
}

class BackupRpcTest : public ServerTest {
 protected:
  using Stub = v1::BackupService::Stub;

  /// Over a connection on which little is on its way that was not read.
  std::unique_ptr<Stub> backups() const {
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    arguments.SetInt(GRPC_ARG_HTTP2_BDP_PROBE, 0);
    return v1::BackupService::NewStub(
        grpc::CreateCustomChannel(address(), grpc::InsecureChannelCredentials(), arguments));
  }

  struct BackedUp {
    grpc::Status status;
    v1::Session session;
    std::string bytes;
  };

  BackedUp BackUp(const std::string& session) {
    PatientContext context;
    v1::BackupSessionRequest request;
    request.set_session(session);
    const auto stub = backups();
    const auto stream = stub->BackupSession(&context, request);
    BackedUp backup;
    uint64_t done = 0;
    v1::BackupSessionResponse response;
    for (; stream->Read(&response); done = response.done()) {
      if (response.has_session()) backup.session = response.session();
      backup.bytes += response.data();
      EXPECT_EQ(response.revision(), backup.session.revision());
      EXPECT_GE(response.done(), done);
      EXPECT_LE(response.data().size(), size_t{1} << 20);
    }
    EXPECT_EQ(done, response.total());
    backup.status = stream->Finish();
    return backup;
  }

  std::string MustBackUp(const std::string& session) {
    BackedUp backup = BackUp(session);
    EXPECT_TRUE(backup.status.ok()) << backup.status.error_message();
    return std::move(backup.bytes);
  }

  grpc::Status Restore(const std::vector<v1::RestoreBackupRequest>& requests,
                       v1::RestoreBackupResponse* response = nullptr) {
    PatientContext context;
    v1::RestoreBackupResponse ignored;
    const auto stub = backups();
    const auto stream = stub->RestoreBackup(&context, response == nullptr ? &ignored : response);
    for (const v1::RestoreBackupRequest& request : requests) {
      if (!stream->Write(request)) break;
    }
    stream->WritesDone();
    return stream->Finish();
  }

  static std::vector<v1::RestoreBackupRequest> InPieces(const v1::RestoreBackupRequest& head,
                                                        const std::string& bytes, size_t piece_bytes) {
    std::vector<v1::RestoreBackupRequest> requests = {head};
    for (size_t i = 0; i < bytes.size(); i += piece_bytes)
      requests.push_back(Data(bytes.substr(i, piece_bytes)));
    return requests;
  }

  void MakeSession(const std::string& name, const Mesh& mesh) {
    ASSERT_TRUE(CreateSession(name).ok());
    ASSERT_TRUE(Import(name, mesh, nullptr, 50'000).ok());
  }

  /// Fails the test unless the session was never made.
  void ExpectNone(const std::string& name) {
    ExpectError(DeleteSession(name), grpc::NOT_FOUND, reason::kSessionNotFound);
  }
};

TEST_F(BackupRpcTest, ASessionIsMadeAgainAndGoesOnInTheSameWay) {
  MakeSession("a", TetGrid(6, 6, 6));
  MustApply(TetBatch("a"));
  const BackedUp backup = BackUp("a");
  ASSERT_TRUE(backup.status.ok());
  EXPECT_EQ(backup.session.SerializeAsString(), GetSession("a").SerializeAsString());
  for (size_t piece_bytes : {size_t{100}, size_t{10'000}, size_t{1} << 20}) {
    const std::string name = "b" + std::to_string(piece_bytes);
    v1::RestoreBackupResponse restored;
    ASSERT_TRUE(Restore(InPieces(Head(name), backup.bytes, piece_bytes), &restored).ok());
    EXPECT_EQ(restored.revision(), 2);
    EXPECT_EQ(restored.session().name(), name);
    EXPECT_EQ(restored.source_name(), "a");
    EXPECT_EQ(restored.source_uid(), backup.session.uid());
    EXPECT_NE(restored.session().uid(), backup.session.uid());
    EXPECT_EQ(restored.session().checksum().SerializeAsString(),
              backup.session.checksum().SerializeAsString());
    v1::ApplyEditsRequest batch = TetBatch(name);
    batch.set_as_of_revision(1);
    EXPECT_EQ(MustApply(batch).revision(), 3);
  }
  const v1::ApplyEditsResponse original = MustApply(TetBatch("a"));
  EXPECT_EQ(original.checksum().SerializeAsString(), GetSession("b100").checksum().SerializeAsString());
}

TEST_F(BackupRpcTest, WithoutANameItIsThatOfTheBackupAndAMirrorBeginsAnew) {
  MakeSession("a", OneTet());
  const BackedUp backup = BackUp("a");
  ExpectError(Restore({Head(""), Data(backup.bytes)}), grpc::ALREADY_EXISTS, reason::kSessionExists);
  ASSERT_TRUE(DeleteSession("a").ok());
  ASSERT_TRUE(Restore({Head(""), Data(backup.bytes)}).ok());
  EXPECT_EQ(GetSession("a").revision(), 1);
  PatientContext context;
  v1::SubscribeRequest follow;
  follow.set_session("a");
  follow.set_session_uid(backup.session.uid());
  follow.set_from_revision(1);
  const auto following = subscriptions().Subscribe(&context, follow);
  v1::SubscribeResponse delta;
  EXPECT_FALSE(following->Read(&delta));
  ExpectError(following->Finish(), grpc::ABORTED, reason::kSessionRecreated);
}

TEST_F(BackupRpcTest, AnEmptySessionCanBeBackedUp) {
  ASSERT_TRUE(CreateSession("a").ok());
  ASSERT_TRUE(Restore({Head("b"), Data(MustBackUp("a"))}).ok());
  ExpectStillEmpty("b");
}

TEST_F(BackupRpcTest, SessionsThatAreNotThereCannotBeBackedUp) {
  ExpectError(BackUp("a").status, grpc::NOT_FOUND, reason::kSessionNotFound);
  ExpectError(BackUp("../a").status, grpc::INVALID_ARGUMENT, reason::kBadSessionName);
}

TEST_F(BackupRpcTest, WhileABackupIsReadTheSessionIsEdited) {
  MakeSession("a", TetGrid(36, 36, 36));  // more than is on its way unread
  PatientContext context;
  v1::BackupSessionRequest request;
  request.set_session("a");
  const auto stub = backups();
  const auto stream = stub->BackupSession(&context, request);
  v1::BackupSessionResponse response;
  ASSERT_TRUE(stream->Read(&response));
  const v1::Session session = response.session();
  MustApply(TetBatch("a"));
  ASSERT_TRUE(DeleteSession("a").ok());
  std::vector<v1::RestoreBackupRequest> requests = {Head("b")};
  while (stream->Read(&response)) requests.push_back(Data(response.data()));
  ASSERT_TRUE(stream->Finish().ok());
  v1::RestoreBackupResponse restored;
  ASSERT_TRUE(Restore(requests, &restored).ok());
  EXPECT_EQ(restored.revision(), 1);
  EXPECT_EQ(restored.session().checksum().SerializeAsString(), session.checksum().SerializeAsString());
}

TEST_F(BackupRpcTest, BackupsOfASessionUnderFireAreEachOfOneRevision) {
  MakeSession("a", TetGrid(6, 6, 6));
  std::vector<std::string> checksums = {"", GetSession("a").checksum().SerializeAsString()};
  std::vector<BackedUp> taken;
  std::thread editor([&] {
    for (int i = 0; i < 100; ++i)
      checksums.push_back(MustApply(TetBatch("a")).checksum().SerializeAsString());
  });
  for (int i = 0; i < 5; ++i) taken.push_back(BackUp("a"));
  editor.join();
  for (size_t i = 0; i < taken.size(); ++i) {
    v1::RestoreBackupResponse restored;
    ASSERT_TRUE(Restore({Head("b" + std::to_string(i)), Data(taken[i].bytes)}, &restored).ok());
    EXPECT_EQ(restored.session().checksum().SerializeAsString(), checksums.at(restored.revision()));
    EXPECT_EQ(restored.revision(), taken[i].session.revision());
  }
}

// ---- Refusals ----

TEST_F(BackupRpcTest, WhatIsDamagedIsRefusedAndMakesNothing) {
  MakeSession("a", TetGrid(4, 4, 4));
  const std::string bytes = MustBackUp("a");
  std::string flipped = bytes, newer = bytes;
  flipped[bytes.size() / 2] ^= 1;
  newer[4] = 9;
  ExpectError(Restore({Head("b"), Data(flipped)}), grpc::DATA_LOSS, reason::kBackupDamaged, "part", "2");
  ExpectError(Restore({Head("b"), Data(newer)}), grpc::FAILED_PRECONDITION, reason::kBackupFormatNewer,
              "found", "9");
  ExpectError(Restore({Head("b"), Data(bytes.substr(0, bytes.size() - 1))}), grpc::DATA_LOSS,
              reason::kBackupDamaged);
  ExpectError(Restore({Head("b"), Data(bytes), Data("x")}), grpc::DATA_LOSS, reason::kBackupDamaged);
  ExpectError(Restore({Head("b")}), grpc::DATA_LOSS, reason::kBackupDamaged);
  ExpectNone("b");
}

TEST_F(BackupRpcTest, RequestsAreChecked) {
  MakeSession("a", OneTet());
  const std::string bytes = MustBackUp("a");
  ExpectError(Restore({}), grpc::INVALID_ARGUMENT, reason::kBadArgument, "field", "header");
  ExpectError(Restore({Data(bytes)}), grpc::INVALID_ARGUMENT, reason::kBadArgument, "field", "header");
  ExpectError(Restore({Head("b"), Head("b")}), grpc::INVALID_ARGUMENT, reason::kBadArgument, "field", "data");
  ExpectError(Restore({Head("-")}), grpc::INVALID_ARGUMENT, reason::kBadSessionName);
  ExpectError(Restore({Head("b", std::string(200, 'x'))}), grpc::INVALID_ARGUMENT, reason::kBadArgument,
              "field", "request_id");
  v1::RestoreBackupRequest head = Head("b");
  head.mutable_header()->set_durability(static_cast<v1::Durability>(77));
  ExpectError(Restore({head}), grpc::INVALID_ARGUMENT, reason::kBadArgument, "field", "durability");
  ExpectError(Restore({Head("b"), Data(std::string(Limits().max_message_bytes, 'x'))}),
              grpc::RESOURCE_EXHAUSTED, reason::kLimitExceeded, "limit", "max_message_bytes");
  ExpectNone("b");
}

TEST_F(BackupRpcTest, WhatIsOnlyValidatedIsNotMade) {
  MakeSession("a", OneTet());
  v1::RestoreBackupRequest head = Head("b");
  head.mutable_header()->set_validate_only(true);
  v1::RestoreBackupResponse response;
  ASSERT_TRUE(Restore({head, Data(MustBackUp("a"))}, &response).ok());
  EXPECT_EQ(response.session().counts().cells(), 1u);
  EXPECT_THAT(response.session().etag(), IsEmpty());
  EXPECT_THAT(response.session().uid(), IsEmpty());
  ExpectNone("b");
}

TEST_F(BackupRpcTest, ARetryGetsTheFirstAnswer) {
  MakeSession("a", OneTet());
  const std::string bytes = MustBackUp("a");
  v1::RestoreBackupResponse first, again;
  ASSERT_TRUE(Restore(InPieces(Head("b", "id"), bytes, 50), &first).ok());
  MustApply(TetBatch("b"));
  ASSERT_TRUE(Restore({Head("b", "id"), Data(bytes)}, &again).ok());
  EXPECT_EQ(again.SerializeAsString(), first.SerializeAsString());
  ExpectError(Restore({Head("c", "id"), Data(bytes)}), grpc::INVALID_ARGUMENT, reason::kRequestIdReused);
}

// ---- Limits ----

TEST_F(BackupRpcTest, ABackupThatIsNotReadCountsUntilItsCallEnds) {
  Limits limits;
  limits.max_backup_bytes = 60'000'000;
  StartServer(limits);
  MakeSession("a", TetGrid(36, 36, 36));
  const uint64_t bytes = GetSession("a").memory_bytes();
  ASSERT_LT(bytes, limits.max_backup_bytes);
  ASSERT_GT(2 * bytes, limits.max_backup_bytes);
  PatientContext context;
  v1::BackupSessionRequest request;
  request.set_session("a");
  const auto stub = backups();
  const auto unread = stub->BackupSession(&context, request);
  v1::BackupSessionResponse response;
  ASSERT_TRUE(unread->Read(&response));
  ExpectError(BackUp("a").status, grpc::RESOURCE_EXHAUSTED, reason::kLimitExceeded, "limit",
              "max_backup_bytes");
  context.TryCancel();
  while (unread->Read(&response)) {
  }
  EXPECT_EQ(unread->Finish().error_code(), grpc::CANCELLED);
  const absl::Time end = absl::Now() + kPatience;  // the server learns of it a little later
  BackedUp backup = BackUp("a");
  while (!backup.status.ok() && absl::Now() < end) backup = BackUp("a");
  EXPECT_TRUE(backup.status.ok());
}

TEST_F(BackupRpcTest, TheLimitsAreThoseOfTheServerThatRestores) {
  MakeSession("a", TetGrid(4, 4, 4));
  const std::string bytes = MustBackUp("a");
  Limits few_cells, little_memory, little_staged;
  few_cells.max_cells = 100;
  little_memory.max_session_bytes = 10'000;
  little_staged.max_staged_bytes = 10'000;
  for (const auto& [limits, name] :
       {std::pair(few_cells, "max_cells"), std::pair(little_memory, "max_session_bytes"),
        std::pair(little_staged, "max_staged_bytes")}) {
    StartServer(limits);
    ExpectError(Restore({Head("b"), Data(bytes)}), grpc::RESOURCE_EXHAUSTED, reason::kLimitExceeded, "limit",
                name);
    ExpectNone("b");
  }
}

TEST_F(BackupRpcTest, RestoresCountAsImportsAndThoseThatAreIdleMakeRoom) {
  MakeSession("a", OneTet());
  const std::string bytes = MustBackUp("a");
  Limits limits;
  limits.max_concurrent_imports = 1;
  limits.import_idle_timeout = absl::Milliseconds(300);
  StartServer(limits);
  PatientContext context;
  v1::RestoreBackupResponse response;
  const auto stub = backups();
  const auto idle = stub->RestoreBackup(&context, &response);
  ASSERT_TRUE(idle->Write(Head("b")));
  ExpectError(idle->Finish(), grpc::DEADLINE_EXCEEDED, reason::kImportIdle, "limit", "import_idle_timeout");
  EXPECT_TRUE(Restore({Head("c"), Data(bytes)}).ok());
  limits.import_idle_timeout = absl::Hours(1);
  limits.max_concurrent_imports = 0;
  StartServer(limits);
  ExpectError(Restore({Head("b"), Data(bytes)}), grpc::RESOURCE_EXHAUSTED, reason::kLimitExceeded, "limit",
              "max_concurrent_imports");
}

// ---- Backups that nobody reads ----

/// A backup that is begun and not read, and that its server has let go.
class IdleBackupTest : public BackupRpcTest {
 protected:
  void SetUp() override {
    BackupRpcTest::SetUp();
    limits_.max_backup_bytes = 60'000'000;
    limits_.import_idle_timeout = absl::Milliseconds(300);
    StartServer(limits_);
    ASSERT_NO_FATAL_FAILURE(Import());
    stub_ = backups();
    v1::BackupSessionRequest request;
    request.set_session("a");
    unread_ = stub_->BackupSession(&context_, request);
    ASSERT_TRUE(unread_->Read(&response_));
    ASSERT_GT(2 * response_.session().memory_bytes(), limits_.max_backup_bytes);
    ASSERT_NO_FATAL_FAILURE(AwaitRoom());
  }

  /// Until one is in time.
  void Import() {
    ASSERT_TRUE(CreateSession("a").ok());
    const Mesh mesh = TetGrid(36, 36, 36);
    while (!BackupRpcTest::Import("a", mesh, nullptr, 50'000).ok()) ASSERT_LT(absl::Now(), end_);
  }

  void AwaitRoom() {
    for (whole_ = BackUp("a"); !whole_.status.ok(); whole_ = BackUp("a")) ASSERT_LT(absl::Now(), end_);
  }

  /// The bytes that it still has.
  size_t ReadOn() {
    size_t bytes = 0;
    while (unread_->Read(&response_)) bytes += response_.data().size();
    return bytes;
  }

  const absl::Time end_ = absl::Now() + kPatience;
  Limits limits_;
  BackedUp whole_;  ///< another one
  PatientContext context_;
  v1::BackupSessionResponse response_;
  std::unique_ptr<Stub> stub_;
  std::unique_ptr<grpc::ClientReader<v1::BackupSessionResponse>> unread_;
};

TEST_F(IdleBackupTest, ItMakesRoomAndItsReaderIsTold) {
  EXPECT_LT(ReadOn(), whole_.bytes.size());
  ExpectError(unread_->Finish(), grpc::DEADLINE_EXCEEDED, reason::kImportIdle, "limit",
              "import_idle_timeout");
}

TEST_F(IdleBackupTest, ItsReaderMayCancel) {
  context_.TryCancel();
  ReadOn();
  EXPECT_EQ(unread_->Finish().error_code(), grpc::CANCELLED);
}

TEST_F(IdleBackupTest, ItDoesNotKeepItsServerFromEnding) {
  StartServer(limits_);
  ReadOn();
  EXPECT_FALSE(unread_->Finish().ok());
}

// ---- Ends ----

TEST_F(BackupRpcTest, ARestoreThatIsCancelledMakesNothing) {
  MakeSession("a", TetGrid(4, 4, 4));
  const std::string bytes = MustBackUp("a");
  {
    PatientContext context;
    v1::RestoreBackupResponse response;
    const auto stub = backups();
    const auto stream = stub->RestoreBackup(&context, &response);
    ASSERT_TRUE(stream->Write(Head("b")));
    ASSERT_TRUE(stream->Write(Data(bytes.substr(0, bytes.size() / 2))));
    context.TryCancel();
    EXPECT_EQ(stream->Finish().error_code(), grpc::CANCELLED);
  }
  EXPECT_TRUE(Restore({Head("b"), Data(bytes)}).ok());
}

TEST_F(BackupRpcTest, WhenTheTimeToDrainIsOverBothEnd) {
  MakeSession("a", TetGrid(36, 36, 36));
  PatientContext reading_context, writing_context;
  v1::BackupSessionRequest request;
  request.set_session("a");
  const auto stub = backups();
  const auto reading = stub->BackupSession(&reading_context, request);
  v1::BackupSessionResponse piece;
  ASSERT_TRUE(reading->Read(&piece));
  v1::RestoreBackupResponse response;
  const auto writing = stub->RestoreBackup(&writing_context, &response);
  ASSERT_TRUE(writing->Write(Head("b")));
  server().Drain(absl::ZeroDuration());
  while (reading->Read(&piece)) {
  }
  EXPECT_FALSE(reading->Finish().ok());
  EXPECT_FALSE(writing->Finish().ok());
}

// ---- Durability ----

TEST_F(BackupRpcTest, OneThatIsDurableIsOnDiskWhenItIsRestored) {
  MakeSession("a", TetGrid(4, 4, 4));  // ends with its server
  MustApply(TetBatch("a"));
  const BackedUp backup = BackUp("a");
  v1::RestoreBackupRequest head = Head("b", "id");
  head.mutable_header()->set_durability(v1::DURABILITY_SYNC);
  ExpectError(Restore({head, Data(backup.bytes)}), grpc::FAILED_PRECONDITION, reason::kNoStore);
  const TemporaryDirectory directory;
  StartServer({}, directory.path());
  v1::RestoreBackupResponse restored, again;
  ASSERT_TRUE(Restore({head, Data(backup.bytes)}, &restored).ok());
  EXPECT_EQ(restored.session().durable_revision(), 2);
  StartServer({}, directory.path());
  EXPECT_EQ(GetSession("b").uid(), restored.session().uid());
  EXPECT_EQ(GetSession("b").checksum().SerializeAsString(), backup.session.checksum().SerializeAsString());
  EXPECT_EQ(MustApply(TetBatch("b")).durable_revision(), 3);
  ASSERT_TRUE(Restore({head, Data(backup.bytes)}, &again).ok());
  EXPECT_EQ(again.session().uid(), restored.session().uid());
  EXPECT_EQ(again.revision(), 2);
  // As it was: not durable, although this server could.
  ASSERT_TRUE(Restore({Head("c"), Data(backup.bytes)}, &restored).ok());
  EXPECT_EQ(restored.session().settings().durability(), v1::DURABILITY_NONE);
  const std::string durable_bytes = MustBackUp("b");
  ASSERT_TRUE(Restore({Head("d"), Data(durable_bytes)}, &restored).ok());
  EXPECT_EQ(restored.session().settings().durability(), v1::DURABILITY_SYNC);
  StartServer({});  // the directory goes first
}

}  // namespace
}  // namespace dynmesh::testing
