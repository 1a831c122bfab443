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
#include "tests/session/session_support.h"
#include "tests/support/meshes.h"
#include "tests/support/oracle.h"
#include "tests/support/random_edits.h"

namespace dynmesh::testing {
namespace {

using ::testing::IsEmpty;

constexpr absl::Time kCreateTime = absl::FromUnixMicros(1'000'000);
constexpr absl::Time kCommitTime = absl::FromUnixMicros(2'000'000);
const Refusal kDamaged{absl::StatusCode::kDataLoss, reason::kBackupDamaged};

BackupIdentity Identity() {
  return {"m", "0123456789abcdef", kCreateTime, kCommitTime, {.durability = SessionDurability::kSync}};
}

std::string WriteBackup(const BackupIdentity& identity, const Mesh& mesh) {
  BackupWriter writer(identity, mesh.Clone());
  std::string bytes;
  while (!writer.done()) bytes += writer.Next();
  EXPECT_EQ(writer.pages_done(), writer.num_pages());
  return bytes;
}

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

absl::StatusOr<Backup> ReadBackup(absl::string_view bytes, const Limits& limits = {}) {
  BackupReader reader(limits);
  DYNMESH_RETURN_IF_ERROR(reader.Add(bytes));
  return std::move(reader).Finish();
}

Mesh OneTriangle() {
  Mesh mesh;
  for (const Point& point : {Point{0, 0, 0}, Point{1, 0, 0}, Point{0, 1, 0}}) {
    EXPECT_TRUE(mesh.AddVertex(point).ok());
  }
  Add(mesh, ElementType::kTriangle, {0, 1, 2});
  Commit(mesh);
  return mesh;
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

// ---- Damage ----

TEST(BackupDamageTest, EveryByteThatIsFlippedIsFound) {
  const std::string bytes = WriteBackup(Identity(), TetWheel(3));
  for (size_t i = 0; i < bytes.size(); ++i) {
    for (int bit = 0; bit < 8; ++bit) {
      std::string damaged = bytes;
      damaged[i] = static_cast<char>(damaged[i] ^ (1 << bit));
      const Refusal refusal = RefusalOf(ReadBackup(damaged));
      if (i == kBackupMagic.size() && refusal.reason == reason::kBackupFormatNewer) continue;
      ASSERT_EQ(refusal, kDamaged) << "byte " << i << " bit " << bit;
    }
  }
}

TEST(BackupDamageTest, EveryTruncationIsFound) {
  const std::string bytes = WriteBackup(Identity(), TetWheel(3));
  for (size_t size = 0; size < bytes.size(); ++size) {
    ASSERT_EQ(RefusalOf(ReadBackup(absl::string_view(bytes).substr(0, size))), kDamaged) << size;
  }
  EXPECT_EQ(RefusalOf(ReadBackup(bytes + "x")), kDamaged);
}

TEST(BackupDamageTest, PartsThatAreSwappedDoubledOrMissingAreFoundWhereTheyAre) {
  BackupWriter writer(Identity(), TetGrid(18, 18, 18));
  std::vector<std::string> pieces;
  while (!writer.done()) pieces.push_back(writer.Next());
  ASSERT_GE(pieces.size(), 5u);
  const auto read = [](const std::vector<std::string>& parts) {
    std::string bytes;
    for (const std::string& part : parts) bytes += part;
    return ReadBackup(bytes).status();
  };
  EXPECT_TRUE(read(pieces).ok());
  for (size_t i = 1; i + 1 < pieces.size(); ++i) {
    std::vector<std::string> swapped = pieces, doubled = pieces, missing = pieces;
    std::swap(swapped[i], swapped[i + 1]);
    doubled.insert(doubled.begin() + i, pieces[i]);
    missing.erase(missing.begin() + i);
    EXPECT_EQ(RefusalOf(read(swapped)), kDamaged) << i;
    EXPECT_EQ(RefusalOf(read(doubled)), kDamaged) << i;
    EXPECT_EQ(RefusalOf(read(missing)), kDamaged) << i;
    EXPECT_EQ(MetadataOf(read(doubled), "part"), absl::StrCat(i + 2)) << i;  // the first piece has two parts
  }
}

/// The parts of a backup, taken apart and sealed again: what an enemy would do.
class Forgery {
 public:
  explicit Forgery(const BackupIdentity& identity) {
    Append("DYNB\x01");
    Add(BackupPart::kIdentity, EncodeBackupIdentity(identity));
  }

  void Add(BackupPart part, absl::string_view content) { Add(part, 0, content.size(), content); }
  void Add(BackupPart part, uint8_t packing, uint64_t size, absl::string_view content) {
    ByteWriter out;
    out.Fixed(part);
    out.Fixed(packing);
    out.Varint(size);
    out.Bytes(content);
    Append(out.bytes());
    ByteWriter seal;
    seal.Fixed<uint64_t>(hash_.value());
    Append(seal.bytes());
    ++parts_;
  }
  void AddPages(const Archive& archive, int times) {
    ByteWriter pages;
    for (int i = 0; i < times; ++i) {
      for (const auto& [id, page] : archive.pages) pages.Text(page);
    }
    Add(BackupPart::kPages, pages.bytes());
  }
  void AddEnd(uint64_t pages) {
    ByteWriter end;
    end.Varint(parts_);
    end.Varint(pages);
    end.Varint(bytes_.size());
    Add(BackupPart::kEnd, end.bytes());
  }
  const std::string& bytes() const { return bytes_; }

 private:
  void Append(absl::string_view bytes) {
    hash_.Add(bytes);
    bytes_.append(bytes.data(), bytes.size());
  }

  RunningHash hash_;
  std::string bytes_;
  uint64_t parts_ = 0;
};

TEST(BackupDamageTest, ForgeriesAreRefused) {
  const Archive archive = Archive::Of(TetWheel(3));
  {
    Forgery sound(Identity());
    sound.Add(BackupPart::kHead, archive.head);
    sound.AddPages(archive, 1);
    sound.AddEnd(archive.pages.size());
    EXPECT_TRUE(ReadBackup(sound.bytes()).ok()) << ReadBackup(sound.bytes()).status();
  }
  {
    Forgery twice(Identity());
    twice.Add(BackupPart::kHead, archive.head);
    twice.AddPages(archive, 2);
    EXPECT_EQ(RefusalOf(ReadBackup(twice.bytes())), kDamaged);
  }
  {
    Forgery one_for_all(Identity());
    Archive first;
    first.pages[archive.pages.begin()->first] = archive.pages.begin()->second;
    one_for_all.Add(BackupPart::kHead, archive.head);
    one_for_all.AddPages(first, static_cast<int>(archive.pages.size()));
    one_for_all.AddEnd(archive.pages.size());
    EXPECT_EQ(RefusalOf(ReadBackup(one_for_all.bytes())), kDamaged);
  }
  {
    Forgery no_pages(Identity());
    no_pages.Add(BackupPart::kHead, archive.head);
    no_pages.AddEnd(0);
    EXPECT_EQ(RefusalOf(ReadBackup(no_pages.bytes())), kDamaged);
  }
  {
    Forgery wrong_counts(Identity());
    wrong_counts.Add(BackupPart::kHead, archive.head);
    wrong_counts.AddPages(archive, 1);
    wrong_counts.AddEnd(archive.pages.size() + 1);
    EXPECT_EQ(RefusalOf(ReadBackup(wrong_counts.bytes())), kDamaged);
  }
  {
    Forgery large(Identity());
    large.Add(BackupPart::kHead, 0, kMaxBackupPartBytes + 1, "");
    EXPECT_EQ(RefusalOf(ReadBackup(large.bytes())), kDamaged);
  }
  {
    Forgery no_frame(Identity());
    no_frame.Add(BackupPart::kHead, 1, archive.head.size(), archive.head);
    EXPECT_EQ(RefusalOf(ReadBackup(no_frame.bytes())), kDamaged);
  }
  BackupIdentity unnamed = Identity();
  unnamed.name = "../etc";
  EXPECT_EQ(RefusalOf(ReadBackup(Forgery(unnamed).bytes())), kDamaged);
}

TEST(BackupDamageTest, ResealedDamageIsRefusedOrHarmless) {
  const Archive archive = Archive::Of(HybridOfFour());
  std::mt19937 rng(73);
  for (int i = 0; i < 3000; ++i) {
    Archive damaged = archive;
    auto page = std::next(damaged.pages.begin(), rng() % damaged.pages.size());
    std::string& bytes = rng() % 3 == 0 ? damaged.head : page->second;
    bytes[6 + rng() % (bytes.size() - 14)] = static_cast<char>(rng());
    bytes = Resealed(bytes);
    Forgery forged(Identity());
    forged.Add(BackupPart::kHead, damaged.head);
    forged.AddPages(damaged, 1);
    forged.AddEnd(damaged.pages.size());
    Limits limits;
    limits.max_session_bytes = 1 << 20;
    const auto backup = ReadBackup(forged.bytes(), limits);
    if (backup.ok()) continue;
    EXPECT_THAT((std::vector{absl::StatusCode::kDataLoss, absl::StatusCode::kResourceExhausted}),
                ::testing::Contains(backup.status().code()))
        << backup.status();
  }
}

TEST(BackupDamageTest, AMeshBeyondTheLimitsIsRefusedWhenItsHeadHasCome) {
  const Mesh mesh = TetGrid(3, 3, 3);
  const Archive archive = Archive::Of(mesh);
  Forgery head(Identity());
  head.Add(BackupPart::kHead, archive.head);
  Limits limits;
  limits.max_cells = 5;
  BackupReader reader(limits);
  const absl::Status refused = reader.Add(head.bytes());
  EXPECT_EQ(RefusalOf(refused), (Refusal{absl::StatusCode::kResourceExhausted, reason::kLimitExceeded}));
  EXPECT_EQ(MetadataOf(refused, "limit"), "max_cells");
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
