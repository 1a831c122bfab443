#ifndef DYNMESH_SERVER_RPC_APPLY_EDITS_H_
#define DYNMESH_SERVER_RPC_APPLY_EDITS_H_

#include "absl/status/status.h"
#include "dynmesh/v1/edits.pb.h"
#include "server/rpc/service_context.h"

namespace dynmesh {

/// One batch: what ApplyEdits answers, and StreamEdits in band.
absl::Status ApplyEdits(const ServiceContext& services, const v1::ApplyEditsRequest& request,
                        v1::ApplyEditsResponse* response);

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_RPC_APPLY_EDITS_H_
