#include "server/rpc/stream_edits_reactor.h"

#include "server/rpc/apply_edits.h"
#include "server/rpc/convert_edits.h"
#include "server/rpc/status.h"
#include "server/session/catch_exceptions.h"

namespace dynmesh {

StreamEditsReactor* StreamEditsReactor::Start() {
  if (!services_.streams.Add(this)) {
    Finish(ToGrpcStatus(ShuttingDown()));
    return this;
  }
  bool finished;
  {
    absl::MutexLock lock(&mu_);
    reading_ = true;
    finished = finished_;  // the server may have begun to drain just now
  }
  if (!finished) StartRead(&request_);
  return this;
}

void StreamEditsReactor::OnReadDone(bool ok) {
  Action action;
  {
    absl::MutexLock lock(&mu_);
    reading_ = false;
    closed_ = !ok;
    action = Next();
  }
  Do(action);
}

void StreamEditsReactor::OnWriteDone(bool ok) {
  Action action;
  {
    absl::MutexLock lock(&mu_);
    writing_ = false;
    broken_ = !ok;
    action = Next();
  }
  Do(action);
}

void StreamEditsReactor::OnDrain() {
  Action action;
  {
    absl::MutexLock lock(&mu_);
    draining_ = true;
    action = Next();
  }
  Do(action);
}

void StreamEditsReactor::OnDone() {
  services_.streams.Remove(this);
  delete this;
}

StreamEditsReactor::Action StreamEditsReactor::Next() {
  if (finished_ || applying_ || writing_) return Action::kNone;
  // A read that is waiting ends by itself when the call does.
  if (draining_ || broken_ || (closed_ && !reading_)) {
    finished_ = true;
    return Action::kFinish;
  }
  if (reading_) return Action::kNone;
  applying_ = true;
  return Action::kApply;
}

void StreamEditsReactor::Do(Action action) {
  if (action == Action::kApply) {
    const absl::Status posted = services_.quick().TryPost([this] { Apply(); });
    if (!posted.ok()) Respond(posted);
  }
  if (action == Action::kFinish) {
    absl::Status status;
    {
      absl::MutexLock lock(&mu_);
      status = EndStatus();
    }
    Finish(LoggedStatus("StreamEdits", status));
  }
}

absl::Status StreamEditsReactor::EndStatus() const {
  if (closed_) return absl::OkStatus();
  return broken_ ? CallCancelled() : ShuttingDown();
}

void StreamEditsReactor::Apply() {
  response_.Clear();
  Respond(CatchExceptions([this] {
    return ApplyEdits(services_, request_.batch(), response_.mutable_applied());
  }));
}

void StreamEditsReactor::Respond(const absl::Status& status) {
  if (!status.ok()) FromError(status, response_.mutable_error());
  {
    absl::MutexLock lock(&mu_);
    applying_ = false;
    writing_ = true;
    reading_ = true;
  }
  // Reading first: while the answer is not written, this cannot end.
  StartRead(&request_);
  StartWrite(&response_);
}

}  // namespace dynmesh
