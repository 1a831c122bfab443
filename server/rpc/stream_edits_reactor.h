#ifndef DYNMESH_SERVER_RPC_STREAM_EDITS_REACTOR_H_
#define DYNMESH_SERVER_RPC_STREAM_EDITS_REACTOR_H_

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/synchronization/mutex.h"
#include "dynmesh/v1/edits.pb.h"
#include "grpcpp/support/server_callback.h"
#include "server/rpc/open_streams.h"
#include "server/rpc/service_context.h"

namespace dynmesh {

/// One StreamEdits call: batches are applied one after the other, each answered in order.
///
///     read ──> apply (executor) ──> write the answer and read the next at once ──> both done: apply ...
///
/// A refused batch is answered in band. The stream ends OK when the peer has half-closed and has all answers,
/// and with UNAVAILABLE SHUTTING_DOWN, after the answer that is due, when the server drains. Deletes itself.
class StreamEditsReactor final
    : public grpc::ServerBidiReactor<v1::StreamEditsRequest, v1::StreamEditsResponse>,
      public Drainable {
 public:
  explicit StreamEditsReactor(const ServiceContext& services) : services_(services) {}

  StreamEditsReactor* Start();

  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnDrain() override;
  void OnDone() override;

 private:
  enum class Action { kNone, kApply, kFinish };

  /// What to do after a change of state; called once for each, and the answer must be obeyed.
  Action Next() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mu_);
  void Do(Action action) ABSL_LOCKS_EXCLUDED(mu_);
  absl::Status EndStatus() const ABSL_SHARED_LOCKS_REQUIRED(mu_);
  void Apply();
  void Respond(const absl::Status& status);

  const ServiceContext services_;
  v1::StreamEditsRequest request_;
  v1::StreamEditsResponse response_;

  absl::Mutex mu_;
  bool reading_ ABSL_GUARDED_BY(mu_) = false;
  bool writing_ ABSL_GUARDED_BY(mu_) = false;
  bool applying_ ABSL_GUARDED_BY(mu_) = false;
  bool closed_ ABSL_GUARDED_BY(mu_) = false;    ///< by the peer
  bool broken_ ABSL_GUARDED_BY(mu_) = false;    ///< a write failed
  bool draining_ ABSL_GUARDED_BY(mu_) = false;
  bool finished_ ABSL_GUARDED_BY(mu_) = false;
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_RPC_STREAM_EDITS_REACTOR_H_
