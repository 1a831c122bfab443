#include "server/rpc/checks_service.h"

#include "dynmesh/v1/checks.grpc.pb.h"
#include "server/rpc/check_reactor.h"

namespace dynmesh {
namespace {

class ChecksService final : public v1::CheckService::CallbackService {
 public:
  explicit ChecksService(const ServiceContext& services) : services_(services) {}

  grpc::ServerWriteReactor<v1::CheckSessionResponse>* CheckSession(
      grpc::CallbackServerContext* context, const v1::CheckSessionRequest* request) override {
    return (new CheckReactor(services_, context, *request))->Start();
  }

 private:
  const ServiceContext services_;
};

}  // namespace

std::unique_ptr<grpc::Service> MakeChecksService(const ServiceContext& context) {
  return std::make_unique<ChecksService>(context);
}

}  // namespace dynmesh
