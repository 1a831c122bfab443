#ifndef DYNMESH_SERVER_SESSION_FOLLOWER_H_
#define DYNMESH_SERVER_SESSION_FOLLOWER_H_

#include <cstdint>
#include <memory>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "absl/types/optional.h"
#include "server/session/delta_source.h"
#include "server/session/mutex.h"
#include "server/session/session.h"

namespace dynmesh {

/// Where a follower's payloads go: one stream of the RPC layer.
///
/// Neither call may block, and neither is made while the follower or the session holds a lock.
class DeltaSink {
 public:
  virtual ~DeltaSink() = default;

  /// Starts sending; the sink then calls Follower::OnSent(), and only then gets the next payload.
  virtual void Send(PayloadPtr payload) = 0;

  /// The last call, made exactly once; `status` is what the stream ends with.
  virtual void End(const absl::Status& status) = 0;
};

struct FollowOptions {
  int64_t from_revision = 0;
  std::string session_uid = {};  ///< of the session that from_revision is of; empty: not known
  Codec codec = Codec::kUnspecified;
  int position_bits = 0;                               ///< 0: lossless
  absl::Duration min_interval = absl::ZeroDuration();  ///< at least this long between consistent deltas
};

/// One who follows a session: a revision, and at most one payload in flight. Nothing is queued.
///
///     kStepping  a step is posted or runs, or waits for a payload that another follower makes
///     kSending   the sink has a payload; OnSent() goes on from here
///     kIdle      the client has everything; Wake() makes a step
///     kPausing   there is something new, but min_interval is not over; the timer makes a step
///     kEnded     the sink has been told
///
/// End() ends an idle or pausing follower at once, and others as soon as their step or sending is over.
///
/// The first delta that is consistent is sent even when it is empty: so the client learns where it stands.
/// Thread safety: full. Owned by the session's FollowerList and by its own tasks.
class Follower : public std::enable_shared_from_this<Follower> {
 public:
  /// `sink` must live until its End(), or until Begin() has failed.
  Follower(SessionPtr session, const FollowOptions& options, DeltaSink* sink);

  /// Adds this to its session and starts. When it fails, the sink is never called.
  /// Errors: INVALID_ARGUMENT BAD_ARGUMENT; ABORTED SESSION_RECREATED; OUT_OF_RANGE REVISION_IN_FUTURE;
  /// RESOURCE_EXHAUSTED LIMIT_EXCEEDED; NOT_FOUND SESSION_DELETED; UNAVAILABLE SHUTTING_DOWN.
  absl::Status Begin();

  /// The sink is done with the payload; not `ok`: the peer is gone.
  void OnSent(bool ok);

  /// There is a newer revision. Never blocks.
  void Wake();

  /// Asks for the end; the first status wins.
  void End(const absl::Status& status);

 private:
  enum class State { kIdle, kStepping, kSending, kPausing, kEnded };

  static constexpr int64_t kNoWalk = -1;

  void Step();
  void OnPayload(const absl::StatusOr<PayloadPtr>& payload);
  void OnPauseOver();
  /// Puts a step into the executor, or on the timer when it is too early.
  void PostStep() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mu_);
  void RequestEnd(const absl::Status& status) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mu_);
  /// Whether the end was asked for; from then on the caller owes Finish().
  bool TakeEnd() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mu_);
  void Finish() ABSL_LOCKS_EXCLUDED(mu_);
  void Advance(const Payload& payload) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mu_);
  void RestOrStep() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mu_);
  bool HasMore() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mu_);
  DeltaKey NextKey() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mu_);

  const FollowOptions options_;
  DeltaSink* const sink_;

  Mutex mu_;
  SessionPtr session_ ABSL_GUARDED_BY(mu_);  ///< null once ended: a follower keeps no deleted session alive
  State state_ ABSL_GUARDED_BY(mu_) = State::kStepping;
  absl::Status end_ ABSL_GUARDED_BY(mu_);  ///< what to end with
  bool ending_ ABSL_GUARDED_BY(mu_) = false;
  PayloadPtr sending_ ABSL_GUARDED_BY(mu_);

  int64_t base_ ABSL_GUARDED_BY(mu_);  ///< what the client has for certain: the last consistent revision
  int64_t from_
      ABSL_GUARDED_BY(mu_);  ///< what the next difference starts from; later than base_ when closing
  bool owes_delta_ ABSL_GUARDED_BY(mu_) = true;  ///< a consistent one, even if empty
  int64_t walk_start_ ABSL_GUARDED_BY(mu_) = kNoWalk;
  DiffCursor cursor_ ABSL_GUARDED_BY(mu_);
  absl::Time not_before_ ABSL_GUARDED_BY(mu_) = absl::InfinitePast();
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_FOLLOWER_H_
