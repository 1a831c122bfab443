#ifndef DYNMESH_SERVER_RPC_CHUNK_STREAM_H_
#define DYNMESH_SERVER_RPC_CHUNK_STREAM_H_

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "grpcpp/server_context.h"
#include "grpcpp/support/server_callback.h"
#include "server/rpc/status.h"
#include "server/session/catch_exceptions.h"
#include "server/session/executor.h"
#include "server/session/session_errors.h"

namespace dynmesh {

/// Base of the RPCs that answer one request by chunks of one answer, which is gathered first.
///
///     class GetBoundaryReactor final : public ChunkStreamReactor<v1::GetBoundaryResponse> { ... };
///     return (new GetBoundaryReactor(...))->Start(executor);
///
/// One write is in flight at a time; chunks that were sent are freed. Deletes itself.
template <typename Response>
class ChunkStreamReactor : public grpc::ServerWriteReactor<Response> {
 public:
  ChunkStreamReactor(const char* rpc, grpc::CallbackServerContext* context) : rpc_(rpc), context_(context) {}

  /// Gathers the answer on `executor`, then writes it.
  ChunkStreamReactor* Start(Executor& executor) {
    const absl::Status posted = executor.TryPost([this] {
      const absl::Status status =
          context_->IsCancelled() ? CallCancelled() : CatchExceptions([this] { return Gather(); });
      status.ok() ? WriteNext() : this->Finish(LoggedStatus(rpc_, status));
    });
    if (!posted.ok()) this->Finish(LoggedStatus(rpc_, posted));
    return this;
  }

  void OnWriteDone(bool ok) final { ok ? WriteNext() : this->Finish(ToGrpcStatus(CallCancelled())); }
  void OnDone() final { delete this; }

 protected:
  /// Computes the answer. Runs once, before NextChunk().
  virtual absl::Status Gather() = 0;
  /// Fills the next message; false when there is none.
  virtual absl::StatusOr<bool> NextChunk(Response* response) = 0;

 private:
  void WriteNext() {
    const absl::StatusOr<bool> more = CatchExceptions([this] {
      response_.Clear();
      return NextChunk(&response_);
    });
    if (!more.ok()) return this->Finish(LoggedStatus(rpc_, more.status()));
    *more ? this->StartWrite(&response_) : this->Finish(grpc::Status::OK);
  }

  const char* const rpc_;
  grpc::CallbackServerContext* const context_;
  Response response_;
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_RPC_CHUNK_STREAM_H_
