#ifndef DYNMESH_SERVER_RPC_CONVERT_ADAPT_H_
#define DYNMESH_SERVER_RPC_CONVERT_ADAPT_H_

#include <cstdint>

#include "absl/status/statusor.h"
#include "core/adapt/adapt.h"
#include "dynmesh/v1/adapt.pb.h"
#include "server/session/limits.h"

/// Between messages and values of adapt.proto.
namespace dynmesh {

/// Errors: INVALID_ARGUMENT BAD_ARGUMENT.
absl::StatusOr<AdaptOptions> ToAdaptOptions(const v1::AdaptSessionRequest& request, const Limits& limits);

void FromAdaptProgress(const AdaptProgress& progress, int64_t revision, v1::AdaptProgress* message);
void FromAdaptResult(const AdaptResult& result, int64_t revision, v1::AdaptResult* message);

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_RPC_CONVERT_ADAPT_H_
