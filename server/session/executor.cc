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
  MutexLock lock(&mu_);
  if (stopping_) return ShuttingDown();
  if (queue_.size() >= options_.max_queued) {
    return LimitExceeded("max_queued_tasks", options_.max_queued, queue_.size() + 1);
  }
  queue_.push_back(std::move(task));
  has_work_or_stops_.NotifyOne();
  return absl::OkStatus();
}

void Executor::Post(Task task) {
  MutexLock lock(&mu_);
  if (stopping_) return;
  queue_.push_back(std::move(task));
  has_work_or_stops_.NotifyOne();
}

void Executor::Stop() {
  {
    MutexLock lock(&mu_);
    stopping_ = true;
    has_work_or_stops_.NotifyAll();
  }
  for (std::thread& thread : threads_) thread.join();
  threads_.clear();
}

Executor::Task Executor::Take() {
  MutexLock lock(&mu_);
  while (queue_.empty() && !stopping_) has_work_or_stops_.Wait(&mu_);
  if (queue_.empty()) return nullptr;
  Task task = std::move(queue_.front());
  queue_.pop_front();
  return task;
}

void Executor::Work() {
  for (Task task = Take(); task != nullptr; task = Take()) {
    const absl::Status status = CatchExceptions([&task] {
      task();
      return absl::OkStatus();
    });
    if (!status.ok()) spdlog::error("task_failed executor={} error=\"{}\"", options_.name, status.ToString());
  }
}

}  // namespace dynmesh
