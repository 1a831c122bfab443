#include "server/rpc/subscribe_reactor.h"

#include <utility>

#include "server/rpc/convert_subscriptions.h"
#include "server/rpc/status.h"
#include "server/session/session_errors.h"

namespace dynmesh {
namespace {

constexpr char kSubscribeRpc[] = "Subscribe";

void DropPayload(void* payload) { delete static_cast<PayloadPtr*>(payload); }

/// A slice that shares the payload's bytes and keeps them alive.
grpc::Slice SharedSlice(PayloadPtr payload) {
  auto* owner = new PayloadPtr(std::move(payload));
  const std::string& delta = (*owner)->delta;
  return grpc::Slice(const_cast<char*>(delta.data()), delta.size(), DropPayload, owner);
}

}  // namespace

SubscribeReactor* SubscribeReactor::Refuse(const absl::Status& status) {
  Finish(LoggedStatus(kSubscribeRpc, status));
  return this;
}

SubscribeReactor* SubscribeReactor::Start(const SessionPtr& session, const FollowOptions& options) {
  follower_ = std::make_shared<Follower>(session, options, this);
  // From here on the follower may end this call, so nothing but its answer is looked at.
  const absl::Status begun = std::shared_ptr<Follower>(follower_)->Begin();
  return begun.ok() ? this : Refuse(begun);
}

void SubscribeReactor::OnWriteDone(bool ok) {
  buffer_.Clear();
  follower_->OnSent(ok);
}

void SubscribeReactor::OnCancel() {
  if (follower_ != nullptr) follower_->End(CallCancelled());
}

void SubscribeReactor::Send(PayloadPtr payload) {
  const grpc::Slice slices[] = {grpc::Slice(FromPayloadHead(*payload)), SharedSlice(payload)};
  buffer_ = grpc::ByteBuffer(slices, 2);
  StartWrite(&buffer_);
}

void SubscribeReactor::End(const absl::Status& status) { Finish(LoggedStatus(kSubscribeRpc, status)); }

}  // namespace dynmesh
