#include "server/session/executor.h"

#include <utility>

#include "core/mesh/error.h"
#include "server/session/catch_exceptions.h"
#include "server/session/session_errors.h"
#include "spdlog/spdlog.h"

namespace dynmesh {

Executor::Executor(const Options& options)
    : options_(options),
      places_(std::make_shared<Budget>("max_queued_tasks", options.max_queued)),
      bytes_(std::make_shared<Budget>("max_queued_bytes", options.max_queued_bytes)) {
  for (int i = 0; i < options.threads; ++i) threads_.emplace_back([this] { Work(); });
}

absl::StatusOr<Executor::Ticket> Executor::Admit(size_t bytes) {
  {
    MutexLock lock(&mu_);
    if (stopping_) return ShuttingDown();
  }
  Ticket ticket{Lease(places_), Lease(bytes_)};
  DYNMESH_RETURN_IF_ERROR(ticket.place.Grow(1));
  DYNMESH_RETURN_IF_ERROR(ticket.bytes.Grow(bytes));
  return ticket;
}

absl::Status Executor::TryPost(Task task, size_t bytes) {
  DYNMESH_ASSIGN_OR_RETURN(Ticket ticket, Admit(bytes));
  Post([ticket = std::move(ticket), task = std::move(task)]() mutable {
    ticket = {};
    task();
  });
  return absl::OkStatus();
}

void Executor::Post(Task task) {
  MutexLock lock(&mu_);
  if (stopping_) return;  // the caller destroys the task, without the lock
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
    task = nullptr;  // what it owns is not kept until there is another one
  }
}

}  // namespace dynmesh
