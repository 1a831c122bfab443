#ifndef DYNMESH_SERVER_RPC_CONVERT_REPAIRS_H_
#define DYNMESH_SERVER_RPC_CONVERT_REPAIRS_H_

#include "absl/status/statusor.h"
#include "dynmesh/v1/repairs.pb.h"
#include "server/session/repair_session.h"

namespace dynmesh {

/// Errors: INVALID_ARGUMENT BAD_ARGUMENT with metadata "field", and "step" of the step that offends.
absl::StatusOr<RepairRequest> ToRepairRequest(const v1::RepairSessionRequest& request);

void FromRepairOutcome(const RepairOutcome& outcome, v1::RepairResult* result);

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_RPC_CONVERT_REPAIRS_H_
