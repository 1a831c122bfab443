#include "server/rpc/edits_service.h"

#include "core/mesh/error.h"
#include "dynmesh/v1/edits.grpc.pb.h"
#include "server/rpc/apply_edits.h"
#include "server/rpc/stream_edits_reactor.h"
#include "server/rpc/unary.h"

namespace dynmesh {
namespace {

class EditsService final : public v1::EditService::CallbackService {
 public:
  explicit EditsService(const ServiceContext& services) : services_(services) {}

  grpc::ServerUnaryReactor* ApplyEdits(grpc::CallbackServerContext* context,
                                       const v1::ApplyEditsRequest* request,
                                       v1::ApplyEditsResponse* response) override {
    return RunOnSession({"ApplyEdits", context, services_}, request->session(),
                        {AccessMode::kWrite, /*heavy=*/false, MemoryOf(*request)},
                        [request, response](const SessionPtr& session, AccessGrant) {
                          return dynmesh::ApplyEdits(*session, *request, response);
                        });
  }

  grpc::ServerBidiReactor<v1::StreamEditsRequest, v1::StreamEditsResponse>* StreamEdits(
      grpc::CallbackServerContext*) override {
    return (new StreamEditsReactor(services_))->Start();
  }

 private:
  const ServiceContext services_;
};

}  // namespace

std::unique_ptr<grpc::Service> MakeEditsService(const ServiceContext& context) {
  return std::make_unique<EditsService>(context);
}

}  // namespace dynmesh
