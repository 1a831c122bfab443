#ifndef DYNMESH_SERVER_SESSION_DURABILITY_REVISION_GATE_H_
#define DYNMESH_SERVER_SESSION_DURABILITY_REVISION_GATE_H_

#include <cstdint>
#include <map>

#include "absl/base/thread_annotations.h"
#include "absl/functional/any_invocable.h"
#include "absl/status/status.h"
#include "server/session/executor.h"
#include "server/session/mutex.h"

namespace dynmesh {

/// Those who wait until a session has reached a revision, e.g. on disk.
///
/// Thread safety: full. The executor must outlive it.
class RevisionGate {
 public:
  using Done = absl::AnyInvocable<void(const absl::Status&)>;

  RevisionGate(int64_t reached, Executor* executor) : executor_(executor), reached_(reached) {}

  /// Calls `done` once: at once if the revision is reached or never will be, else later, on a thread of the
  /// executor.
  void Wait(int64_t revision, Done done);

  /// The same, for a thread that has nothing better to do; needs no executor.
  absl::Status Await(int64_t revision);

  /// Everything up to `revision` is there.
  void Reach(int64_t revision);

  /// Nothing more will be reached: whoever waits, or comes later for more than was, gets `status`. The first
  /// call counts.
  void Fail(const absl::Status& status);

  int64_t reached() const;
  /// What Fail() was called with.
  absl::Status status() const;

 private:
  using Waiting = std::multimap<int64_t, Done>;

  void Post(Waiting due, const absl::Status& status);

  Executor* const executor_;
  mutable Mutex mu_;
  CondVar changed_;
  int64_t reached_ ABSL_GUARDED_BY(mu_);
  absl::Status status_ ABSL_GUARDED_BY(mu_);
  Waiting waiting_ ABSL_GUARDED_BY(mu_);
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_DURABILITY_REVISION_GATE_H_
