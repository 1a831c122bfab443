#include "server/session/follower.h"

#include <utility>

#include "absl/time/clock.h"
#include "core/mesh/error.h"
#include "server/session/session_errors.h"

namespace dynmesh {
namespace {

constexpr int kMaxPositionBits = 30;
constexpr absl::Duration kMaxInterval = absl::Hours(1);

absl::Status CheckOptions(const FollowOptions& options, const Session& session) {
  if (!options.session_uid.empty() && options.session_uid != session.uid()) {
    return SessionRecreated(session.name(), options.session_uid, session.uid());
  }
  const int64_t revision = session.revision();
  if (options.from_revision < 0) return BadField("from_revision", "from_revision is negative");
  if (options.from_revision > revision) return RevisionInFuture(options.from_revision, revision);
  if (options.position_bits < 0 || options.position_bits > kMaxPositionBits) {
    return BadField("position_bits", "position_bits is outside 0-30");
  }
  if (options.min_interval < absl::ZeroDuration() || options.min_interval > kMaxInterval) {
    return BadField("min_interval_ms", "min_interval_ms is outside 0-3600000");
  }
  return absl::OkStatus();
}

}  // namespace

Follower::Follower(SessionPtr session, const FollowOptions& options, DeltaSink* sink)
    : options_(options),
      sink_(sink),
      session_(std::move(session)),
      base_(options.from_revision),
      from_(base_) {}

absl::Status Follower::Begin() {
  SessionPtr session;
  {
    MutexLock lock(&mu_);
    session = session_;
  }
  absl::Status begun = CheckOptions(options_, *session);
  if (begun.ok()) begun = session->followers().Add(shared_from_this());
  MutexLock lock(&mu_);
  if (begun.ok()) {
    PostStep();
  } else {
    state_ = State::kEnded;
    session_ = nullptr;
  }
  return begun;
}

void Follower::OnSent(bool ok) {
  bool over = false;
  {
    MutexLock lock(&mu_);
    const PayloadPtr sent = std::move(sending_);
    if (!ok) RequestEnd(CallCancelled());
    over = TakeEnd();
    if (!over) {
      Advance(*sent);
      RestOrStep();
    }
  }
  if (over) Finish();
}

void Follower::Wake() {
  MutexLock lock(&mu_);
  // It may have seen the revision by itself, on its way to rest.
  if (state_ == State::kIdle && HasMore()) PostStep();
}

void Follower::End(const absl::Status& status) {
  bool over = false;
  {
    MutexLock lock(&mu_);
    RequestEnd(status);
    if (state_ == State::kIdle || state_ == State::kPausing) over = TakeEnd();
  }
  if (over) Finish();
}

void Follower::Step() {
  bool over = false;
  DeltaKey key;
  SessionPtr session;
  {
    MutexLock lock(&mu_);
    over = TakeEnd();
    if (!over) {
      key = NextKey();
      session = session_;
    }
  }
  if (over) return Finish();
  session->deltas().Get(key, [self = shared_from_this()](const absl::StatusOr<PayloadPtr>& payload) {
    self->OnPayload(payload);
  });
}

void Follower::OnPayload(const absl::StatusOr<PayloadPtr>& payload) {
  bool over = false;
  {
    MutexLock lock(&mu_);
    if (!payload.ok()) RequestEnd(payload.status());
    over = TakeEnd();
    if (!over) {
      state_ = State::kSending;
      sending_ = *payload;
    }
  }
  if (over) return Finish();
  sink_->Send(*payload);
}

void Follower::OnPauseOver() {
  MutexLock lock(&mu_);
  if (state_ == State::kPausing) PostStep();
}

void Follower::PostStep() {
  auto self = shared_from_this();
  if (absl::Now() < not_before_) {
    state_ = State::kPausing;
    session_->workers().timer->RunAt(not_before_, [self] { self->OnPauseOver(); });
    return;
  }
  state_ = State::kStepping;
  session_->workers().quick->Post([self] { self->Step(); });
}

void Follower::RequestEnd(const absl::Status& status) {
  if (ending_) return;
  ending_ = true;
  end_ = status;
}

bool Follower::TakeEnd() {
  if (ending_) state_ = State::kEnded;
  return ending_;
}

void Follower::Finish() {
  SessionPtr session;
  absl::Status status;
  {
    MutexLock lock(&mu_);
    session = std::move(session_);
    status = end_;
  }
  session->followers().Remove(shared_from_this());
  if (session->followers().size() == 0) session->deltas().Forget();
  sink_->End(status);
}

void Follower::Advance(const Payload& payload) {
  if (payload.consistent) {
    base_ = from_ = payload.revision;
    walk_start_ = kNoWalk;
    owes_delta_ = false;
    not_before_ = absl::Now() + options_.min_interval;
    return;
  }
  if (walk_start_ == kNoWalk) walk_start_ = payload.revision;
  cursor_ = payload.next;
  if (!cursor_.done()) return;
  // All parts are sent, but there were edits meanwhile: what changed since the first part makes it exact.
  from_ = walk_start_;
  walk_start_ = kNoWalk;
  owes_delta_ = true;
}

void Follower::RestOrStep() {
  state_ = State::kIdle;
  if (HasMore()) PostStep();
}

bool Follower::HasMore() const {
  return owes_delta_ || walk_start_ != kNoWalk || session_->revision() > from_;
}

DeltaKey Follower::NextKey() const {
  DeltaKey key;
  key.from_revision = from_;
  key.base_revision = base_;
  key.at_least = session_->revision();
  key.walk_start = walk_start_;
  if (walk_start_ != kNoWalk) key.cursor = cursor_;
  key.codec = options_.codec;
  key.position_bits = options_.position_bits;
  return key;
}

}  // namespace dynmesh
