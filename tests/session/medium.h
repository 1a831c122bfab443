#ifndef DYNMESH_TESTS_SESSION_MEDIUM_H_
#define DYNMESH_TESTS_SESSION_MEDIUM_H_

#include <memory>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "server/session/mutex.h"
#include "server/store/engine.h"
#include "server/store/local_store.h"
#include "server/store/memory_engine.h"

namespace dynmesh::testing {

/// What stays when a daemon of a test ends: stores on it find what earlier ones have written. Writes can be
/// held up, and made to fail, reads as well.
class Medium {
 public:
  /// One at a time.
  std::unique_ptr<Store> Open() {
    auto store = LocalStore::Open(std::make_unique<Connection>(*this));
    return store.ok() ? *std::move(store) : nullptr;
  }

  /// Until Release() or Fail() whoever writes or syncs waits.
  void Hold() {
    MutexLock lock(&mu_);
    held_ = true;
  }
  void Release() {
    MutexLock lock(&mu_);
    held_ = false;
    changed_.NotifyAll();
  }
  /// From now on nothing reaches the disk, though it is written.
  void FailSyncs(const absl::Status& status) {
    MutexLock lock(&mu_);
    sync_failure_ = status;
  }
  /// From now on nothing can be read; OK: everything again.
  void FailReads(const absl::Status& status) {
    MutexLock lock(&mu_);
    read_failure_ = status;
  }
  /// From now on all writes fail; OK: no more.
  void Fail(const absl::Status& status) {
    MutexLock lock(&mu_);
    failure_ = status;
    held_ = false;
    changed_.NotifyAll();
  }

 private:
  class Connection final : public Engine {
   public:
    explicit Connection(Medium& medium) : medium_(medium) {}

    absl::Status Write(const EngineBatch& batch) override {
      const absl::Status admitted = medium_.Admit();
      return admitted.ok() ? medium_.memory_.Write(batch) : admitted;
    }
    absl::Status Sync() override {
      const absl::Status admitted = medium_.Admit();
      return admitted.ok() ? medium_.sync_failure() : admitted;
    }
    absl::StatusOr<absl::optional<std::string>> Get(absl::string_view key) const override {
      const absl::Status readable = medium_.read_failure();
      if (!readable.ok()) return readable;
      return medium_.memory_.Get(key);
    }
    absl::Status Scan(absl::string_view from, absl::string_view to, Visitor visit) const override {
      const absl::Status readable = medium_.read_failure();
      return readable.ok() ? medium_.memory_.Scan(from, to, visit) : readable;
    }
    absl::StatusOr<absl::optional<std::string>> LastKey(absl::string_view from,
                                                        absl::string_view to) const override {
      return medium_.memory_.LastKey(from, to);
    }

   private:
    Medium& medium_;
  };

  absl::Status read_failure() {
    MutexLock lock(&mu_);
    return read_failure_;
  }

  absl::Status Admit() {
    MutexLock lock(&mu_);
    while (held_) changed_.Wait(&mu_);
    return failure_;
  }
  absl::Status sync_failure() {
    MutexLock lock(&mu_);
    return sync_failure_;
  }

  MemoryEngine memory_;
  Mutex mu_;
  CondVar changed_;
  bool held_ ABSL_GUARDED_BY(mu_) = false;
  absl::Status failure_ ABSL_GUARDED_BY(mu_);
  absl::Status sync_failure_ ABSL_GUARDED_BY(mu_);
  absl::Status read_failure_ ABSL_GUARDED_BY(mu_);
};

}  // namespace dynmesh::testing

#endif  // DYNMESH_TESTS_SESSION_MEDIUM_H_
