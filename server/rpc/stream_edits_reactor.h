#ifndef DYNMESH_SERVER_RPC_STREAM_EDITS_REACTOR_H_
#define DYNMESH_SERVER_RPC_STREAM_EDITS_REACTOR_H_

#include <deque>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "dynmesh/v1/edits.pb.h"
#include "grpcpp/support/server_callback.h"
#include "server/rpc/call_stop.h"
#include "server/rpc/open_streams.h"
#include "server/rpc/service_context.h"
#include "server/session/budget.h"
#include "server/session/mutex.h"

namespace dynmesh {

/// One StreamEdits call: three stages that run at the same time, with a short queue between each two.
///
///     read ──> requests_ ──> apply (its turn at the session) ──> responses_ ──> write
///
/// Batches wait for their session without a thread, and one after the other for the same session share a
/// turn. What waits counts against the daemon's max_queued_bytes; a batch that found no room there is
/// refused. Batches are applied and answered in order; a refused one is answered in band. A peer that does
/// not read its answers is not read from either. The stream ends OK when the peer has half-closed and has all
/// answers, and with UNAVAILABLE SHUTTING_DOWN, after the answers to what was read, when the server drains.
/// Deletes itself.
class StreamEditsReactor final
    : public grpc::ServerBidiReactor<v1::StreamEditsRequest, v1::StreamEditsResponse>,
      public Drainable {
 public:
  StreamEditsReactor(const ServiceContext& services, const grpc::CallbackServerContext* context)
      : services_(services), stop_(context) {}

  StreamEditsReactor* Start();

  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnDrain() override;
  void OnDone() override;

 private:
  /// A batch that was read.
  struct Request {
    v1::ApplyEditsRequest batch;
    Lease bytes;
    absl::Status refused;  ///< not OK: found no room; the batch is empty then, but for its session
  };

  /// An answer, to be written when those before it are and what it tells of may be acknowledged.
  struct Response {
    v1::StreamEditsResponse message;
    bool ready;
  };

  enum class Action { kNone, kRead, kApply, kWrite, kFinish };

  /// Does what there is to do. One thread at a time is in here: who comes meanwhile leaves it to that thread.
  void Pump() ABSL_LOCKS_EXCLUDED(mu_);
  /// REQUIRES: pumping_ was set by this thread.
  void PumpOn() ABSL_LOCKS_EXCLUDED(mu_);
  /// The next thing to do, marked as begun.
  Action Choose() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mu_);
  bool IsOver() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mu_);
  absl::Status EndStatus() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mu_);
  void Do(Action action) ABSL_LOCKS_EXCLUDED(mu_);
  /// What was read, with its share of max_queued_bytes.
  Request Admit(v1::ApplyEditsRequest batch) const;
  /// Asks for a turn at the session of the first request.
  void PostApply() ABSL_LOCKS_EXCLUDED(mu_);
  void ApplyQueued(const SessionPtr& session);
  void ApplyOne(const SessionPtr& session, const Request& request);
  /// The next request, if it is for `session`.
  bool TakeRequest(const SessionPtr& session, Request* request) ABSL_LOCKS_EXCLUDED(mu_);
  bool TakeFirst(Request* request) ABSL_LOCKS_EXCLUDED(mu_);
  void Refuse(const absl::Status& status, int64_t revision) ABSL_LOCKS_EXCLUDED(mu_);
  void Answer(v1::StreamEditsResponse response) ABSL_LOCKS_EXCLUDED(mu_);
  /// Answers once the session's revision may be acknowledged.
  void AnswerWhenAcknowledged(const SessionPtr& session, v1::StreamEditsResponse response)
      ABSL_LOCKS_EXCLUDED(mu_);
  void StopApplying() ABSL_LOCKS_EXCLUDED(mu_);

  const ServiceContext services_;
  const CallStop stop_;
  v1::StreamEditsRequest reading_into_;
  v1::StreamEditsResponse writing_from_;

  Mutex mu_;
  std::deque<Request> requests_ ABSL_GUARDED_BY(mu_);
  std::deque<Response> responses_ ABSL_GUARDED_BY(mu_);
  size_t awaited_ ABSL_GUARDED_BY(mu_) = 0;        ///< acknowledgements that are still to come
  size_t request_bytes_ ABSL_GUARDED_BY(mu_) = 0;  ///< of requests_
  bool pumping_ ABSL_GUARDED_BY(mu_) = false;      ///< for ever, once the call is finished
  bool reading_ ABSL_GUARDED_BY(mu_) = false;
  bool writing_ ABSL_GUARDED_BY(mu_) = false;
  bool applying_ ABSL_GUARDED_BY(mu_) = false;
  bool closed_ ABSL_GUARDED_BY(mu_) = false;  ///< by the peer
  bool broken_ ABSL_GUARDED_BY(mu_) = false;  ///< a write failed
  bool draining_ ABSL_GUARDED_BY(mu_) = false;
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_RPC_STREAM_EDITS_REACTOR_H_
