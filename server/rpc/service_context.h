#ifndef DYNMESH_SERVER_RPC_SERVICE_CONTEXT_H_
#define DYNMESH_SERVER_RPC_SERVICE_CONTEXT_H_

#include "server/rpc/open_streams.h"
#include "server/session/registry.h"

namespace dynmesh {

/// What the services share, borrowed; it outlives the gRPC server.
struct ServiceContext {
  SessionRegistry& registry;
  OpenStreams& streams;

  const Limits& limits() const { return registry.limits(); }
  Executor& quick() const { return *registry.workers().quick; }
  Executor& heavy() const { return *registry.workers().heavy; }
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_RPC_SERVICE_CONTEXT_H_
