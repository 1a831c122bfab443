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
      request_bytes_ += reading_into_.ByteSizeLong();
      requests_.push_back(std::move(reading_into_));
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
  if (!writing_ && !responses_.empty() && !broken_) {
    writing_ = true;
    writing_from_ = std::move(responses_.front());
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
  if (applying_ || writing_) return false;
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
    services_.quick().Post([this] { ApplyQueued(); });
  } else if (action == Action::kFinish) {
    absl::Status status;
    {
      MutexLock lock(&mu_);
      status = EndStatus();
    }
    Finish(LoggedStatus("StreamEdits", status));
  }
}

void StreamEditsReactor::ApplyQueued() {
  v1::StreamEditsRequest request;
  for (int i = 0; i < kBatchesInARow && TakeRequest(&request); ++i) {
    v1::StreamEditsResponse response;
    const absl::Status status =
        CatchExceptions([&] { return ApplyEdits(services_, request.batch(), response.mutable_applied()); });
    if (!status.ok()) FromError(status, response.mutable_error());
    Answer(std::move(response));
  }
  StopApplying();
}

bool StreamEditsReactor::TakeRequest(v1::StreamEditsRequest* request) {
  MutexLock lock(&mu_);
  if (requests_.empty() || responses_.size() >= kMaxQueued || broken_) return false;
  *request = std::move(requests_.front());
  requests_.pop_front();
  request_bytes_ -= request->ByteSizeLong();
  return true;
}

void StreamEditsReactor::Answer(v1::StreamEditsResponse response) {
  {
    MutexLock lock(&mu_);
    responses_.push_back(std::move(response));
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
