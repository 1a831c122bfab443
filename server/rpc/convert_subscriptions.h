#ifndef DYNMESH_SERVER_RPC_CONVERT_SUBSCRIPTIONS_H_
#define DYNMESH_SERVER_RPC_CONVERT_SUBSCRIPTIONS_H_

#include <string>

#include "absl/status/statusor.h"
#include "dynmesh/v1/subscriptions.pb.h"
#include "server/session/follower.h"

namespace dynmesh {

/// Errors: INVALID_ARGUMENT BAD_ARGUMENT.
absl::StatusOr<FollowOptions> ToFollowOptions(const v1::SubscribeRequest& request);

/// A serialised SubscribeResponse up to where the bytes of `payload.delta` follow.
std::string FromPayloadHead(const Payload& payload);

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_RPC_CONVERT_SUBSCRIPTIONS_H_
