// Backups without gRPC: bytes of a session, and a session of bytes.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cctype>
#include <fstream>
#include <random>
#include <sstream>
#include <thread>
#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "server/session/backup/backup_session.h"
#include "tests/core/archive/archive_support.h"
#include "tests/session/backup_support.h"
#include "tests/session/session_support.h"
#include "tests/support/meshes.h"
#include "tests/support/oracle.h"
#include "tests/support/random_edits.h"

namespace dynmesh::testing {
namespace {

using ::testing::IsEmpty;

/// Reads bytes that come in pieces of some sizes.
absl::StatusOr<Backup> ReadInPieces(absl::string_view bytes, std::mt19937& rng, size_t max_piece) {
  BackupReader reader((Limits()));
  while (!bytes.empty()) {
    const size_t size = std::min(bytes.size(), std::uniform_int_distribution<size_t>(1, max_piece)(rng));
    DYNMESH_RETURN_IF_ERROR(reader.Add(bytes.substr(0, size)));
    bytes.remove_prefix(size);
  }
  return std::move(reader).Finish();
}

// ---- The form ----

/// Lines of the last fence of the document look like "0010  01 02 03  what it is".
std::string ExampleOfDocument() {
  std::ifstream file(DYNMESH_BACKUP_FORMAT_MD);
  std::string bytes;
  for (std::string line; std::getline(file, line);) {
    if (line.size() < 8 || line[4] != ' ' || line[5] != ' ' || !std::isxdigit(line[0])) continue;
    EXPECT_EQ(std::stoul(line.substr(0, 4), nullptr, 16), bytes.size()) << line;
    std::istringstream words(line.substr(6, line.find("  ", 6) - 6));
    for (std::string word; words >> word;) absl::StrAppend(&bytes, absl::HexStringToBytes(word));
  }
  return bytes;
}

TEST(BackupFormatTest, TheDocumentsExampleIsWhatTheCodeWritesAndReads) {
  const std::string bytes = ExampleOfDocument();
  EXPECT_EQ(absl::BytesToHexString(bytes), absl::BytesToHexString(WriteBackup(Identity(), OneTriangle())));
  const auto backup = ReadBackup(bytes);
  ASSERT_TRUE(backup.ok()) << backup.status();
  ExpectIdentical(backup->mesh, OneTriangle());
}

TEST(BackupFormatTest, AnIdentityIsTheSameAgain) {
  BackupIdentity identity = Identity();
  identity.settings.durability = SessionDurability::kNone;
  identity.settings.duplicates = DuplicatePolicy::kRefuse;
  identity.settings.stored_relations = {kStorableRelations[3]};
  ASSERT_TRUE(identity.settings.checks.Set(CheckKind::kMinDihedral, {Severity::kReject, 0.25}).ok());
  const auto backup = ReadBackup(WriteBackup(identity, Mesh()));
  ASSERT_TRUE(backup.ok()) << backup.status();
  EXPECT_EQ(EncodeBackupIdentity(backup->identity), EncodeBackupIdentity(identity));
  EXPECT_EQ(backup->identity.name, "m");
  EXPECT_EQ(backup->identity.uid, "0123456789abcdef");
  EXPECT_EQ(backup->identity.create_time, kCreateTime);
  EXPECT_EQ(backup->identity.commit_time, kCommitTime);
  EXPECT_EQ(backup->identity.settings.durability, SessionDurability::kNone);
}

TEST(BackupFormatTest, ABackupOfANewerFormatIsRefusedAsSuch) {
  std::string bytes = WriteBackup(Identity(), OneTriangle());
  bytes[4] = 2;
  const auto refused = ReadBackup(bytes);
  EXPECT_EQ(RefusalOf(refused), (Refusal{absl::StatusCode::kFailedPrecondition, reason::kBackupFormatNewer}));
  EXPECT_EQ(MetadataOf(refused.status(), "found"), "2");
  EXPECT_EQ(MetadataOf(refused.status(), "supported"), "1");
  bytes[4] = 0;
  EXPECT_EQ(RefusalOf(ReadBackup(bytes)), kDamaged);
}

// ---- What comes back ----

TEST(BackupTest, EveryKindOfMeshComesBackAndGoesOnInTheSameWay) {
  std::mt19937 rng(71);
  for (auto& [name, original] : AllMeshes()) {
    SCOPED_TRACE(name);
    Mesh mesh = std::move(original);
    const auto backup = ReadInPieces(WriteBackup(Identity(), mesh), rng, 700);
    ASSERT_TRUE(backup.ok()) << backup.status();
    ExpectIdentical(backup->mesh, mesh);
  }
}

TEST(BackupTest, ARandomHistoryComesBackToTheLastStampAndGoesOnInTheSameWay) {
  for (uint32_t seed = 1; seed <= 8; ++seed) {
    SCOPED_TRACE(seed);
    const RandomEditOptions options = {.max_vertices = 12, .duplicate_rate = 0.15, .attributes = true};
    Mesh mesh;
    ElementModel model;
    RandomEditor editor(mesh, model, seed, options);
    for (int batch = 0; batch < 30; ++batch) {
      for (int i = editor.Uniform(20); i >= 0; --i) editor.Edit();
      Commit(mesh);
    }
    auto backup = ReadInPieces(WriteBackup(Identity(), mesh), editor.rng(), 5000);
    ASSERT_TRUE(backup.ok()) << backup.status();
    ExpectIdentical(backup->mesh, mesh);
    ElementModel same_model = model;
    RandomEditor first(mesh, model, seed + 100, options);
    RandomEditor second(backup->mesh, same_model, seed + 100, options);
    for (int i = 0; i < 200; ++i) {
      first.Edit();
      second.Edit();
    }
    Commit(mesh);
    Commit(backup->mesh);
    ExpectIdentical(backup->mesh, mesh);
    ASSERT_FALSE(HasFailure());
  }
}

TEST(BackupTest, AMeshOfManyPartsComesBackInAnyPieces) {
  const Mesh mesh = TetGrid(18, 18, 18);
  BackupWriter writer(Identity(), mesh.Clone());
  std::string bytes;
  int pieces = 0;
  for (; !writer.done(); ++pieces) bytes += writer.Next();
  EXPECT_GT(pieces, 5);
  EXPECT_LT(bytes.size(), mesh.memory_bytes() / 3);
  std::mt19937 rng(72);
  for (size_t max_piece : {size_t{1000}, size_t{300'000}, bytes.size()}) {
    const auto backup = ReadInPieces(bytes, rng, max_piece);
    ASSERT_TRUE(backup.ok()) << backup.status();
    EXPECT_EQ(backup->mesh.checksum(), mesh.checksum());
  }
}

// ---- Sessions ----

class BackupSessionTest : public ::testing::Test {
 protected:
  absl::StatusOr<std::string> BackUp(const Session& session, Lease& lease) {
    DYNMESH_ASSIGN_OR_RETURN(SessionBackup backup, BeginBackup(session, lease, [] {}));
    std::string bytes;
    while (!backup.writer->done()) bytes += backup.writer->Next();
    return bytes;
  }

  std::string BackUp(const Session& session) {
    Lease lease;
    const auto bytes = BackUp(session, lease);
    EXPECT_TRUE(bytes.ok()) << bytes.status();
    return bytes.ok() ? *bytes : "";
  }

  absl::StatusOr<SessionInfo> Restore(absl::string_view bytes, const BackupRestoreOptions& options) {
    DYNMESH_ASSIGN_OR_RETURN(Backup backup, ReadBackup(bytes));
    return daemon_.registry().CreateFrom(SeedOf(std::move(backup), options));
  }

  Daemon daemon_;
};

TEST_F(BackupSessionTest, ASessionIsMadeAgainUnderAnotherNameWithItsSettings) {
  SessionSettings settings;
  settings.duplicates = DuplicatePolicy::kRefuse;
  settings.stored_relations = {kStorableRelations[1]};
  ASSERT_TRUE(settings.checks.Set(CheckKind::kMinDihedral, {Severity::kWarn, 0.25}).ok());
  const SessionPtr session = daemon_.NewSession("a", settings);
  MustApply(*session, AddTet());
  MustApply(*session, AddTet());
  const std::string bytes = BackUp(*session);
  EXPECT_EQ(RefusalOf(Restore(bytes, {})).reason, reason::kSessionExists);
  const auto info = Restore(bytes, {.name = "b"});
  ASSERT_TRUE(info.ok()) << info.status();
  const SessionInfo before = *session->Info();
  EXPECT_EQ(info->name, "b");
  EXPECT_NE(info->uid, before.uid);
  EXPECT_EQ(info->revision, 2);
  EXPECT_EQ(info->checksum, before.checksum);
  EXPECT_EQ(info->settings.duplicates, before.settings.duplicates);
  EXPECT_EQ(info->settings.stored_relations, before.settings.stored_relations);
  EXPECT_TRUE(info->settings.checks == before.settings.checks);
  EXPECT_EQ(info->update_time, absl::FromUnixMicros(absl::ToUnixMicros(before.update_time)));
}

TEST_F(BackupSessionTest, WhatIsOnlyValidatedIsDescribedAndNotMade) {
  const SessionPtr session = daemon_.NewSession("a");
  MustApply(*session, AddTet());
  const std::string bytes = BackUp(*session);
  const auto info = Restore(bytes, {.name = "b", .validate_only = true});
  ASSERT_TRUE(info.ok()) << info.status();
  EXPECT_EQ(info->checksum, ChecksumOf(*session));
  EXPECT_THAT(info->etag, IsEmpty());
  EXPECT_EQ(RefusalOf(daemon_.registry().Find("b")).reason, reason::kSessionNotFound);
  EXPECT_EQ(RefusalOf(Restore(bytes, {.name = "a", .validate_only = true})).reason, reason::kSessionExists);
  EXPECT_EQ(
      RefusalOf(Restore(bytes, {.name = "b", .durability = SessionDurability::kSync, .validate_only = true})),
      (Refusal{absl::StatusCode::kFailedPrecondition, reason::kNoStore}));
}

TEST_F(BackupSessionTest, ARetryIsOneOfTheSameBytesAndOptions) {
  const SessionPtr session = daemon_.NewSession("a");
  MustApply(*session, AddTet());
  const std::string bytes = BackUp(*session);
  const auto first = Restore(bytes, {.name = "b", .request_id = "id"});
  ASSERT_TRUE(first.ok()) << first.status();
  EXPECT_EQ(Restore(bytes, {.name = "b", .request_id = "id"})->uid, first->uid);
  const Refusal reused{absl::StatusCode::kInvalidArgument, reason::kRequestIdReused};
  EXPECT_EQ(RefusalOf(Restore(bytes, {.name = "c", .request_id = "id"})), reused);
  MustApply(*session, AddTet());
  EXPECT_EQ(RefusalOf(Restore(BackUp(*session), {.name = "b", .request_id = "id"})), reused);
}

TEST_F(BackupSessionTest, ACopyThatIsMoreThanAllMayTakeIsNotMade) {
  const SessionPtr session = daemon_.NewSession("a");
  MustApply(*session, AddTet());
  const auto budget = std::make_shared<Budget>("max_backup_bytes", 1000);
  Lease lease(budget);
  const auto refused = BackUp(*session, lease);
  EXPECT_EQ(RefusalOf(refused), (Refusal{absl::StatusCode::kResourceExhausted, reason::kLimitExceeded}));
  EXPECT_EQ(MetadataOf(refused.status(), "limit"), "max_backup_bytes");
  EXPECT_EQ(budget->used(), 0u);
}

TEST_F(BackupSessionTest, EditsMeanwhileAreInWhollyOrNotAtAll) {
  const SessionPtr session = daemon_.NewSession("a");
  std::vector<Checksum> checksums = {ChecksumOf(*session)};
  std::vector<std::string> backups;
  std::thread editor([&] {
    for (int i = 0; i < 200; ++i) checksums.push_back(MustApply(*session, AddTet())->checksum);
  });
  for (int i = 0; i < 20; ++i) backups.push_back(BackUp(*session));
  editor.join();
  for (const std::string& bytes : backups) {
    const auto backup = ReadBackup(bytes);
    ASSERT_TRUE(backup.ok()) << backup.status();
    EXPECT_EQ(backup->mesh.checksum(), checksums[backup->mesh.revision()]);
  }
}

}  // namespace
}  // namespace dynmesh::testing
