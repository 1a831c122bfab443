#ifndef DYNMESH_SERVER_HEALTH_PROBE_H_
#define DYNMESH_SERVER_HEALTH_PROBE_H_

#include <string>

#include "absl/status/status.h"
#include "absl/time/time.h"

namespace dynmesh {

/// Asks the server at `target` by grpc.health.v1.Health/Check; OK when it answers SERVING within `timeout`.
/// Errors: UNAVAILABLE, saying what it answered.
absl::Status ProbeHealth(const std::string& target, absl::Duration timeout);

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_HEALTH_PROBE_H_
