#ifndef DYNMESH_SERVER_SESSION_WALL_CLOCK_H_
#define DYNMESH_SERVER_SESSION_WALL_CLOCK_H_

#include "absl/time/clock.h"
#include "absl/time/time.h"

namespace dynmesh {

/// The time to the microsecond, which is what stores keep: so it is the same after a restart.
inline absl::Time NowToTheMicrosecond() { return absl::FromUnixMicros(absl::ToUnixMicros(absl::Now())); }

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_WALL_CLOCK_H_
