#include "server/session/timer.h"

#include <utility>

#include "absl/time/clock.h"

namespace dynmesh {

void Timer::RunAt(absl::Time when, Task task) {
  absl::MutexLock lock(&mu_);
  if (!stopping_) tasks_.emplace(when, std::move(task));
}

void Timer::Stop() {
  std::multimap<absl::Time, Task> dropped;  // destroyed without the lock: a task may own much
  {
    absl::MutexLock lock(&mu_);
    stopping_ = true;
    dropped.swap(tasks_);
  }
  if (thread_.joinable()) thread_.join();
}

void Timer::Run() {
  absl::MutexLock lock(&mu_);
  while (!stopping_) {
    next_ = tasks_.empty() ? absl::InfiniteFuture() : tasks_.begin()->first;
    if (next_ > absl::Now()) {
      mu_.AwaitWithDeadline(absl::Condition(this, &Timer::HasNews), next_);
      continue;
    }
    Task task = std::move(tasks_.begin()->second);
    tasks_.erase(tasks_.begin());
    mu_.Unlock();
    task();
    task = nullptr;
    mu_.Lock();
  }
}

}  // namespace dynmesh
