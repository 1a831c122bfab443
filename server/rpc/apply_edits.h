#ifndef DYNMESH_SERVER_RPC_APPLY_EDITS_H_
#define DYNMESH_SERVER_RPC_APPLY_EDITS_H_

#include <cstddef>

#include "absl/status/status.h"
#include "dynmesh/v1/edits.pb.h"
#include "server/session/session.h"

namespace dynmesh {

/// One batch: what ApplyEdits answers, and StreamEdits in band. REQUIRES: it is the caller's turn at
/// `session`.
absl::Status ApplyEdits(Session& session, const v1::ApplyEditsRequest& request, const StopSignal& stop,
                        v1::ApplyEditsResponse* response);

/// About the memory that `request` holds: tiny edits are small on the wire, but not here.
size_t MemoryOf(const v1::ApplyEditsRequest& request);

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_RPC_APPLY_EDITS_H_
