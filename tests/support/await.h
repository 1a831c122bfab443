#ifndef DYNMESH_TESTS_SUPPORT_AWAIT_H_
#define DYNMESH_TESTS_SUPPORT_AWAIT_H_

#include "absl/base/thread_annotations.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "server/session/mutex.h"

namespace dynmesh::testing {

/// How long a test waits for something that must happen.
inline constexpr absl::Duration kPatience = absl::Seconds(60);

/// Waits until pred() holds; false when that takes too long. REQUIRES: whoever makes it true notifies
/// `changed`.
template <typename Pred>
bool AwaitThat(Mutex* mu, CondVar& changed, Pred pred) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mu) {
  const absl::Time deadline = absl::Now() + kPatience;
  while (!pred()) {
    if (!changed.WaitUntil(mu, deadline)) return pred();
  }
  return true;
}

}  // namespace dynmesh::testing

#endif  // DYNMESH_TESTS_SUPPORT_AWAIT_H_
