#ifndef DYNMESH_SERVER_RPC_SUBSCRIBE_REACTOR_H_
#define DYNMESH_SERVER_RPC_SUBSCRIBE_REACTOR_H_

#include <memory>

#include "dynmesh/v1/subscriptions.pb.h"
#include "grpcpp/support/byte_buffer.h"
#include "grpcpp/support/server_callback.h"
#include "server/session/follower.h"

namespace dynmesh {

/// One Subscribe call: hands a follower's payloads to gRPC as bytes. The encoded delta is one block of
/// memory, shared by all streams that send it; only the few bytes before it are made for each.
///
///     Session <── Follower ──(DeltaSink)──> SubscribeReactor ──> gRPC
///
/// The follower decides when the call ends; cancelling only asks it to. Deletes itself.
class SubscribeReactor final : public grpc::ServerWriteReactor<grpc::ByteBuffer>, public DeltaSink {
 public:
  SubscribeReactor() = default;

  /// Ends the call at once with `status`.
  SubscribeReactor* Refuse(const absl::Status& status);
  SubscribeReactor* Start(const SessionPtr& session, const FollowOptions& options);

  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override { delete this; }

  void Send(PayloadPtr payload) override;
  void End(const absl::Status& status) override;

 private:
  std::shared_ptr<Follower> follower_;  ///< null when refused
  grpc::ByteBuffer buffer_;
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_RPC_SUBSCRIBE_REACTOR_H_
