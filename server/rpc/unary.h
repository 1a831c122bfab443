#ifndef DYNMESH_SERVER_RPC_UNARY_H_
#define DYNMESH_SERVER_RPC_UNARY_H_

#include <string>
#include <utility>

#include "absl/status/status.h"
#include "google/protobuf/message_lite.h"
#include "grpcpp/server_context.h"
#include "grpcpp/support/server_callback.h"
#include "server/rpc/call_stop.h"
#include "server/rpc/service_context.h"
#include "server/rpc/session_work.h"
#include "server/rpc/status.h"
#include "server/session/catch_exceptions.h"
#include "server/session/executor.h"
#include "server/session/limits.h"
#include "server/session/session_errors.h"

namespace dynmesh {

/// RESOURCE_EXHAUSTED LIMIT_EXCEEDED (max_message_bytes) for a request that is too large.
inline absl::Status CheckMessageSize(const google::protobuf::MessageLite& message, const Limits& limits) {
  const size_t bytes = message.ByteSizeLong();
  if (bytes <= limits.max_message_bytes) return absl::OkStatus();
  return LimitExceeded("max_message_bytes", limits.max_message_bytes, bytes);
}

/// A unary call as its service sees it.
struct UnaryCall {
  const char* rpc;  ///< the method's name, for the log
  grpc::CallbackServerContext* context;
  const ServiceContext& services;  ///< outlives the call
};

/// Answers a unary call by fn(), run on `executor`; fn returns an absl::Status and fills the response before.
/// A call that was cancelled while it waited is not run.
template <typename Fn>
grpc::ServerUnaryReactor* RunUnary(const char* rpc, grpc::CallbackServerContext* context, Executor& executor,
                                   Fn fn) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  const absl::Status posted = executor.TryPost([rpc, context, reactor, fn = std::move(fn)] {
    const absl::Status status = context->IsCancelled() ? CallCancelled() : CatchExceptions(fn);
    reactor->Finish(LoggedStatus(rpc, status));
  });
  if (!posted.ok()) reactor->Finish(LoggedStatus(rpc, posted));
  return reactor;
}

/// How a call in turn ended.
struct TurnEnd {
  grpc::ServerUnaryReactor* reactor;  ///< to be finished
  SessionPtr session;
  absl::Status status;
};

/// Runs fn(session, grant) when it is its turn at the session of that name, then end(TurnEnd).
template <typename Fn, typename End>
grpc::ServerUnaryReactor* RunInTurn(const UnaryCall& call, const std::string& session_name,
                                    const SessionWork& work, Fn fn, End end) {
  grpc::ServerUnaryReactor* reactor = call.context->DefaultReactor();
  const absl::StatusOr<SessionPtr> session = call.services.registry.Find(session_name);
  absl::Status posted = session.status();
  if (session.ok()) {
    auto task = [call, reactor, session = *session, fn = std::move(fn), end](AccessGrant grant) mutable {
      const absl::Status stopped = CallStop(call.context).Check();
      const absl::Status status =
          stopped.ok() ? CatchExceptions([&] { return fn(session, std::move(grant)); }) : stopped;
      grant.Release();
      end(TurnEnd{reactor, session, status});
    };
    posted = PostWork(call.services, *session, work, std::move(task));
  }
  if (!posted.ok()) reactor->Finish(LoggedStatus(call.rpc, posted));
  return reactor;
}

/// Answers a unary call by fn(session, grant), run when it is its turn at the session of that name.
template <typename Fn>
grpc::ServerUnaryReactor* RunOnSession(const UnaryCall& call, const std::string& session_name,
                                       const SessionWork& work, Fn fn) {
  const auto end = [rpc = call.rpc](const TurnEnd& ended) {
    ended.reactor->Finish(LoggedStatus(rpc, ended.status));
  };
  return RunInTurn(call, session_name, work, std::move(fn), end);
}

/// The same for a call that edits: it is answered when what it did may be acknowledged. REQUIRES:
/// `response` has the revision that was made and a durable_revision.
template <typename Response, typename Fn>
grpc::ServerUnaryReactor* RunEdit(const UnaryCall& call, const std::string& session_name,
                                  const SessionWork& work, Response* response, Fn fn) {
  const auto end = [rpc = call.rpc, response](const TurnEnd& ended) {
    if (!ended.status.ok()) return ended.reactor->Finish(LoggedStatus(rpc, ended.status));
    const SessionPtr& session = ended.session;
    session->AwaitAcknowledged(response->revision(),
                               [rpc, response, ended](const absl::Status& acknowledged) {
                                 response->set_durable_revision(ended.session->durable_revision());
                                 ended.reactor->Finish(LoggedStatus(rpc, acknowledged));
                               });
  };
  return RunInTurn(call, session_name, work, std::move(fn), end);
}

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_RPC_UNARY_H_
