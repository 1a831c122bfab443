#include "server/store/synced_mark.h"

#include <fcntl.h>
#include <unistd.h>
#include <xxhash.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/mesh/error.h"
#include "server/store/store_errors.h"

namespace dynmesh {
namespace {

struct Image {
  uint64_t number;
  uint64_t seal;
};
static_assert(sizeof(Image) == 16);

uint64_t SealOf(uint64_t number) { return XXH3_64bits(&number, sizeof(number)); }

absl::Status FileError(const std::string& path, int error) {
  const std::string cause = absl::StrCat(path, ": ", std::strerror(error));
  return error == ENOSPC || error == EDQUOT ? StoreFull(cause) : StoreFailed(cause);
}

}  // namespace

absl::StatusOr<std::unique_ptr<SyncedMark>> SyncedMark::Open(const std::string& path) {
  const int file = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0640);
  if (file < 0) return FileError(path, errno);
  std::unique_ptr<SyncedMark> mark(new SyncedMark(path, file));
  DYNMESH_RETURN_IF_ERROR(mark->Read());
  return mark;
}

SyncedMark::~SyncedMark() { close(file_); }

absl::Status SyncedMark::Read() {
  Image image[2];  // twice the size, to see a file that is too long
  const ssize_t size = pread(file_, image, sizeof(image), 0);
  if (size < 0) return FileError(path_, errno);
  if (size == 0) {  // new; from here on it is overwritten in place
    DYNMESH_RETURN_IF_ERROR(Set(0));
    return SyncFile();
  }
  if (size != sizeof(Image) || image[0].seal != SealOf(image[0].number)) {
    return StoreDamaged(absl::StrCat("the file ", path_, " is not what was written"));
  }
  number_ = image[0].number;
  return absl::OkStatus();
}

absl::Status SyncedMark::SyncFile() { return fsync(file_) == 0 ? absl::OkStatus() : FileError(path_, errno); }

absl::Status SyncedMark::Set(uint64_t number) {
  const Image image{number, SealOf(number)};
  if (pwrite(file_, &image, sizeof(image), 0) != sizeof(image)) return FileError(path_, errno);
  number_ = number;
  return absl::OkStatus();
}

}  // namespace dynmesh
