#ifndef DYNMESH_SERVER_SESSION_STOP_SIGNAL_H_
#define DYNMESH_SERVER_SESSION_STOP_SIGNAL_H_

#include "absl/status/status.h"

namespace dynmesh {

/// What a long computation asks, every few thousand steps, to learn whether its result is still wanted.
class StopSignal {
 public:
  virtual ~StopSignal() = default;

  /// OK to go on; else what the computation ends with: CANCELLED, DEADLINE_EXCEEDED. Called from the thread
  /// that computes; must not block.
  virtual absl::Status Check() const = 0;

  /// One that never stops anything.
  static const StopSignal& Never();
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_STOP_SIGNAL_H_
