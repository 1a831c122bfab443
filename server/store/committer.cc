#include "server/store/committer.h"

#include <algorithm>
#include <new>
#include <utility>

#include "server/store/store_errors.h"

namespace dynmesh {
namespace {

// Moves the first writes, until they have so many bytes, and says how many they have.
size_t MoveFirst(std::deque<Committer::Write>& from, size_t min_bytes, std::vector<Committer::Write>& to) {
  size_t bytes = 0;
  while (!from.empty() && bytes < min_bytes) {
    bytes += from.front().batch.bytes();
    to.push_back(std::move(from.front()));
    from.pop_front();
  }
  return bytes;
}

}  // namespace

Committer::Committer(Engine* engine, const CommitterOptions& options)
    : engine_(engine), options_(options), thread_([this] { Run(); }) {}

Committer::~Committer() {
  {
    MutexLock lock(&mu_);
    stopping_ = true;
    news_.NotifyOne();
  }
  thread_.join();
}

void Committer::Enqueue(Write write) {
  MutexLock lock(&mu_);
  foreground_.push_back(std::move(write));
  news_.NotifyOne();
}

void Committer::EnqueueBackground(Write write) {
  MutexLock lock(&mu_);
  waiting_bytes_ += write.batch.bytes();
  background_.push_back(std::move(write));
  news_.NotifyOne();
}

absl::Status Committer::AwaitRoom() {
  MutexLock lock(&mu_);
  while (waiting_bytes_ > options_.max_waiting_bytes) room_.Wait(&mu_);
  return status_;
}

void Committer::Drain() {
  AwaitedWrite foreground({}, Durability::kSync);
  AwaitedWrite background({}, Durability::kAsync);
  EnqueueBackground(std::move(background.write));
  Enqueue(std::move(foreground.write));
  // Who drains wants to know that nothing waits any more; a failure is told by status().
  (void)background.Wait();
  (void)foreground.Wait();
}

absl::Status Committer::status() const {
  MutexLock lock(&mu_);
  return status_;
}

void Committer::Run() {
  while (AwaitWork()) {
    Round round = TakeRound();
    const absl::Status status = Commit(round);
    if (status.ok()) {
      Acknowledge(round);
    } else {
      Fail(round, status);
    }
  }
}

// False at the end.
bool Committer::AwaitWork() {
  MutexLock lock(&mu_);
  while (foreground_.empty() && background_.empty()) {
    if (stopping_ || SyncIsDue()) return sync_at_.has_value();
    if (sync_at_.has_value()) {
      news_.WaitFor(&mu_, absl::FromChrono(*sync_at_ - Clock::now()));
    } else {
      news_.Wait(&mu_);
    }
  }
  return true;
}

Committer::Round Committer::TakeRound() {
  Round round;
  MutexLock lock(&mu_);
  MoveFirst(foreground_, options_.round_bytes, round.writes);
  if (foreground_.empty()) {
    waiting_bytes_ -= MoveFirst(background_, options_.background_round_bytes, round.writes);
    room_.NotifyAll();
  }
  bool sync = SyncIsDue() || (stopping_ && foreground_.empty() && background_.empty());
  for (const Write& write : round.writes) {
    sync |= write.durability == Durability::kSync && write.refusal.ok();
  }
  if (sync && IsDirtyAfter(round)) round.sync = Engine::Sync::kYes;
  return round;
}

// Whether something is not on disk once the round has been written.
bool Committer::IsDirtyAfter(const Round& round) const {
  const auto writes = [](const Write& write) { return write.refusal.ok() && !write.batch.changes().empty(); };
  return sync_at_.has_value() || std::any_of(round.writes.begin(), round.writes.end(), writes);
}

absl::Status Committer::Commit(Round& round) {
  if (absl::Status failed = status(); !failed.ok()) return failed;
  try {
    EngineBatch batch;
    for (Write& write : round.writes) {
      if (write.refusal.ok()) batch.Append(std::move(write.batch));
    }
    if (batch.changes().empty() && round.sync == Engine::Sync::kNo) return absl::OkStatus();
    if (!sync_at_.has_value()) sync_at_ = Clock::now() + absl::ToChronoNanoseconds(options_.async_delay);
    return engine_->Write(batch, round.sync);
  } catch (const std::bad_alloc&) {
    return StoreFailed("out of memory");
  }
}

void Committer::Acknowledge(Round& round) {
  if (round.sync == Engine::Sync::kYes) {
    for (OnDisk& on_disk : not_on_disk_) on_disk(absl::OkStatus());
    not_on_disk_.clear();
    sync_at_.reset();
  }
  for (Write& write : round.writes) {
    if (write.on_disk != nullptr && write.refusal.ok()) SetOnDisk(write, round.sync);
    if (write.done != nullptr) write.done(write.refusal);
  }
}

void Committer::SetOnDisk(Write& write, Engine::Sync sync) {
  if (sync == Engine::Sync::kYes) {
    write.on_disk(absl::OkStatus());
  } else {
    not_on_disk_.push_back(std::move(write.on_disk));
  }
}

void Committer::Fail(Round& round, const absl::Status& status) {
  {
    MutexLock lock(&mu_);
    if (status_.ok()) status_ = StoreReadOnly(status);
  }
  for (OnDisk& on_disk : not_on_disk_) on_disk(status);
  not_on_disk_.clear();
  sync_at_.reset();
  for (Write& write : round.writes) {
    if (write.on_disk != nullptr && write.refusal.ok()) write.on_disk(status);
    if (write.done != nullptr) write.done(write.refusal.ok() ? status : write.refusal);
  }
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
