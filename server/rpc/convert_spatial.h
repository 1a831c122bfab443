#ifndef DYNMESH_SERVER_RPC_CONVERT_SPATIAL_H_
#define DYNMESH_SERVER_RPC_CONVERT_SPATIAL_H_

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/mesh/box.h"
#include "dynmesh/v1/queries.pb.h"
#include "server/session/spatial_queries.h"

/// What the queries by place ask and answer. To...() lets only finite numbers through.
/// Errors: INVALID_ARGUMENT BAD_ARRAY_LENGTH, NON_FINITE_VALUE, BAD_ARGUMENT; metadata "field", and "index"
/// of the point or ray that offends.
namespace dynmesh {

/// Errors also: BAD_ARGUMENT unless low <= high on each axis.
absl::StatusOr<Box> ToBox(const v1::Box& message, absl::string_view field);

absl::StatusOr<NearestQuestion> ToNearestQuestion(const v1::FindNearestVerticesRequest& request);

/// Errors also: BAD_ENTITY_KIND.
absl::StatusOr<LocateQuestion> ToLocateQuestion(const v1::LocatePointsRequest& request);

/// Errors also: BAD_ARGUMENT for a direction of zero.
absl::StatusOr<RaysQuestion> ToRaysQuestion(const v1::CastRaysRequest& request);

void FromScoredChunk(const ScoredChunk& chunk, v1::FindNearestVerticesResponse* response);
void FromScoredChunk(const ScoredChunk& chunk, v1::CastRaysResponse* response);

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_RPC_CONVERT_SPATIAL_H_
