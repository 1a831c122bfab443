#include "server/session/access_queue.h"

#include <utility>

#include "core/mesh/error.h"

namespace dynmesh {

void AccessGrant::Release() {
  const std::shared_ptr<AccessQueue> queue = std::move(queue_);
  queue_ = nullptr;
  if (queue != nullptr) queue->Leave(mode_);
}

absl::Status AccessQueue::TryPost(AccessMode mode, Executor& executor, size_t bytes, Task task) {
  DYNMESH_ASSIGN_OR_RETURN(Executor::Ticket ticket, executor.Admit(bytes));
  Post(mode, executor, [ticket = std::move(ticket), task = std::move(task)](AccessGrant grant) mutable {
    ticket = {};
    task(std::move(grant));
  });
  return absl::OkStatus();
}

void AccessQueue::Post(AccessMode mode, Executor& executor, Task task) {
  Enqueue({mode, [&executor, task = std::move(task)](AccessGrant grant) mutable {
             executor.Post(
                 [task = std::move(task), grant = std::move(grant)]() mutable { task(std::move(grant)); });
           }});
}

AccessGrant AccessQueue::Acquire(AccessMode mode) {
  struct Turn {
    Mutex mu;
    CondVar came;
    bool has_come ABSL_GUARDED_BY(mu) = false;
    AccessGrant grant ABSL_GUARDED_BY(mu);
  };
  // Shared: the thread that grants may still be in NotifyOne() when the waiter has gone on.
  const auto turn = std::make_shared<Turn>();
  Enqueue({mode, [turn](AccessGrant grant) {
             MutexLock lock(&turn->mu);
             turn->grant = std::move(grant);
             turn->has_come = true;
             turn->came.NotifyOne();
           }});
  MutexLock lock(&turn->mu);
  while (!turn->has_come) turn->came.Wait(&turn->mu);
  return std::move(turn->grant);
}

void AccessQueue::Enqueue(Waiter waiter) {
  {
    MutexLock lock(&mu_);
    waiting_.push_back(std::move(waiter));
  }
  Dispatch();
}

void AccessQueue::Leave(AccessMode mode) {
  {
    MutexLock lock(&mu_);
    if (mode == AccessMode::kWrite) {
      has_writer_ = false;
    } else {
      --num_readers_;
    }
  }
  Dispatch();
}

void AccessQueue::Dispatch() {
  MutexLock lock(&mu_);
  if (dispatching_) return;
  dispatching_ = true;
  while (CanStart()) {
    Waiter next = std::move(waiting_.front());
    waiting_.pop_front();
    next.mode == AccessMode::kWrite ? void(has_writer_ = true) : void(++num_readers_);
    mu_.Unlock();
    next.start(AccessGrant(shared_from_this(), next.mode));
    next.start = nullptr;
    mu_.Lock();
  }
  dispatching_ = false;
}

bool AccessQueue::CanStart() const {
  if (waiting_.empty() || has_writer_) return false;
  return waiting_.front().mode == AccessMode::kRead || num_readers_ == 0;
}

}  // namespace dynmesh
