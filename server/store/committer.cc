#include "server/store/committer.h"

#include <algorithm>
#include <utility>

namespace dynmesh {
namespace {

/// So much that needs a sync is written at once, whoever else may come: then it pays to do so while one runs.
constexpr size_t kGatheredBytes = size_t{1} << 18;

}  // namespace

Committer::Committer(Engine* engine, const CommitterOptions& options) : engine_(engine), options_(options) {
  for (std::thread& thread : threads_) thread = std::thread([this] { Run(); });
}

Committer::~Committer() {
  {
    MutexLock lock(&mu_);
    stopping_ = true;
    news_.NotifyAll();
  }
  for (std::thread& thread : threads_) thread.join();
}

void Committer::Enqueue(Write write) {
  bool call = false;
  {
    MutexLock lock(&mu_);
    foreground_bytes_ += write.batch.bytes();
    if (write.durability == Durability::kAsync) {
      ++num_async_;
    } else if (num_expected_ > 0) {
      --num_expected_;
    }
    foreground_.push_back(std::move(write));
    call = WriteIsDue() && TakeCall();
  }
  if (call) news_.NotifyOne();  // without the lock, which is the first thing that the other takes
}

void Committer::EnqueueBackground(Write write) {
  MutexLock lock(&mu_);
  waiting_bytes_ += write.batch.bytes();
  background_.push_back(std::move(write));
  if (WriteIsDue()) Call();
}

absl::Status Committer::AwaitRoom() {
  MutexLock lock(&mu_);
  while (waiting_bytes_ > options_.max_waiting_bytes) room_.Wait(&mu_);
  return status_;
}

void Committer::Drain() {
  AwaitedWrite last({}, Durability::kSync);  // no background write overtakes one of the foreground
  EnqueueBackground(std::move(last.write));
  // Who drains wants to know that nothing waits any more; a failure is told by status().
  (void)last.Wait();
}

absl::Status Committer::status() const {
  MutexLock lock(&mu_);
  return status_;
}

// ---- who does what

void Committer::Run() {
  for (Role role = AwaitRole(); role != Role::kNone; role = AwaitRole()) {
    if (role == Role::kWriter) {
      WriteRound();
    } else {
      SyncRounds();
    }
  }
}

// kNone at the end: whoever has a role then does what is left.
Committer::Role Committer::AwaitRole() {
  MutexLock lock(&mu_);
  Role role = TakeRole();
  while (role == Role::kNone && !stopping_) {
    AwaitNews();
    role = TakeRole();
  }
  return role;
}

Committer::Role Committer::TakeRole() {
  if (SyncIsDue()) {
    syncing_ = true;
    if (WriteIsDue() || BackgroundWaits()) Call();
    return Role::kSyncer;
  }
  if (!WriteIsDue()) return Role::kNone;
  writing_ = true;
  // A write can take long: somebody else has to see that a sync becomes due meanwhile.
  if (sync_at_.has_value() && num_timed_ < num_idle_) Call();
  return Role::kWriter;
}

void Committer::AwaitNews() {
  ++num_idle_;
  if (const auto next = NextDue(); next.has_value()) {
    ++num_timed_;
    news_.WaitFor(&mu_, absl::FromChrono(*next - Clock::now()));
    --num_timed_;
  } else {
    news_.Wait(&mu_);
  }
  --num_idle_;
  called_ = false;
  if (!syncing_ && Clock::now() >= gather_until_) num_expected_ = 0;
}

bool Committer::HasWaiting() const { return !foreground_.empty() || !background_.empty(); }

bool Committer::SyncIsDue() const {
  if (syncing_) return false;
  if (sync_wanted_ || (sync_at_.has_value() && Clock::now() >= *sync_at_)) return true;
  const bool at_end = stopping_ && !writing_ && !HasWaiting();
  return at_end && (sync_at_.has_value() || !not_on_disk_.empty());
}

bool Committer::WriteIsDue() const {
  if (writing_ || !HasWaiting()) return false;
  if (num_async_ > 0 || BackgroundIsDue() || foreground_bytes_ >= kGatheredBytes || stopping_) return true;
  if (foreground_.empty()) return false;
  if (syncing_)
    return sync_wanted_;  // else nothing is lost if they wait for more of their kind until it has ended
  return num_expected_ == 0 || Clock::now() >= gather_until_;
}

// Not while a sync runs that somebody waits for: the next one would take as much longer as they are. But when
// each sync finds the next one wanted there is no time between them, so every other one lets a part pass.
bool Committer::BackgroundWaits() const {
  return !background_.empty() && (!awaited_ || num_passed_ > 1 || stopping_);
}

bool Committer::BackgroundIsDue() const {
  return BackgroundWaits() && (stopping_ || Clock::now() >= background_from_);
}

// When to look again though there is no news.
absl::optional<Committer::Clock::time_point> Committer::NextDue() const {
  absl::optional<Clock::time_point> next;
  const auto add = [&](Clock::time_point time) { next = next.has_value() ? std::min(*next, time) : time; };
  if (!syncing_ && sync_at_.has_value()) add(*sync_at_);
  if (!syncing_ && num_expected_ > 0) add(gather_until_);
  if (!writing_ && BackgroundWaits()) add(background_from_);
  return next;
}

// True when an idle thread is to be notified; one that was told already need not be.
bool Committer::TakeCall() {
  if (called_ || num_idle_ == 0) return false;
  called_ = true;
  return true;
}

void Committer::Call() {
  if (TakeCall()) news_.NotifyOne();
}

AwaitedWrite::AwaitedWrite(EngineBatch batch, Durability durability) {
  std::promise<absl::Status> promise;
  result = promise.get_future();
  write.batch = std::move(batch);
  write.durability = durability;
  write.done = [promise = std::move(promise)](const absl::Status& status) mutable {
    promise.set_value(status);
  };
}

}  // namespace dynmesh
