#ifndef DYNMESH_TESTS_SESSION_BACKUP_SUPPORT_H_
#define DYNMESH_TESTS_SESSION_BACKUP_SUPPORT_H_

#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "server/session/backup/backup_reader.h"
#include "server/session/backup/backup_writer.h"
#include "tests/core/archive/archive_support.h"
#include "tests/session/session_support.h"
#include "tests/support/meshes.h"

/// Backups as tests write, forge and read them.
namespace dynmesh::testing {

inline constexpr absl::Time kCreateTime = absl::FromUnixMicros(1'000'000);
inline constexpr absl::Time kCommitTime = absl::FromUnixMicros(2'000'000);
inline const Refusal kDamaged{absl::StatusCode::kDataLoss, reason::kBackupDamaged};

inline BackupIdentity Identity() {
  return {"m", "0123456789abcdef", kCreateTime, kCommitTime, {.durability = SessionDurability::kSync}};
}

inline std::string WriteBackup(const BackupIdentity& identity, const Mesh& mesh) {
  BackupWriter writer(identity, mesh.Clone());
  std::string bytes;
  while (!writer.done()) bytes += writer.Next();
  EXPECT_EQ(writer.pages_done(), writer.num_pages());
  return bytes;
}

inline absl::StatusOr<Backup> ReadBackup(absl::string_view bytes, const Limits& limits = {}) {
  BackupReader reader(limits);
  DYNMESH_RETURN_IF_ERROR(reader.Add(bytes));
  return std::move(reader).Finish();
}

inline Mesh OneTriangle() {
  Mesh mesh;
  for (const Point& point : {Point{0, 0, 0}, Point{1, 0, 0}, Point{0, 1, 0}}) {
    EXPECT_TRUE(mesh.AddVertex(point).ok());
  }
  Add(mesh, ElementType::kTriangle, {0, 1, 2});
  Commit(mesh);
  return mesh;
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

}  // namespace dynmesh::testing

#endif  // DYNMESH_TESTS_SESSION_BACKUP_SUPPORT_H_
