#ifndef DYNMESH_SERVER_SESSION_BACKUP_BACKUP_FORMAT_H_
#define DYNMESH_SERVER_SESSION_BACKUP_BACKUP_FORMAT_H_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "core/codec/bytes.h"
#include "server/session/session_info.h"

struct XXH3_state_s;

/// The outer form of backups, and how they fail. See FORMAT.md.
namespace dynmesh {

inline constexpr absl::string_view kBackupMagic("DYNB", 4);
/// The newest format that this build reads, and the one that it writes.
inline constexpr uint8_t kBackupFormat = 1;
inline constexpr size_t kBackupBeginBytes = 5;

/// What a part is. The values are stored: never renumber.
enum class BackupPart : uint8_t { kIdentity = 'I', kHead = 'H', kPages = 'P', kEnd = 'E' };

/// How the bytes of a part stand there.
enum class BackupPacking : uint8_t { kPlain = 0, kZstd = 1 };

/// Bytes of a part, packed or not: the largest page has some 5 MiB.
inline constexpr uint64_t kMaxBackupPartBytes = uint64_t{16} << 20;
/// A part has no more pages once they have so many bytes.
inline constexpr size_t kBackupPagesBytes = size_t{256} << 10;

/// What a session was beside its mesh when the backup was taken.
struct BackupIdentity {
  std::string name;
  std::string uid;
  absl::Time create_time;
  absl::Time commit_time;  ///< of the mesh's revision
  SessionSettings settings;
};

std::string EncodeBackupIdentity(const BackupIdentity& identity);
/// False if the bytes are none: no name of a session, no uid, a time before 1970 or after 9999, no
/// durability.
bool DecodeBackupIdentity(absl::string_view bytes, BackupIdentity& identity);

/// The XXH3 of all bytes so far.
class RunningHash {
 public:
  RunningHash();

  void Add(absl::string_view bytes);
  uint64_t value() const;

 private:
  std::unique_ptr<XXH3_state_s, void (*)(XXH3_state_s*)> state_;
};

/// Where something stands in a backup.
struct BackupPlace {
  uint64_t part = 0;  ///< counting from 0
  uint64_t byte = 0;  ///< of its begin
};

/// DATA_LOSS BACKUP_DAMAGED, metadata part and byte. `what` goes on after "part 3 ".
absl::Status BackupDamaged(const BackupPlace& place, absl::string_view what);

/// FAILED_PRECONDITION BACKUP_FORMAT_NEWER, metadata found and supported.
absl::Status BackupFormatNewer(uint64_t found);

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_BACKUP_BACKUP_FORMAT_H_
