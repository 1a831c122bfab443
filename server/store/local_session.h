#ifndef DYNMESH_SERVER_STORE_LOCAL_SESSION_H_
#define DYNMESH_SERVER_STORE_LOCAL_SESSION_H_

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "server/session/mutex.h"
#include "server/store/checkpoint_table.h"
#include "server/store/ownership.h"
#include "server/store/store.h"

namespace dynmesh {

/// How far a session has come.
struct SessionProgress {
  /// On the committer's threads, one at a time: `revision` is on disk, or it never will be.
  void SetDurable(int64_t revision, const absl::Status& status) {
    if (status.ok() && revision <= durable) return;
    if (status.ok()) durable = revision;
    const std::shared_ptr<SessionStore::Watcher> watching = Watching();
    if (watching != nullptr) (*watching)(status.ok() ? absl::StatusOr<int64_t>(revision) : status);
  }
  void Watch(SessionStore::Watcher new_watcher) {
    MutexLock lock(&mu);
    watcher = new_watcher ? std::make_shared<SessionStore::Watcher>(std::move(new_watcher)) : nullptr;
  }
  std::shared_ptr<SessionStore::Watcher> Watching() {
    MutexLock lock(&mu);
    return watcher;
  }

  Mutex mu;  ///< not held while the watcher runs, which may end the session
  std::shared_ptr<SessionStore::Watcher> watcher ABSL_GUARDED_BY(mu);

  std::atomic<int64_t> last{0};        ///< record or checkpoint
  std::atomic<int64_t> durable{0};     ///< the same, on disk
  std::atomic<int64_t> checkpoint{0};  ///< revision of the last one
  std::atomic<int64_t> trimmed{0};     ///< records up to here are gone
};

/// A session of a LocalStore.
class LocalSession final : public SessionStore {
 public:
  /// Finds where the session stands; reads neither records nor pages. Errors: as those of SessionStore.
  static absl::StatusOr<std::unique_ptr<SessionStore>> Open(OwnedSession owned);
  ~LocalSession() override { progress_->Watch(nullptr); }

  uint64_t fencing_token() const override { return owned_.token(); }
  int64_t last_revision() const override { return progress_->last; }
  int64_t trimmed_revision() const override { return progress_->trimmed; }
  int64_t durable_revision() const override { return progress_->durable; }
  void WatchDurable(Watcher watcher) override { progress_->Watch(std::move(watcher)); }

  void Append(Record record, Durability durability, Done done) override;
  using SessionStore::ReadRecords;
  absl::Status ReadRecords(const RecordRange& range, RecordFn fn) override;
  absl::StatusOr<std::vector<Checkpoint>> ListCheckpoints() override;
  absl::StatusOr<Checkpoint> ReadCheckpoint(uint64_t number, PageFn fn) override;
  absl::StatusOr<std::unique_ptr<CheckpointWriter>> BeginCheckpoint(int64_t revision) override;
  absl::Status DropCheckpoint(uint64_t number) override;
  using SessionStore::TrimRecords;
  absl::Status TrimRecords(int64_t revision, absl::Span<const RecordRange> kept) override;
  absl::Status PutValue(absl::string_view name, std::string bytes) override;
  absl::Status DeleteValue(absl::string_view name) override;
  absl::StatusOr<absl::optional<std::string>> GetValue(absl::string_view name) override;

 private:
  friend class LocalCheckpoint;

  explicit LocalSession(OwnedSession owned) : owned_(std::move(owned)) {}
  absl::Status Load();
  absl::Status LoadCheckpoint();
  absl::Status LoadRecords();
  absl::Status CheckAppend(const Record& record) const;
  absl::StatusOr<absl::optional<Checkpoint>> ReadPages(uint64_t number, PageFn fn);
  /// Asked after reading, as records may have been trimmed meanwhile.
  bool IsTrimmed(int64_t after) const { return after < progress_->trimmed; }
  absl::Status LoadTable();
  void KeepTable(CheckpointTable table);
  bool HasTable();
  absl::Status DropNow(uint64_t number);
  absl::Status DeletePages(const std::vector<layout::PageVersion>& pages);
  absl::Status Named(const absl::Status& status) const;

  const OwnedSession owned_;
  // Shared with callbacks that run after this is gone.
  const std::shared_ptr<SessionProgress> progress_ = std::make_shared<SessionProgress>();
  std::atomic<bool> checkpoint_open_{false};
  Mutex mu_;
  /// From the first reading of all pages on. It is set once, under mu_; then it is the open checkpoint's own.
  absl::optional<CheckpointTable> table_;
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_STORE_LOCAL_SESSION_H_
