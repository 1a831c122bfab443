#include "server/session/timer.h"

#include <utility>

#include "absl/time/clock.h"

namespace dynmesh {

void Timer::RunAt(absl::Time when, Task task) {
  MutexLock lock(&mu_);
  if (stopping_) return;
  tasks_.emplace(when, std::move(task));
  news_.NotifyOne();
}

void Timer::Stop() {
  std::multimap<absl::Time, Task> dropped;  // destroyed without the lock: a task may own much
  {
    MutexLock lock(&mu_);
    stopping_ = true;
    dropped.swap(tasks_);
    news_.NotifyOne();
  }
  if (thread_.joinable()) thread_.join();
}

void Timer::Run() {
  MutexLock lock(&mu_);
  while (!stopping_) {
    const absl::Time next = tasks_.empty() ? absl::InfiniteFuture() : tasks_.begin()->first;
    if (next > absl::Now()) {
      news_.WaitUntil(&mu_, next);
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
