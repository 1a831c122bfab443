#include "server/rpc/stream_edits_reactor.h"

#include <utility>

#include "server/rpc/apply_edits.h"
#include "server/rpc/convert_edits.h"
#include "server/rpc/status.h"
#include "server/session/catch_exceptions.h"

namespace dynmesh {
namespace {

// How far reading may be ahead of applying, and applying ahead of writing.
constexpr size_t kMaxQueued = 64;
constexpr size_t kMaxQueuedBytes = size_t{4} << 20;
// Batches of one stream that are applied before other calls get the thread.
constexpr int kBatchesInARow = 32;

}  // namespace

StreamEditsReactor* StreamEditsReactor::Start() {
  if (services_.streams.Add(this)) {
    Pump();
  } else {
    Finish(ToGrpcStatus(ShuttingDown()));
  }
  return this;
}

void StreamEditsReactor::OnReadDone(bool ok) {
  {
    MutexLock lock(&mu_);
    reading_ = false;
    closed_ = !ok;
    if (ok) {
      requests_.push_back(Admit(std::move(*reading_into_.mutable_batch())));
      request_bytes_ += requests_.back().bytes.held();
    }
  }
  Pump();
}

void StreamEditsReactor::OnWriteDone(bool ok) {
  {
    MutexLock lock(&mu_);
    writing_ = false;
    broken_ = !ok;
  }
  Pump();
}

void StreamEditsReactor::OnDrain() {
  {
    MutexLock lock(&mu_);
    draining_ = true;
  }
  Pump();
}

void StreamEditsReactor::OnDone() {
  services_.streams.Remove(this);
  delete this;
}

void StreamEditsReactor::Pump() {
  {
    MutexLock lock(&mu_);
    if (pumping_) return;
    pumping_ = true;
  }
  PumpOn();
}

void StreamEditsReactor::PumpOn() {
  while (true) {
    Action action;
    {
      MutexLock lock(&mu_);
      action = Choose();
      if (action == Action::kNone) pumping_ = false;
    }
    if (action == Action::kNone) return;
    Do(action);
    if (action == Action::kFinish) return;  // this may be gone
  }
}

StreamEditsReactor::Action StreamEditsReactor::Choose() {
  if (IsOver()) return Action::kFinish;
  if (!writing_ && !responses_.empty() && responses_.front().ready && !broken_) {
    writing_ = true;
    writing_from_ = std::move(responses_.front().message);
    responses_.pop_front();
    return Action::kWrite;
  }
  if (!applying_ && !requests_.empty() && responses_.size() < kMaxQueued && !broken_) {
    applying_ = true;
    return Action::kApply;
  }
  const bool has_room = requests_.size() < kMaxQueued && request_bytes_ < kMaxQueuedBytes;
  if (!reading_ && has_room && !closed_ && !broken_ && !draining_) {
    reading_ = true;
    return Action::kRead;
  }
  return Action::kNone;
}

bool StreamEditsReactor::IsOver() const {
  if (applying_ || writing_ || awaited_ > 0) return false;
  if (broken_) return true;
  // A read that is waiting ends by itself when the call does.
  return requests_.empty() && responses_.empty() && (draining_ || (closed_ && !reading_));
}

absl::Status StreamEditsReactor::EndStatus() const {
  if (broken_) return CallCancelled();
  return closed_ ? absl::OkStatus() : ShuttingDown();
}

void StreamEditsReactor::Do(Action action) {
  if (action == Action::kRead) {
    reading_into_.Clear();
    StartRead(&reading_into_);
  } else if (action == Action::kWrite) {
    StartWrite(&writing_from_);
  } else if (action == Action::kApply) {
    PostApply();
  } else if (action == Action::kFinish) {
    absl::Status status;
    {
      MutexLock lock(&mu_);
      status = EndStatus();
    }
    Finish(LoggedStatus("StreamEdits", status));
  }
}

StreamEditsReactor::Request StreamEditsReactor::Admit(v1::ApplyEditsRequest batch) const {
  Request request{{}, Lease(services_.quick().queued_bytes()), absl::OkStatus()};
  request.refused = request.bytes.Grow(MemoryOf(batch));
  if (request.refused.ok()) {
    request.batch = std::move(batch);
  } else {
    request.batch.set_session(batch.session());
  }
  return request;
}

void StreamEditsReactor::PostApply() {
  std::string name;
  {
    MutexLock lock(&mu_);
    name = requests_.front().batch.session();
  }
  const absl::StatusOr<SessionPtr> session = services_.registry.Find(name);
  if (!session.ok()) {
    // Not at once: a stream of such batches would keep this thread, which is gRPC's.
    return services_.quick().Post([this, status = session.status()] {
      Request request;
      if (TakeFirst(&request)) Refuse(status, 0);
      StopApplying();
    });
  }
  (*session)->access().Post(AccessMode::kWrite, services_.quick(),
                            [this, session = *session](AccessGrant grant) {
                              ApplyQueued(session);
                              grant.Release();
                              StopApplying();
                            });
}

void StreamEditsReactor::ApplyQueued(const SessionPtr& session) {
  Request request;
  for (int i = 0; i < kBatchesInARow && TakeRequest(session, &request); ++i) ApplyOne(session, request);
}

void StreamEditsReactor::ApplyOne(const SessionPtr& session, const Request& request) {
  if (!request.refused.ok()) return Refuse(request.refused, session->revision());
  v1::StreamEditsResponse response;
  const absl::Status status =
      CatchExceptions([&] { return ApplyEdits(*session, request.batch, stop_, response.mutable_applied()); });
  status.ok() ? AnswerWhenAcknowledged(session, std::move(response)) : Refuse(status, session->revision());
}

void StreamEditsReactor::AnswerWhenAcknowledged(const SessionPtr& session, v1::StreamEditsResponse response) {
  const int64_t revision = response.applied().revision();
  Response* waiting = nullptr;  // stays where it is until it is ready and written
  {
    MutexLock lock(&mu_);
    waiting = &responses_.emplace_back(Response{std::move(response), false});
    ++awaited_;
  }
  session->AwaitAcknowledged(revision, [this, session, waiting](const absl::Status& status) {
    {
      MutexLock lock(&mu_);
      v1::StreamEditsResponse& message = waiting->message;
      if (status.ok()) {
        message.mutable_applied()->set_durable_revision(session->durable_revision());
      } else {
        FromError(status, message.mutable_error());
        message.mutable_error()->set_revision(session->revision());
      }
      waiting->ready = true;
      --awaited_;
      // From here on another thread that pumps may end the call and delete this.
      if (pumping_) return;
      pumping_ = true;
    }
    PumpOn();
  });
}

bool StreamEditsReactor::TakeRequest(const SessionPtr& session, Request* request) {
  {
    MutexLock lock(&mu_);
    if (!requests_.empty() && requests_.front().batch.session() != session->name()) return false;
  }
  return TakeFirst(request);
}

bool StreamEditsReactor::TakeFirst(Request* request) {
  MutexLock lock(&mu_);
  if (requests_.empty() || responses_.size() >= kMaxQueued || broken_) return false;
  *request = std::move(requests_.front());
  requests_.pop_front();
  request_bytes_ -= request->bytes.held();
  return true;
}

void StreamEditsReactor::Refuse(const absl::Status& status, int64_t revision) {
  v1::StreamEditsResponse response;
  FromError(status, response.mutable_error());
  response.mutable_error()->set_revision(revision);
  Answer(std::move(response));
}

void StreamEditsReactor::Answer(v1::StreamEditsResponse response) {
  {
    MutexLock lock(&mu_);
    responses_.push_back({std::move(response), true});
  }
  Pump();
}

void StreamEditsReactor::StopApplying() {
  {
    MutexLock lock(&mu_);
    applying_ = false;
    // From here on another thread that pumps may end the call and delete this.
    if (pumping_) return;
    pumping_ = true;
  }
  PumpOn();
}

}  // namespace dynmesh
