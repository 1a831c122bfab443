#ifndef DYNMESH_SERVER_SESSION_ACCESS_QUEUE_H_
#define DYNMESH_SERVER_SESSION_ACCESS_QUEUE_H_

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>

#include "absl/base/thread_annotations.h"
#include "absl/functional/any_invocable.h"
#include "absl/status/status.h"
#include "server/session/executor.h"
#include "server/session/mutex.h"

namespace dynmesh {

class AccessQueue;

enum class AccessMode { kRead, kWrite };

/// The right to read or write a session now; whoever waits for the session gets it when this is destroyed.
/// Thread safety: that of std::vector.
class AccessGrant {
 public:
  AccessGrant() = default;
  AccessGrant(AccessGrant&& other) noexcept = default;
  AccessGrant& operator=(AccessGrant&& other) noexcept {
    Release();
    queue_ = std::move(other.queue_);
    mode_ = other.mode_;
    return *this;
  }
  ~AccessGrant() { Release(); }

  /// Before work that does not need the session any more, such as encoding.
  void Release();

 private:
  friend class AccessQueue;
  AccessGrant(std::shared_ptr<AccessQueue> queue, AccessMode mode) : queue_(std::move(queue)), mode_(mode) {}

  std::shared_ptr<AccessQueue> queue_;
  AccessMode mode_ = AccessMode::kRead;
};

/// Where calls wait for a session: many readers or one writer, first come first served, and no thread waits
/// with them. So a session that is busy for long delays its own callers, never those of other sessions.
///
///     session.access().TryPost(AccessMode::kWrite, executor, request_bytes,
///                              [](AccessGrant grant) { ... session.Apply(...) ... });
///
/// The session's lock stays what guards its data; among holders of grants it is free, so taking it never
/// takes long. A holder must not wait for another grant of the same session. Thread safety: full. Always
/// owned by a shared_ptr.
class AccessQueue : public std::enable_shared_from_this<AccessQueue> {
 public:
  using Task = absl::AnyInvocable<void(AccessGrant)>;

  AccessQueue() = default;
  AccessQueue(const AccessQueue&) = delete;
  AccessQueue& operator=(const AccessQueue&) = delete;

  /// Runs `task` on `executor` when it is its turn. Until it runs it counts as waiting there.
  /// Errors: those of Executor::Admit.
  absl::Status TryPost(AccessMode mode, Executor& executor, size_t bytes, Task task);

  /// The same for the next step of what was admitted before: never refused; dropped when the executor has
  /// stopped.
  void Post(AccessMode mode, Executor& executor, Task task);

  /// Waits for its turn: for threads that may, which those of the quick executor may not.
  AccessGrant Acquire(AccessMode mode);

 private:
  friend class AccessGrant;

  struct Waiter {
    AccessMode mode;
    Task start;  ///< must not block
  };

  void Enqueue(Waiter waiter) ABSL_LOCKS_EXCLUDED(mu_);
  void Leave(AccessMode mode) ABSL_LOCKS_EXCLUDED(mu_);
  /// Starts who may start. One thread at a time: who comes meanwhile leaves it to that one, so that tasks
  /// which end while they are started do not nest.
  void Dispatch() ABSL_LOCKS_EXCLUDED(mu_);
  bool CanStart() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mu_);

  Mutex mu_;
  std::deque<Waiter> waiting_ ABSL_GUARDED_BY(mu_);
  uint32_t num_readers_ ABSL_GUARDED_BY(mu_) = 0;
  bool has_writer_ ABSL_GUARDED_BY(mu_) = false;
  bool dispatching_ ABSL_GUARDED_BY(mu_) = false;
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_ACCESS_QUEUE_H_
