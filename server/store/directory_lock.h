#ifndef DYNMESH_SERVER_STORE_DIRECTORY_LOCK_H_
#define DYNMESH_SERVER_STORE_DIRECTORY_LOCK_H_

#include <memory>
#include <string>

#include "absl/status/statusor.h"

namespace dynmesh {

/// Keeps a directory to one process, by flock() on its file dynmesh.lock: however a process ends, the system
/// lets go of it. The file says which process it was.
class DirectoryLock {
 public:
  /// Makes the directory when it is not there (its parent must be).
  /// Errors: FAILED_PRECONDITION STORE_IN_USE; UNAVAILABLE STORE_FAILED.
  static absl::StatusOr<std::unique_ptr<DirectoryLock>> Take(const std::string& directory);

  DirectoryLock(const DirectoryLock&) = delete;
  DirectoryLock& operator=(const DirectoryLock&) = delete;
  ~DirectoryLock();

 private:
  explicit DirectoryLock(int file) : file_(file) {}

  const int file_;
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_STORE_DIRECTORY_LOCK_H_
