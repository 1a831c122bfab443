#include "server/rpc/adapt_service.h"

#include "dynmesh/v1/adapt.grpc.pb.h"
#include "server/rpc/adapt_reactor.h"

namespace dynmesh {
namespace {

class AdaptService final : public v1::AdaptService::CallbackService {
 public:
  explicit AdaptService(const ServiceContext& services) : services_(services) {}

  grpc::ServerWriteReactor<v1::AdaptSessionResponse>* AdaptSession(
      grpc::CallbackServerContext* context, const v1::AdaptSessionRequest* request) override {
    return (new AdaptReactor(services_, context, *request))->Start();
  }

 private:
  const ServiceContext services_;
};

}  // namespace

std::unique_ptr<grpc::Service> MakeAdaptService(const ServiceContext& context) {
  return std::make_unique<AdaptService>(context);
}

}  // namespace dynmesh
