#ifndef DYNMESH_SERVER_SESSION_EXECUTOR_H_
#define DYNMESH_SERVER_SESSION_EXECUTOR_H_

#include <cstddef>
#include <deque>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/functional/any_invocable.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/session/budget.h"
#include "server/session/mutex.h"

namespace dynmesh {

/// A fixed number of threads and a bounded queue in front of them.
///
/// Reactors of gRPC never compute: they hand a call to TryPost(), which refuses when too many wait already,
/// or when their requests hold too much memory. What an admitted call does next (the following step of a
/// stream) goes to Post(), whose number is bounded by the calls that were admitted. A task must not wait for
/// another task. Exceptions that escape one are logged and dropped, so a task that owes somebody an answer
/// catches them itself (catch_exceptions.h). Thread safety: full.
class Executor {
 public:
  using Task = absl::AnyInvocable<void()>;

  struct Options {
    std::string name;  ///< for the log
    int threads = 2;
    size_t max_queued = 10'000;
    size_t max_queued_bytes = size_t{256} << 20;  ///< of the requests of the tasks that wait
  };

  /// The place of a task that waits; it is free again when this is destroyed.
  struct Ticket {
    Lease place;
    Lease bytes;
  };

  explicit Executor(const Options& options);
  Executor(const Executor&) = delete;
  Executor& operator=(const Executor&) = delete;
  ~Executor() { Stop(); }

  /// For a task that waits elsewhere before it is posted here. `bytes` is what its request holds.
  /// Errors: RESOURCE_EXHAUSTED LIMIT_EXCEEDED (max_queued_tasks, max_queued_bytes); UNAVAILABLE
  /// SHUTTING_DOWN after Stop().
  absl::StatusOr<Ticket> Admit(size_t bytes);

  /// For requests that are queued elsewhere and need no place here.
  const std::shared_ptr<Budget>& queued_bytes() const { return bytes_; }

  /// Errors: those of Admit.
  absl::Status TryPost(Task task, size_t bytes = 0);

  /// Never refused; after Stop() the task is dropped.
  void Post(Task task);

  /// Runs what waits, then joins. Called once; not from a task.
  void Stop();

 private:
  void Work();
  /// The next task; null when there is none and there will be none.
  Task Take() ABSL_LOCKS_EXCLUDED(mu_);

  const Options options_;
  const std::shared_ptr<Budget> places_;
  const std::shared_ptr<Budget> bytes_;
  Mutex mu_;
  CondVar has_work_or_stops_;
  std::deque<Task> queue_ ABSL_GUARDED_BY(mu_);
  bool stopping_ ABSL_GUARDED_BY(mu_) = false;
  std::vector<std::thread> threads_;
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_EXECUTOR_H_
