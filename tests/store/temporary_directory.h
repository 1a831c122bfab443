#ifndef DYNMESH_TESTS_STORE_TEMPORARY_DIRECTORY_H_
#define DYNMESH_TESTS_STORE_TEMPORARY_DIRECTORY_H_

#include <stdlib.h>

#include <filesystem>
#include <string>

namespace dynmesh::testing {

/// A new directory that is removed with all that is in it.
class TemporaryDirectory {
 public:
  TemporaryDirectory() {
    const std::string name = (std::filesystem::temp_directory_path() / "dynmesh_store_XXXXXX").string();
    path_ = name;
    if (mkdtemp(path_.data()) == nullptr) abort();
  }
  TemporaryDirectory(const TemporaryDirectory&) = delete;
  TemporaryDirectory& operator=(const TemporaryDirectory&) = delete;
  ~TemporaryDirectory() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }

  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

}  // namespace dynmesh::testing

#endif  // DYNMESH_TESTS_STORE_TEMPORARY_DIRECTORY_H_
