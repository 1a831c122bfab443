#ifndef DYNMESH_SERVER_RPC_BACKUPS_SERVICE_H_
#define DYNMESH_SERVER_RPC_BACKUPS_SERVICE_H_

#include <memory>

#include "server/rpc/service_context.h"

namespace grpc {
class Service;
}

namespace dynmesh {

/// The service of proto/dynmesh/v1/backups.proto.
std::unique_ptr<grpc::Service> MakeBackupsService(const ServiceContext& context);

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_RPC_BACKUPS_SERVICE_H_
