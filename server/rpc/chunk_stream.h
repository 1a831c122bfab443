#ifndef DYNMESH_SERVER_RPC_CHUNK_STREAM_H_
#define DYNMESH_SERVER_RPC_CHUNK_STREAM_H_

#include <algorithm>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "grpcpp/server_context.h"
#include "grpcpp/support/server_callback.h"
#include "server/rpc/call_stop.h"
#include "server/rpc/service_context.h"
#include "server/rpc/session_work.h"
#include "server/rpc/status.h"
#include "server/session/catch_exceptions.h"
#include "server/session/query_budget.h"
#include "server/session/session_errors.h"

namespace dynmesh {

/// Where the next piece of `size` items begins; the first piece may be empty, so that a revision arrives.
template <typename Container>
bool TakePiece(const Container& items, size_t size, size_t& next, std::pair<size_t, size_t>& piece) {
  if (next > 0 && next >= items.size()) return false;
  piece = {next, std::min(size, items.size() - next)};
  next = std::max<size_t>(next + piece.second, 1);
  return true;
}

/// Base of the RPCs that answer one request about a session by chunks of one answer, which is gathered first.
///
///     class GetBoundaryReactor final : public ChunkStreamReactor<v1::GetBoundaryResponse> { ... };
///     return (new GetBoundaryReactor(...))->Start(request->session(), request->ByteSizeLong());
///
/// Gathering ends early when the call is cancelled or its deadline passes. One write is in flight at a time;
/// chunks that were sent are freed, and what waits to be sent counts against max_answer_bytes. Deletes
/// itself.
template <typename Response>
class ChunkStreamReactor : public grpc::ServerWriteReactor<Response> {
 public:
  ChunkStreamReactor(const char* rpc, grpc::CallbackServerContext* context, const ServiceContext& services)
      : services_(services), rpc_(rpc), stop_(context), lease_(services.registry.answer_budget()) {}

  /// Gathers the answer when it is its turn at the session, then writes it.
  ChunkStreamReactor* Start(const std::string& session_name, size_t request_bytes) {
    const absl::Status posted = Post(session_name, request_bytes);
    if (!posted.ok()) this->Finish(LoggedStatus(rpc_, posted));
    return this;
  }

  void OnWriteDone(bool ok) final { ok ? WriteNext() : this->Finish(ToGrpcStatus(CallCancelled())); }
  void OnDone() final { delete this; }

 protected:
  /// Whether gathering may take long.
  virtual bool IsHeavy(const Session& session) const = 0;
  /// Computes the answer. Runs once, before NextChunk(). May release the grant when it has read the session.
  virtual absl::Status Gather(const Session& session, const QueryTerms& terms, AccessGrant& grant) = 0;
  /// Fills the next message; false when there is none.
  virtual absl::StatusOr<bool> NextChunk(Response* response) = 0;

  const ServiceContext services_;

 private:
  absl::Status Post(const std::string& session_name, size_t request_bytes) {
    DYNMESH_ASSIGN_OR_RETURN(const SessionPtr session, services_.registry.Find(session_name));
    return PostWork(services_, session, {AccessMode::kRead, IsHeavy(*session), request_bytes},
                    [this, session](AccessGrant grant) { GatherAndWrite(*session, std::move(grant)); });
  }

  void GatherAndWrite(const Session& session, AccessGrant grant) {
    absl::Status status = stop_.Check();
    if (status.ok()) {
      status = CatchExceptions([&] { return Gather(session, {stop_, &lease_}, grant); });
    }
    grant.Release();
    status.ok() ? WriteNext() : this->Finish(LoggedStatus(rpc_, status));
  }

  void WriteNext() {
    const absl::StatusOr<bool> more = CatchExceptions([this] {
      lease_.Shrink(response_.ByteSizeLong());
      response_.Clear();
      return NextChunk(&response_);
    });
    if (!more.ok()) return this->Finish(LoggedStatus(rpc_, more.status()));
    *more ? this->StartWrite(&response_) : this->Finish(grpc::Status::OK);
  }

  const char* const rpc_;
  const CallStop stop_;
  Lease lease_;  ///< of the daemon's max_answer_bytes
  Response response_;
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_RPC_CHUNK_STREAM_H_
