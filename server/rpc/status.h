#ifndef DYNMESH_SERVER_RPC_STATUS_H_
#define DYNMESH_SERVER_RPC_STATUS_H_

#include "absl/status/status.h"
#include "core/mesh/error.h"
#include "grpcpp/support/status.h"

namespace dynmesh {

/// The reason and metadata that `status` carries; for one without, a reason that fits its code.
ErrorDetail DetailOf(const absl::Status& status);

/// `status` as gRPC sends it: with details that hold google.rpc.ErrorInfo{reason, "dynmesh", metadata}.
/// Message and metadata are shortened to what fits into a trailer.
grpc::Status ToGrpcStatus(const absl::Status& status);

/// The same, with a line in the log: errors of ours as ERROR, faults of the peer as WARN, what belongs to
/// normal work (not found, aborted, cancelled) as DEBUG. `rpc` is the method's name.
grpc::Status LoggedStatus(const char* rpc, const absl::Status& status);

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_RPC_STATUS_H_
