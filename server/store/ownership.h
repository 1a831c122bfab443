#ifndef DYNMESH_SERVER_STORE_OWNERSHIP_H_
#define DYNMESH_SERVER_STORE_OWNERSHIP_H_

#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/functional/any_invocable.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/session/mutex.h"
#include "server/store/committer.h"
#include "server/store/engine.h"
#include "server/store/layout.h"

namespace dynmesh {

/// Who may write to one session of a local store. Tokens count from 1 whenever the store is opened: owners in
/// other processes are kept away by the lock on the directory.
/// Thread safety: full.
class Ownership {
 public:
  Ownership(layout::SessionId id, std::string name) : id_(id), name_(std::move(name)) {}

  layout::SessionId id() const { return id_; }
  const std::string& name() const { return name_; }

  /// The token of a new owner. Errors: NOT_FOUND SESSION_NOT_FOUND: it is being deleted.
  absl::StatusOr<uint64_t> TakeOver();
  /// From here on nobody may write. Errors: NOT_FOUND SESSION_NOT_FOUND: it was called before.
  absl::Status Delete();
  bool deleted() const;

  /// Calls fn(absl::Status): OK, ABORTED FENCED or NOT_FOUND SESSION_DELETED. No one becomes the owner before
  /// it returns, so what fn enqueues comes before what a next owner reads.
  template <typename Fn>
  void AsOwner(uint64_t token, Fn fn) const {
    MutexLock lock(&mu_);
    fn(Check(token));
  }

 private:
  absl::Status Check(uint64_t token) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mu_);

  const layout::SessionId id_;
  const std::string name_;
  mutable Mutex mu_;
  uint64_t token_ ABSL_GUARDED_BY(mu_) = 0;
  bool deleted_ ABSL_GUARDED_BY(mu_) = false;
};

/// What one owner reads and writes with.
/// Thread safety: full.
class OwnedSession {
 public:
  OwnedSession(std::shared_ptr<const Ownership> ownership, uint64_t token, const Engine* engine,
               Committer* committer)
      : ownership_(std::move(ownership)), token_(token), engine_(engine), committer_(committer) {}

  layout::SessionId id() const { return ownership_->id(); }
  const std::string& name() const { return ownership_->name(); }
  uint64_t token() const { return token_; }
  const Engine& engine() const { return *engine_; }

  /// Committer's, with the refusal of owners that are none any more.
  void Enqueue(Committer::Write write) const;
  void EnqueueBackground(Committer::Write write) const;
  absl::Status AwaitRoom() const { return committer_->AwaitRoom(); }

  /// Returns when it is on disk.
  absl::Status Commit(EngineBatch batch) const;
  absl::Status CommitAfterBackground(EngineBatch batch, Committer::OnDisk on_disk) const;

 private:
  std::shared_ptr<const Ownership> ownership_;
  uint64_t token_;
  const Engine* engine_;
  Committer* committer_;
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_STORE_OWNERSHIP_H_
