#include "server/store/committer.h"

#include <algorithm>
#include <new>
#include <utility>

#include "core/mesh/error.h"
#include "server/store/store_errors.h"

namespace dynmesh {
namespace {

/// So much that needs a sync is written at once, whoever else may come: then it pays to do so while one runs.
constexpr size_t kGatheredBytes = size_t{1} << 18;

/// What part of the time of the last sync the next one waits for those whom that was for.
constexpr int kGatherPart = 4;
constexpr std::chrono::milliseconds kMaxGather{2};

/// How long the background waits when the engine is behind, before it looks again.
constexpr std::chrono::milliseconds kCatchUp{2};

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

// Not while a sync runs that somebody waits for: the next one would take as much longer as they are.
bool Committer::BackgroundWaits() const { return !background_.empty() && (!awaited_ || stopping_); }

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

// ---- the writer

void Committer::WriteRound() {
  Round round = TakeRound();
  round.status = Commit(round);
  if (round.status.ok()) AcknowledgeWritten(round);
  HandOver(std::move(round));
}

Committer::Round Committer::TakeRound() {
  const bool wait_with_background = HasBackground() && engine_->IsBehind();
  Round round;
  round.began = Clock::now();
  MutexLock lock(&mu_);
  round.follows_sync = syncing_ || sync_wanted_;
  foreground_bytes_ -= MoveFirst(foreground_, options_.round_bytes, round.writes);
  for (const Write& write : round.writes) num_async_ -= write.durability == Durability::kAsync;
  if (wait_with_background) {
    background_from_ = round.began + kCatchUp;
  } else if (foreground_.empty() && BackgroundWaits()) {
    waiting_bytes_ -= MoveFirst(background_, options_.background_round_bytes, round.writes);
    room_.NotifyAll();
  }
  return round;
}

// That is to be written, unless the engine is behind.
bool Committer::HasBackground() const {
  MutexLock lock(&mu_);
  return BackgroundWaits() && status_.ok() && !stopping_;
}

absl::Status Committer::Commit(Round& round) {
  if (absl::Status failed = status(); !failed.ok()) return failed;
  try {
    EngineBatch batch;
    for (Write& write : round.writes) {
      if (write.refusal.ok()) batch.Append(std::move(write.batch));
    }
    if (batch.changes().empty()) return absl::OkStatus();
    round.changes = true;
    DYNMESH_RETURN_IF_ERROR(engine_->Write(batch));
  } catch (const std::bad_alloc&) {
    return StoreFailed("out of memory");
  }
  return status();  // of a sync that has failed meanwhile
}

// All but what the syncer acknowledges: kSync writes, and their refusals when there is one before them.
void Committer::AcknowledgeWritten(Round& round) {
  for (Write& write : round.writes) {
    if (write.durability == Durability::kSync &&
        (write.refusal.ok() || round.follows_sync || round.num_syncing > 0)) {
      ++round.num_syncing;
    } else if (write.done != nullptr) {
      std::exchange(write.done, nullptr)(write.refusal);
    }
  }
}

void Committer::HandOver(Round round) {
  MutexLock lock(&mu_);
  writing_ = false;
  if (!round.status.ok()) {
    NoteFailure(round.status);
  } else if (round.changes && !sync_at_.has_value()) {
    sync_at_ = round.began + absl::ToChronoNanoseconds(options_.async_delay);
  }
  sync_wanted_ |= round.num_syncing > 0;
  const auto is_unsettled = [](const Write& write) {
    return write.on_disk != nullptr || write.done != nullptr;
  };
  if (std::any_of(round.writes.begin(), round.writes.end(), is_unsettled))
    not_on_disk_.push_back(std::move(round));
}

// ---- the syncer

void Committer::SyncRounds() {
  const Clock::time_point began = Clock::now();
  std::vector<Round> rounds;
  const absl::Status status = Sync(rounds);
  const Clock::duration took = Clock::now() - began;
  for (Round& round : rounds) Settle(round, status);
  MutexLock lock(&mu_);
  gather_until_ = Clock::now() + std::min<Clock::duration>(took / kGatherPart, kMaxGather);
  syncing_ = awaited_ = false;
}

// Takes the rounds that are not on disk and brings them there.
absl::Status Committer::Sync(std::vector<Round>& rounds) {
  {
    MutexLock lock(&mu_);
    const bool is_dirty = sync_at_.has_value();
    rounds.swap(not_on_disk_);
    sync_at_.reset();
    awaited_ = std::exchange(sync_wanted_, false);
    if (!failure_.ok() || !is_dirty) return failure_;
  }
  const absl::Status status = SyncEngine();
  MutexLock lock(&mu_);
  if (!status.ok()) NoteFailure(status);
  num_expected_ = 0;
  for (const Round& round : rounds) num_expected_ += round.num_syncing;
  return status;
}

absl::Status Committer::SyncEngine() {
  try {
    return engine_->Sync();
  } catch (const std::bad_alloc&) {
    return StoreFailed("out of memory");
  }
}

void Committer::Settle(Round& round, const absl::Status& synced) {
  const absl::Status& status = round.status.ok() ? synced : round.status;
  for (Write& write : round.writes) {
    if (write.on_disk != nullptr && write.refusal.ok()) write.on_disk(status);
    if (write.done != nullptr) write.done(write.refusal.ok() ? status : write.refusal);
  }
}

// What was written before cannot be synced any more: the syncer says so.
void Committer::NoteFailure(const absl::Status& status) {
  sync_wanted_ = true;
  if (!failure_.ok()) return;
  failure_ = status;
  status_ = StoreReadOnly(status);
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
