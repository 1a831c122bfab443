#include "server/session/executor.h"

#include <utility>

#include "core/mesh/error.h"
#include "server/session/catch_exceptions.h"
#include "server/session/session_errors.h"
#include "spdlog/spdlog.h"

namespace dynmesh {

Executor::Executor(const Options& options) : options_(options) {
  for (int i = 0; i < options.threads; ++i) threads_.emplace_back([this] { Work(); });
}

absl::Status Executor::TryPost(Task task) {
  absl::MutexLock lock(&mu_);
  if (stopping_) return ShuttingDown();
  if (queue_.size() >= options_.max_queued) {
    return LimitExceeded("max_queued_tasks", options_.max_queued, queue_.size() + 1);
  }
  queue_.push_back(std::move(task));
  return absl::OkStatus();
}

void Executor::Post(Task task) {
  absl::MutexLock lock(&mu_);
  if (!stopping_) queue_.push_back(std::move(task));
}

void Executor::Stop() {
  {
    absl::MutexLock lock(&mu_);
    stopping_ = true;
  }
  for (std::thread& thread : threads_) thread.join();
  threads_.clear();
}

void Executor::Work() {
  while (true) {
    Task task;
    {
      absl::MutexLock lock(&mu_);
      mu_.Await(absl::Condition(this, &Executor::HasWorkOrStops));
      if (queue_.empty()) return;
      task = std::move(queue_.front());
      queue_.pop_front();
    }
    const absl::Status status = CatchExceptions([&task] {
      task();
      return absl::OkStatus();
    });
    if (!status.ok()) spdlog::error("task_failed executor={} error=\"{}\"", options_.name, status.ToString());
  }
}

}  // namespace dynmesh
