#include "server/rpc/subscriptions_service.h"

#include "core/mesh/error.h"
#include "dynmesh/v1/subscriptions.grpc.pb.h"
#include "grpcpp/impl/codegen/proto_utils.h"
#include "server/rpc/convert_subscriptions.h"
#include "server/rpc/subscribe_reactor.h"
#include "server/rpc/unary.h"
#include "server/session/session_errors.h"

namespace dynmesh {
namespace {

absl::StatusOr<v1::SubscribeRequest> ParseRequest(const grpc::ByteBuffer& bytes, const Limits& limits) {
  if (bytes.Length() > limits.max_message_bytes) {
    return LimitExceeded("max_message_bytes", limits.max_message_bytes, bytes.Length());
  }
  v1::SubscribeRequest request;
  grpc::ByteBuffer copy(bytes);
  if (grpc::SerializationTraits<v1::SubscribeRequest>::Deserialize(&copy, &request).ok()) return request;
  return BadField("request", "the request is no SubscribeRequest");
}

/// Raw: responses are bytes already, because many streams share them.
class SubscriptionsService final
    : public v1::SubscriptionService::WithRawCallbackMethod_Subscribe<v1::SubscriptionService::Service> {
 public:
  explicit SubscriptionsService(const ServiceContext& services) : services_(services) {}

  grpc::ServerWriteReactor<grpc::ByteBuffer>* Subscribe(grpc::CallbackServerContext*,
                                                        const grpc::ByteBuffer* bytes) override {
    auto* reactor = new SubscribeReactor();
    const absl::StatusOr<v1::SubscribeRequest> request = ParseRequest(*bytes, services_.limits());
    if (!request.ok()) return reactor->Refuse(request.status());
    const absl::StatusOr<SessionPtr> session = services_.registry.Find(request->session());
    if (!session.ok()) return reactor->Refuse(session.status());
    const absl::StatusOr<FollowOptions> options = ToFollowOptions(*request);
    if (!options.ok()) return reactor->Refuse(options.status());
    return reactor->Start(*session, *options);
  }

 private:
  const ServiceContext services_;
};

}  // namespace

std::unique_ptr<grpc::Service> MakeSubscriptionsService(const ServiceContext& context) {
  return std::make_unique<SubscriptionsService>(context);
}

}  // namespace dynmesh
