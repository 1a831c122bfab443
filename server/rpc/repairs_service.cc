#include "server/rpc/repairs_service.h"

#include "dynmesh/v1/repairs.grpc.pb.h"
#include "server/rpc/repair_reactor.h"

namespace dynmesh {
namespace {

class RepairsService final : public v1::RepairService::CallbackService {
 public:
  explicit RepairsService(const ServiceContext& services) : services_(services) {}

  grpc::ServerWriteReactor<v1::RepairSessionResponse>* RepairSession(
      grpc::CallbackServerContext* context, const v1::RepairSessionRequest* request) override {
    return (new RepairReactor(services_, context, *request))->Start();
  }

 private:
  const ServiceContext services_;
};

}  // namespace

std::unique_ptr<grpc::Service> MakeRepairsService(const ServiceContext& context) {
  return std::make_unique<RepairsService>(context);
}

}  // namespace dynmesh
