#include <rocksdb/env.h>
#include <rocksdb/file_system.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <fstream>
#include <map>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/strings/match.h"
#include "server/store/local_store.h"
#include "server/store/rocksdb_engine.h"
#include "tests/store/store_rig.h"
#include "tests/store/temporary_directory.h"

namespace dynmesh::testing {
namespace {

namespace fs = std::filesystem;

/// How much of each log is on disk.
class SyncedSizes {
 public:
  void Set(const std::string& path, uint64_t size) {
    MutexLock lock(&mu_);
    sizes_[path] = size;
  }
  std::map<std::string, uint64_t> All() const {
    MutexLock lock(&mu_);
    return sizes_;
  }

 private:
  mutable Mutex mu_;
  std::map<std::string, uint64_t> sizes_;
};

/// A log file on which things go wrong.
class FaultyLog final : public rocksdb::FSWritableFileOwnerWrapper {
 public:
  FaultyLog(std::unique_ptr<rocksdb::FSWritableFile> file, std::string path, FaultSwitch* faults,
            SyncedSizes* synced)
      : FSWritableFileOwnerWrapper(std::move(file)),
        path_(std::move(path)),
        faults_(faults),
        synced_(synced) {
    synced_->Set(path_, 0);
  }

  rocksdb::IOStatus Append(const rocksdb::Slice& data, const rocksdb::IOOptions& options,
                           rocksdb::IODebugContext* dbg) override {
    const Fault fault = faults_->fault();
    if (fault == Fault::kFullDisk) return rocksdb::IOStatus::NoSpace("injected");
    if (fault == Fault::kFailedWrite) return rocksdb::IOStatus::IOError("injected");
    const bool torn = fault == Fault::kTornWrite;
    const rocksdb::Slice part(data.data(), torn ? data.size() / 2 : data.size());
    const rocksdb::IOStatus written = FSWritableFileOwnerWrapper::Append(part, options, dbg);
    if (written.ok()) size_ += part.size();
    return torn ? rocksdb::IOStatus::IOError("injected") : written;
  }
  rocksdb::IOStatus Append(const rocksdb::Slice& data, const rocksdb::IOOptions& options,
                           const rocksdb::DataVerificationInfo&, rocksdb::IODebugContext* dbg) override {
    return Append(data, options, dbg);
  }

  rocksdb::IOStatus Sync(const rocksdb::IOOptions& options, rocksdb::IODebugContext* dbg) override {
    return Synced([&] { return FSWritableFileOwnerWrapper::Sync(options, dbg); });
  }
  rocksdb::IOStatus Fsync(const rocksdb::IOOptions& options, rocksdb::IODebugContext* dbg) override {
    return Synced([&] { return FSWritableFileOwnerWrapper::Fsync(options, dbg); });
  }

 private:
  // What is appended while it syncs is not on disk.
  rocksdb::IOStatus Synced(absl::FunctionRef<rocksdb::IOStatus()> sync) {
    const uint64_t size = size_;
    faults_->OnSync();
    if (faults_->fault() == Fault::kFailedSync) return rocksdb::IOStatus::IOError("injected");
    const rocksdb::IOStatus status = sync();
    if (status.ok()) synced_->Set(path_, size);
    return status;
  }

  const std::string path_;
  FaultSwitch* const faults_;
  SyncedSizes* const synced_;
  std::atomic<uint64_t> size_{0};
};

class FaultyFileSystem final : public rocksdb::FileSystemWrapper {
 public:
  FaultyFileSystem(FaultSwitch* faults, SyncedSizes* synced)
      : FileSystemWrapper(rocksdb::FileSystem::Default()), faults_(faults), synced_(synced) {}

  const char* Name() const override { return "FaultyFileSystem"; }

  rocksdb::IOStatus NewWritableFile(const std::string& path, const rocksdb::FileOptions& options,
                                    std::unique_ptr<rocksdb::FSWritableFile>* file,
                                    rocksdb::IODebugContext* dbg) override {
    rocksdb::IOStatus status = FileSystemWrapper::NewWritableFile(path, options, file, dbg);
    if (status.ok() && absl::EndsWith(path, ".log")) {
      *file = std::make_unique<FaultyLog>(std::move(*file), path, faults_, synced_);
    }
    return status;
  }

 private:
  FaultSwitch* const faults_;
  SyncedSizes* const synced_;
};

void FlipBitOfFile(const fs::path& path, std::mt19937& random) {
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  const uint64_t offset = random() % fs::file_size(path);
  file.seekg(offset);
  const int byte = file.get();
  file.seekp(offset);
  // The top bit in one place of a table ends the process: see FORMAT.md, "What RocksDB does not find".
  const int num_bits = path.extension() == ".sst" ? 7 : 8;
  file.put(static_cast<char>(byte ^ 1 << random() % num_bits));
}

// Not what is only there for people, or not looked at again.
bool IsRead(const fs::path& path) {
  const std::string name = path.filename().string();
  return absl::EndsWith(name, ".log") || absl::EndsWith(name, ".sst") || absl::StartsWith(name, "MANIFEST") ||
         name == "CURRENT" || name == "dynmesh.synced";
}

class RocksDbRig final : public StoreRig {
 public:
  absl::StatusOr<std::unique_ptr<Store>> Open(const CommitterOptions& options) override {
    absl::StatusOr<std::unique_ptr<Engine>> engine = OpenRocksDb({directory_.path(), env_.get()});
    if (!engine.ok()) return engine.status();
    return LocalStore::Open(*std::move(engine), options);
  }

  void LosePower() override {
    for (const auto& [path, size] : synced_.All()) {
      std::error_code gone;
      fs::resize_file(path, size, gone);
    }
  }

  // Every file that is read is as likely as any other: the small ones matter most.
  void FlipBit(std::mt19937& random) override {
    std::vector<fs::path> files;
    for (const auto& entry : fs::recursive_directory_iterator(directory_.path())) {
      if (entry.is_regular_file() && entry.file_size() > 0 && IsRead(entry.path()))
        files.push_back(entry.path());
    }
    std::sort(files.begin(), files.end());
    FlipBitOfFile(files[random() % files.size()], random);
  }

 private:
  TemporaryDirectory directory_;
  SyncedSizes synced_;
  const std::unique_ptr<rocksdb::Env> env_ =
      rocksdb::NewCompositeEnv(std::make_shared<FaultyFileSystem>(&faults(), &synced_));
};

}  // namespace

std::unique_ptr<StoreRig> MakeRocksDbRig() { return std::make_unique<RocksDbRig>(); }

}  // namespace dynmesh::testing
