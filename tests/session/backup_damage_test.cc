// Backups that were damaged or forged, and what they may take of memory.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/civil_time.h"
#include "core/codec/zstd_frame.h"
#include "core/mesh/validate.h"
#include "server/session/budget.h"
#include "tests/core/archive/archive_support.h"
#include "tests/session/backup_support.h"

namespace dynmesh::testing {
namespace {

using ::testing::IsEmpty;

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
}

bool IsIdentity(const BackupIdentity& identity) {
  BackupIdentity decoded;
  return DecodeBackupIdentity(EncodeBackupIdentity(identity), decoded);
}

TEST(BackupDamageTest, AnIdentityHasANameAUidAndTimesThatClientsCanBeTold) {
  BackupIdentity identity = Identity();
  EXPECT_TRUE(IsIdentity(identity));
  for (const char* name : {"", "../etc", "a\xff"}) {
    identity.name = name;
    EXPECT_FALSE(IsIdentity(identity)) << name;
  }
  identity.name = "m";
  for (const char* uid :
       {"", "0123456789abcde", "0123456789abcdef0", "0123456789abcdeg", "0123456789abcde\xff"}) {
    identity.uid = uid;
    EXPECT_FALSE(IsIdentity(identity)) << uid;
    EXPECT_EQ(RefusalOf(ReadBackup(Forgery(identity).bytes())), kDamaged) << uid;
  }
}

TEST(BackupDamageTest, TheTimesOfAnIdentityAreFrom1970To9999) {
  constexpr absl::Duration kStep = absl::Microseconds(1);
  const absl::Time first = absl::UnixEpoch();
  const absl::Time last = absl::FromCivil(absl::CivilYear(10'000), absl::UTCTimeZone()) - kStep;
  for (absl::Time BackupIdentity::*field : {&BackupIdentity::create_time, &BackupIdentity::commit_time}) {
    BackupIdentity identity = Identity();
    for (absl::Time time : {first, last}) {
      identity.*field = time;
      EXPECT_TRUE(IsIdentity(identity)) << time;
    }
    for (absl::Time time : {first - kStep, last + kStep, absl::InfinitePast(), absl::InfiniteFuture()}) {
      identity.*field = time;
      EXPECT_FALSE(IsIdentity(identity)) << time;
      EXPECT_EQ(RefusalOf(ReadBackup(Forgery(identity).bytes())), kDamaged) << time;
    }
  }
}

/// Fails the test unless the mesh is sound and stays so when it is edited.
void ExpectSound(Mesh mesh) {
  EXPECT_THAT(Validate(mesh), IsEmpty());
  mesh.SetLimits({});  // what was damaged may say that it is full
  mesh.BeginBatch();
  const auto vertex = mesh.AddVertex({7, 7, 7});
  ASSERT_TRUE(vertex.ok()) << vertex.status();
  const Slot other = mesh.slots(EntityKind::kVertex).live().Next(0);
  Add(mesh, ElementType::kWireEdge, {other, vertex->slot()});
  for (EntityKind kind : {EntityKind::kCell, EntityKind::kFace}) {
    const Slot slot = mesh.slots(kind).live().Next(0);
    if (slot == kNoSlot || !mesh.IsElement({kind, slot})) continue;
    EXPECT_TRUE(mesh.RemoveElement({kind, slot}).ok());
  }
  EXPECT_THAT(Validate(mesh), IsEmpty());
  const absl::Status committed = mesh.Commit();
  EXPECT_TRUE(committed.ok() || ErrorReason(committed) == reason::kLimitExceeded) << committed;
}

TEST(BackupDamageTest, ResealedDamageIsRefusedOrHarmless) {
  const Archive archive = Archive::Of(HybridOfFour());
  std::mt19937 rng(73);
  int num_sound = 0;
  for (int i = 0; i < 3000; ++i) {
    SCOPED_TRACE(i);
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
    auto backup = ReadBackup(forged.bytes(), limits);
    if (backup.ok()) {
      ++num_sound;
      ExpectSound(std::move(backup->mesh));
      continue;
    }
    EXPECT_THAT((std::vector{absl::StatusCode::kDataLoss, absl::StatusCode::kResourceExhausted}),
                ::testing::Contains(backup.status().code()))
        << backup.status();
  }
  EXPECT_GT(num_sound, 30);
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

// ---- Memory ----

/// The head of an archive that has as many slots of each kind as ids have room for.
std::string HeadOfHugeMesh() {
  std::string head = EncodeHead(OneTriangle());
  const std::string widths_and_slots("\x03\x04\x04\x03\x03\x01\x00", 7);
  const size_t at = head.find(widths_and_slots);
  EXPECT_NE(at, std::string::npos);
  const MeshLimits most;
  ByteWriter slots;
  for (uint32_t max_slots : most.max_slots) slots.Varint(max_slots);
  return Resealed(head.replace(at + 3, 4, slots.bytes().data(), slots.size()));
}

Limits HugeLimits() {
  Limits limits;
  const MeshLimits most;
  limits.max_vertices = most.max_slots[0];
  limits.max_edges = most.max_slots[1];
  limits.max_faces = most.max_slots[2];
  limits.max_cells = most.max_slots[3];
  limits.max_session_bytes = uint64_t{1} << 60;
  return limits;
}

// Hundreds of gigabytes: who takes them before asking says that memory ran out, or is killed.
TEST(BackupMemoryTest, AForgedHeadIsRefusedBeforeItsMemoryIsTaken) {
  const auto budget = std::make_shared<Budget>("max_staged_bytes", uint64_t{1} << 20);
  Forgery forged(Identity());
  forged.Add(BackupPart::kHead, HeadOfHugeMesh());
  EXPECT_LT(forged.bytes().size(), 300u);
  BackupReader reader(HugeLimits(), Lease(budget));
  const absl::Status refused = reader.Add(forged.bytes());
  EXPECT_EQ(RefusalOf(refused), (Refusal{absl::StatusCode::kResourceExhausted, reason::kLimitExceeded}));
  EXPECT_EQ(MetadataOf(refused, "limit"), "max_staged_bytes");
  EXPECT_EQ(budget->used(), 0u);
  EXPECT_EQ(reader.memory_bytes(), 0u);
}

TEST(BackupMemoryTest, WhatAMeshTakesIsHeldUntilItsReaderIsGone) {
  Mesh mesh = TetGrid(4, 4, 4);
  ASSERT_TRUE(mesh.AddAttribute({"t", EntityKind::kCell, AttributeType::kFloat64, 16}).ok());
  ASSERT_TRUE(mesh.SetAttribute(0, 0, std::vector<uint8_t>(128, 1)).ok());
  Commit(mesh);
  const auto budget = std::make_shared<Budget>("max_staged_bytes", uint64_t{1} << 30);
  {
    BackupReader reader({}, Lease(budget));
    ASSERT_TRUE(reader.Add(WriteBackup(Identity(), mesh)).ok());
    EXPECT_GT(reader.memory_bytes(), uint64_t{100'000});
    EXPECT_EQ(budget->used(), reader.memory_bytes());
    EXPECT_TRUE(std::move(reader).Finish().ok());
    EXPECT_GT(budget->used(), 0u);
  }
  EXPECT_EQ(budget->used(), 0u);
}

TEST(BackupMemoryTest, APartIsUnpackedWhenThereIsRoomForIt) {
  Forgery bomb(Identity());
  const std::string frame = CompressFrame(std::string(kMaxBackupPartBytes, 'x'));
  bomb.Add(BackupPart::kHead, 1, frame.size(), frame);
  EXPECT_LT(bomb.bytes().size(), 10'000u);
  for (const uint64_t max : {kMaxBackupPartBytes - 1, kMaxBackupPartBytes}) {
    const auto budget = std::make_shared<Budget>("max_staged_bytes", max);
    BackupReader reader({}, Lease(budget));
    const absl::Status refused = reader.Add(bomb.bytes());
    if (max == kMaxBackupPartBytes) {
      EXPECT_EQ(RefusalOf(refused), kDamaged);
    } else {
      EXPECT_EQ(MetadataOf(refused, "limit"), "max_staged_bytes");
    }
  }
}

}  // namespace
}  // namespace dynmesh::testing
