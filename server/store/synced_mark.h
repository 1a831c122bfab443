#ifndef DYNMESH_SERVER_STORE_SYNCED_MARK_H_
#define DYNMESH_SERVER_STORE_SYNCED_MARK_H_

#include <cstdint>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace dynmesh {

/// A file of 16 bytes that says how many writes are on disk, beside a log that cannot tell a damaged end from
/// one that was being written when the process died.
///
/// Written after each sync and not synced itself: after the end of a process it is exact, after a loss of
/// power it may be behind, never ahead. A log that has fewer writes than it says has lost some.
/// Thread safety: as std::vector.
class SyncedMark {
 public:
  /// Errors: DATA_LOSS STORE_DAMAGED: the file is not what was written; UNAVAILABLE STORE_FAILED.
  static absl::StatusOr<std::unique_ptr<SyncedMark>> Open(const std::string& path);

  SyncedMark(const SyncedMark&) = delete;
  SyncedMark& operator=(const SyncedMark&) = delete;
  ~SyncedMark();

  /// 0 in a new file.
  uint64_t number() const { return number_; }
  absl::Status Set(uint64_t number);

 private:
  SyncedMark(std::string path, int file) : path_(std::move(path)), file_(file) {}
  absl::Status Read();
  absl::Status SyncFile();

  const std::string path_;
  const int file_;
  uint64_t number_ = 0;
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_STORE_SYNCED_MARK_H_
