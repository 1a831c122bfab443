#ifndef DYNMESH_SERVER_HEALTH_PROBE_H_
#define DYNMESH_SERVER_HEALTH_PROBE_H_

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/time/time.h"

namespace dynmesh {

/// Where a health check of the own machine reaches a daemon with these flags: its first address, by loopback
/// where it listens on all, else its unix socket; empty when there is neither, or the port is not known.
std::string ProbeTarget(const std::vector<std::string>& listen, const std::string& unix_socket);

/// Asks the server at `target` by grpc.health.v1.Health/Check; OK when it answers SERVING within `timeout`.
/// Errors: UNAVAILABLE, saying what it answered.
absl::Status ProbeHealth(const std::string& target, absl::Duration timeout);

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_HEALTH_PROBE_H_
