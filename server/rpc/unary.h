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

/// How a call at a session ended.
struct CallEnd {
  grpc::ServerUnaryReactor* reactor;  ///< to be finished
  SessionPtr session;
  absl::Status status;
};

/// Runs fn(session, grant) when it is its turn at the session of that name, then end(CallEnd).
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
      end(CallEnd{reactor, session, status});
    };
    posted = PostWork(call.services, *session, work, std::move(task));
  }
  if (!posted.ok()) reactor->Finish(LoggedStatus(call.rpc, posted));
  return reactor;
}

/// Runs fn(session) on a heavy thread, whose turn at the request's session it is not, then end(CallEnd). For
/// what waits for the disk.
template <typename Request, typename Fn, typename End>
grpc::ServerUnaryReactor* RunOutOfTurn(const UnaryCall& call, const Request* request, Fn fn, End end) {
  grpc::ServerUnaryReactor* reactor = call.context->DefaultReactor();
  const absl::Status size = CheckMessageSize(*request, call.services.limits());
  const absl::StatusOr<SessionPtr> session =
      size.ok() ? call.services.registry.Find(request->session()) : size;
  absl::Status posted = session.status();
  if (session.ok()) {
    auto task = [call, reactor, session = *session, fn = std::move(fn), end] {
      const absl::Status stopped = CallStop(call.context).Check();
      end(CallEnd{reactor, session, stopped.ok() ? CatchExceptions([&] { return fn(session); }) : stopped});
    };
    posted = call.services.heavy().TryPost(std::move(task), request->ByteSizeLong());
  }
  if (!posted.ok()) reactor->Finish(LoggedStatus(call.rpc, posted));
  return reactor;
}

/// Answers a call at once.
struct AnswerNow {
  const char* rpc;

  void operator()(const CallEnd& ended) const { ended.reactor->Finish(LoggedStatus(rpc, ended.status)); }
};

/// Answers a call that edits when what it did may be acknowledged. REQUIRES: `response` has the revision that
/// was made and a durable_revision.
template <typename Response>
struct AnswerAcknowledged {
  const char* rpc;
  Response* response;

  void operator()(const CallEnd& ended) const {
    if (!ended.status.ok()) return ended.reactor->Finish(LoggedStatus(rpc, ended.status));
    ended.session->AwaitAcknowledged(
        response->revision(), [rpc = rpc, response = response, ended](const absl::Status& acknowledged) {
          response->set_durable_revision(ended.session->durable_revision());
          ended.reactor->Finish(LoggedStatus(rpc, acknowledged));
        });
  }
};

/// Answers a unary call by fn(session, grant), run when it is its turn at the session of that name.
template <typename Fn>
grpc::ServerUnaryReactor* RunOnSession(const UnaryCall& call, const std::string& session_name,
                                       const SessionWork& work, Fn fn) {
  return RunInTurn(call, session_name, work, std::move(fn), AnswerNow{call.rpc});
}

/// The same for a call that edits.
template <typename Response, typename Fn>
grpc::ServerUnaryReactor* RunEdit(const UnaryCall& call, const std::string& session_name,
                                  const SessionWork& work, Response* response, Fn fn) {
  return RunInTurn(call, session_name, work, std::move(fn), AnswerAcknowledged<Response>{call.rpc, response});
}

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_RPC_UNARY_H_
