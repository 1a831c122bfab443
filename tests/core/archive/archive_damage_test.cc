// Archives whose bytes were damaged, and such that were damaged and sealed again: an error, or a sound mesh.
//
// DYNMESH_ARCHIVE_MUTATIONS: how many random ones for each mesh (default 3000).

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <cstring>
#include <random>

#include "absl/strings/numbers.h"
#include "absl/strings/str_split.h"
#include "core/mesh/error.h"
#include "core/mesh/validate.h"
#include "tests/core/archive/archive_support.h"
#include "tests/support/meshes.h"
#include "tests/support/rows.h"

namespace dynmesh::testing {
namespace {

const RebuildOptions kBounded = {.max_memory_bytes = 64 << 20};

int NumMutations() {
  const char* mutations = std::getenv("DYNMESH_ARCHIVE_MUTATIONS");
  return mutations != nullptr ? std::atoi(mutations) : 3000;
}

/// A head, pages and two records of a small mesh with everything: duplicates, degenerates, columns, free
/// slots.
Archive WithRecords(Mesh mesh) {
  AttributeSpec spec{"t", EntityKind::kVertex, AttributeType::kFloat32, 2};
  EXPECT_TRUE(mesh.AddAttribute(spec).ok());
  EXPECT_TRUE(mesh.SetAttribute(0, 1, RowOf({1.0f, 2.0f})).ok());
  Commit(mesh);
  ArchiveKeeper keeper(mesh);
  mesh.BeginBatch();
  AddVertices(mesh, 2);
  Add(mesh, ElementType::kTriangle, {0, 1, 2});
  Add(mesh, ElementType::kTriangle, {1, 0, 2});
  Add(mesh, ElementType::kWireEdge, {3, 3});
  keeper.Keep(mesh);
  Commit(mesh);
  mesh.BeginBatch();
  spec.kind = EntityKind::kFace;
  EXPECT_TRUE(mesh.AddAttribute(spec).ok());
  EXPECT_TRUE(mesh.SetAttribute(1, 0, RowOf({3.0f, 4.0f})).ok());
  for (EntityKind kind : {EntityKind::kCell, EntityKind::kFace}) {
    const Slot slot = mesh.slots(kind).live().Next(0);
    if (slot == kNoSlot || !mesh.IsElement({kind, slot})) continue;
    EXPECT_TRUE(mesh.RemoveElement({kind, slot}).ok());
    break;
  }
  keeper.Keep(mesh);
  Commit(mesh);
  return keeper.archive();
}

std::vector<std::string*> PartsOf(Archive& archive) {
  std::vector<std::string*> parts = {&archive.head};
  for (auto& [id, page] : archive.pages) parts.push_back(&page);
  for (std::string& record : archive.records) parts.push_back(&record);
  return parts;
}

bool IsRefusal(const absl::Status& status) {
  return !status.ok() && (ErrorReason(status) == reason::kArchiveDamaged ||
                          ErrorReason(status) == reason::kArchiveFormatNewer ||
                          ErrorReason(status) == reason::kLimitExceeded);
}

/// Writes checksum and counts that an error tells into the last record, as a forger would.
bool ForgeFit(const absl::Status& status, std::string& record) {
  const auto detail = GetErrorDetail(status);
  if (!detail.has_value() || detail->Find("topology").empty()) return false;
  constexpr size_t kChecksumAt = 7;  // the revision is one byte
  uint64_t sums[2];
  if (!absl::SimpleAtoi(detail->Find("topology"), &sums[0])) return false;
  if (!absl::SimpleAtoi(detail->Find("geometry"), &sums[1])) return false;
  std::memcpy(record.data() + kChecksumAt, sums, sizeof(sums));
  size_t at = kChecksumAt + sizeof(sums);
  for (absl::string_view count : absl::StrSplit(detail->Find("counts"), ',')) {
    uint32_t value = 0;
    if (!absl::SimpleAtoi(count, &value) || value > 127) return false;
    record[at++] = static_cast<char>(value);
  }
  record = Resealed(record);
  return true;
}

/// Counts what became of archives.
struct Outcomes {
  int refused = 0;
  int sound = 0;
};

/// Fails the test unless the archive is refused or gives a sound mesh; tells forged checksums, too.
void ExpectRefusedOrSound(Archive archive, Outcomes& outcomes) {
  absl::StatusOr<Mesh> mesh = Rebuild(archive, 0, kBounded);
  if (!mesh.ok() && ForgeFit(mesh.status(), archive.records.back())) mesh = Rebuild(archive, 0, kBounded);
  if (!mesh.ok()) {
    ++outcomes.refused;
    EXPECT_TRUE(IsRefusal(mesh.status())) << mesh.status();
    return;
  }
  ++outcomes.sound;
  EXPECT_THAT(Validate(*mesh), ::testing::IsEmpty());
}

class ArchiveDamageTest : public ::testing::Test {
 protected:
  /// Meshes whose counts fit into a byte of the format.
  static std::vector<NamedMesh> SmallMeshes() {
    std::vector<NamedMesh> meshes = AllMeshes();
    std::erase_if(meshes, [](const NamedMesh& named) {
      return named.mesh.slots(EntityKind::kFace).limit() > 60 ||
             named.mesh.slots(EntityKind::kEdge).limit() > 60 ||
             named.mesh.slots(EntityKind::kVertex).limit() < 4;
    });
    return meshes;
  }
};

TEST_F(ArchiveDamageTest, AFlippedByteIsRefused) {
  for (auto& [name, mesh] : SmallMeshes()) {
    SCOPED_TRACE(name);
    Archive archive = WithRecords(std::move(mesh));
    ASSERT_TRUE(Rebuild(archive).ok());
    for (std::string* part : PartsOf(archive)) {
      for (char& byte : *part) {
        for (int flip : {1, 0x10, 0x80, 0xff}) {
          byte ^= flip;
          EXPECT_TRUE(IsRefusal(Rebuild(archive).status()));
          byte ^= flip;
        }
      }
    }
  }
}

TEST_F(ArchiveDamageTest, AFlippedByteUnderAFreshSealIsRefusedOrSound) {
  Outcomes outcomes;
  for (auto& [name, mesh] : SmallMeshes()) {
    SCOPED_TRACE(name);
    Archive archive = WithRecords(std::move(mesh));
    for (std::string* part : PartsOf(archive)) {
      const std::string whole = *part;
      for (size_t at = 0; at < whole.size(); ++at) {
        for (int flip : {1, 2, 4, 8, 16, 32, 64, 128, 255}) {
          *part = whole;
          (*part)[at] ^= flip;
          *part = Resealed(*part);
          ExpectRefusedOrSound(archive, outcomes);
        }
      }
      *part = whole;
    }
  }
  EXPECT_GT(outcomes.refused, 1000);
  EXPECT_GT(outcomes.sound, 100);
}

TEST_F(ArchiveDamageTest, ATruncatedPartIsRefused) {
  Outcomes outcomes;
  for (auto& [name, mesh] : SmallMeshes()) {
    SCOPED_TRACE(name);
    Archive archive = WithRecords(std::move(mesh));
    for (std::string* part : PartsOf(archive)) {
      const std::string whole = *part;
      for (size_t size = 0; size < whole.size(); ++size) {
        *part = whole.substr(0, size);
        EXPECT_TRUE(IsRefusal(Rebuild(archive).status())) << size;
        *part = Resealed(*part);
        ExpectRefusedOrSound(archive, outcomes);
      }
      *part = whole;
    }
  }
  EXPECT_EQ(outcomes.sound, 0);
}

TEST_F(ArchiveDamageTest, RandomMutationsUnderFreshSealsAreRefusedOrSound) {
  const uint32_t seed = 11;
  SCOPED_TRACE(seed);
  std::mt19937 rng(seed);
  Outcomes outcomes;
  for (auto& [name, mesh] : SmallMeshes()) {
    SCOPED_TRACE(name);
    Archive archive = WithRecords(std::move(mesh));
    for (int i = 0; i < NumMutations(); ++i) {
      const std::vector<std::string*> parts = PartsOf(archive);
      std::string& part = *parts[rng() % parts.size()];
      const std::string whole = part;
      for (int changes = rng() % 4; changes >= 0 && part.size() > 16; --changes) {
        const size_t at = 6 + rng() % (part.size() - 14);
        switch (rng() % 4) {
          case 0:
            part[at] = static_cast<char>(rng());
            break;
          case 1:
            part[at] = static_cast<char>(part[at] + (rng() % 2 ? 1 : -1));
            break;
          case 2:
            part.insert(at, 1, static_cast<char>(rng() % 2 ? 0xff : rng()));
            break;
          default:
            part.erase(at, 1);
        }
      }
      part = Resealed(part);
      ExpectRefusedOrSound(archive, outcomes);
      part = whole;
    }
  }
  EXPECT_GT(outcomes.refused, NumMutations());
  EXPECT_GT(outcomes.sound, 0);
}

TEST_F(ArchiveDamageTest, PartsInEachOthersPlacesAreRefused) {
  Archive archive = WithRecords(OneTet());
  const std::vector<std::string> kinds = {archive.head, archive.pages.begin()->second, archive.records[0]};
  for (std::string* part : PartsOf(archive)) {
    for (const std::string& other : kinds) {
      const std::string whole = *part;
      if (other[4] == whole[4]) continue;
      *part = other;
      EXPECT_TRUE(IsRefusal(Rebuild(archive).status()));
      *part = whole;
    }
  }
}

TEST_F(ArchiveDamageTest, ARecordTwiceOrOutOfOrderIsRefused) {
  Archive archive = WithRecords(OneTet());
  Archive twice = archive;
  twice.records.push_back(twice.records.back());
  EXPECT_TRUE(IsRefusal(Rebuild(twice).status()));
  std::swap(archive.records[0], archive.records[1]);
  EXPECT_TRUE(IsRefusal(Rebuild(archive).status()));
}

}  // namespace
}  // namespace dynmesh::testing
