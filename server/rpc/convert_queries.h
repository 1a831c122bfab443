#ifndef DYNMESH_SERVER_RPC_CONVERT_QUERIES_H_
#define DYNMESH_SERVER_RPC_CONVERT_QUERIES_H_

#include "absl/status/statusor.h"
#include "dynmesh/v1/queries.pb.h"
#include "server/session/queries.h"

namespace dynmesh {

/// Errors: INVALID_ARGUMENT BAD_ARGUMENT, BAD_ARRAY_LENGTH, NON_FINITE_VALUE.
absl::StatusOr<Selection> ToSelection(const v1::Selection& message, int64_t as_of_revision);

/// How many entities `message` may select when `num_live` are live.
uint64_t CountSelected(const v1::Selection& message, uint64_t num_live);

/// Errors: INVALID_ARGUMENT BAD_ENTITY_KIND.
absl::StatusOr<Neighborhood> ToNeighborhood(const v1::GetNeighborsRequest& request);

void FromNeighborsChunk(const NeighborsChunk& chunk, v1::GetNeighborsResponse* response);
void FromEntitiesChunk(const EntitiesChunk& chunk, v1::GetEntitiesResponse* response);

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_RPC_CONVERT_QUERIES_H_
