#ifndef DYNMESH_SERVER_SESSION_BACKUP_BACKUP_WRITER_H_
#define DYNMESH_SERVER_SESSION_BACKUP_BACKUP_WRITER_H_

#include <cstdint>
#include <string>

#include "core/archive/page.h"
#include "core/mesh/mesh.h"
#include "server/session/backup/backup_format.h"

namespace dynmesh {

/// Writes a session as the bytes of a backup, piece by piece.
///
///     BackupWriter writer(identity, std::move(mesh));
///     while (!writer.done()) file.Append(writer.Next());
///
/// Memory: the mesh, and a piece. Cost of a piece: encoding and packing its pages, some milliseconds.
/// Throws std::bad_alloc when memory runs out. Thread safety: that of std::vector.
class BackupWriter {
 public:
  /// REQUIRES: no batch is open.
  BackupWriter(BackupIdentity identity, Mesh mesh);

  /// The next bytes: some 256 KiB of pages before they are packed, or one page that is larger.
  /// REQUIRES: !done().
  std::string Next();
  bool done() const { return done_; }

  const Mesh& mesh() const { return mesh_; }
  const BackupIdentity& identity() const { return identity_; }
  uint64_t pages_done() const { return pages_done_; }
  uint64_t num_pages() const { return num_pages_; }

 private:
  void Begin(std::string& out);
  void WritePages(std::string& out);
  void End(std::string& out);
  std::string TakePages();
  /// The place of the next page; false after the last.
  bool FindPage();
  void Write(BackupPart part, absl::string_view content, std::string& out);
  void Append(absl::string_view bytes, std::string& out);

  const BackupIdentity identity_;
  const Mesh mesh_;
  uint64_t num_pages_ = 0;
  uint64_t pages_done_ = 0;
  uint64_t parts_done_ = 0;
  uint64_t bytes_done_ = 0;
  PageId next_;
  bool begun_ = false;
  bool done_ = false;
  RunningHash hash_;
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_BACKUP_BACKUP_WRITER_H_
