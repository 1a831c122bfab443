#ifndef DYNMESH_SERVER_SESSION_WORKERS_H_
#define DYNMESH_SERVER_SESSION_WORKERS_H_

#include "server/session/executor.h"
#include "server/session/timer.h"

namespace dynmesh {

/// The threads that sessions work on, borrowed from whoever made them; they outlive all sessions.
struct Workers {
  Executor* quick;  ///< edits, queries, encoding of deltas: up to some hundred milliseconds
  Executor* heavy;  ///< builds of imports, validation, exports, surfaces: as long as it takes
  Timer* timer;
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_WORKERS_H_
