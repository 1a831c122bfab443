#ifndef DYNMESH_SERVER_RPC_SPATIAL_REACTORS_H_
#define DYNMESH_SERVER_RPC_SPATIAL_REACTORS_H_

#include "dynmesh/v1/queries.pb.h"
#include "grpcpp/server_context.h"
#include "grpcpp/support/server_callback.h"
#include "server/rpc/service_context.h"

namespace dynmesh {

/// The RPCs of QueryService that ask about places.
grpc::ServerWriteReactor<v1::FindInBoxResponse>* StartFindInBox(const ServiceContext& services,
                                                                grpc::CallbackServerContext* context,
                                                                const v1::FindInBoxRequest& request);
grpc::ServerWriteReactor<v1::FindNearestVerticesResponse>* StartFindNearestVertices(
    const ServiceContext& services, grpc::CallbackServerContext* context,
    const v1::FindNearestVerticesRequest& request);
grpc::ServerWriteReactor<v1::LocatePointsResponse>* StartLocatePoints(const ServiceContext& services,
                                                                      grpc::CallbackServerContext* context,
                                                                      const v1::LocatePointsRequest& request);
grpc::ServerWriteReactor<v1::CastRaysResponse>* StartCastRays(const ServiceContext& services,
                                                              grpc::CallbackServerContext* context,
                                                              const v1::CastRaysRequest& request);

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_RPC_SPATIAL_REACTORS_H_
