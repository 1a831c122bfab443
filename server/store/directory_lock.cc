#include "server/store/directory_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "server/store/store_errors.h"

namespace dynmesh {
namespace {

constexpr char kLockFile[] = "/dynmesh.lock";
constexpr size_t kMaxPidBytes = 20;

absl::Status NotLocked(const std::string& path, int error) {
  return StoreFailed(absl::StrCat(path, ": ", std::strerror(error)));
}

std::string ReadPid(int file) {
  char digits[kMaxPidBytes];
  const ssize_t size = pread(file, digits, sizeof(digits), 0);
  std::string pid;
  for (ssize_t i = 0; i < size && absl::ascii_isdigit(digits[i]); ++i) pid.push_back(digits[i]);
  return pid;
}

// Only for the message that another process gets, so nothing depends on its success.
void WritePid(int file) {
  const std::string pid = absl::StrCat(getpid(), "\n");
  if (ftruncate(file, 0) == 0) (void)!pwrite(file, pid.data(), pid.size(), 0);
}

}  // namespace

absl::StatusOr<std::unique_ptr<DirectoryLock>> DirectoryLock::Take(const std::string& directory) {
  if (mkdir(directory.c_str(), 0750) != 0 && errno != EEXIST) return NotLocked(directory, errno);
  const std::string path = directory + kLockFile;
  const int file = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0640);
  if (file < 0) return NotLocked(path, errno);
  std::unique_ptr<DirectoryLock> lock(new DirectoryLock(file));
  if (flock(file, LOCK_EX | LOCK_NB) != 0) {
    if (errno == EWOULDBLOCK) return StoreInUse(directory, ReadPid(file));
    return NotLocked(path, errno);
  }
  WritePid(file);
  return lock;
}

DirectoryLock::~DirectoryLock() { close(file_); }

}  // namespace dynmesh
