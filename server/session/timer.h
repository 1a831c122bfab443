#ifndef DYNMESH_SERVER_SESSION_TIMER_H_
#define DYNMESH_SERVER_SESSION_TIMER_H_

#include <map>
#include <thread>

#include "absl/base/thread_annotations.h"
#include "absl/functional/any_invocable.h"
#include "absl/time/time.h"
#include "server/session/mutex.h"

namespace dynmesh {

/// Calls functions at a later time, on a thread of its own: for followers that asked for a pause.
///
/// A function must be short and must not block: post what takes time to an Executor. There is no
/// cancelling; the function finds out itself whether it is still wanted.
/// Thread safety: full.
class Timer {
 public:
  using Task = absl::AnyInvocable<void()>;

  Timer() : thread_([this] { Run(); }) {}
  Timer(const Timer&) = delete;
  Timer& operator=(const Timer&) = delete;
  ~Timer() { Stop(); }

  /// Dropped after Stop().
  void RunAt(absl::Time when, Task task);

  /// Drops what waits. Not from a task.
  void Stop();

 private:
  void Run();

  Mutex mu_;
  CondVar news_;  ///< a task that may be the first, or the end
  std::multimap<absl::Time, Task> tasks_ ABSL_GUARDED_BY(mu_);
  bool stopping_ ABSL_GUARDED_BY(mu_) = false;
  std::thread thread_;
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_TIMER_H_
