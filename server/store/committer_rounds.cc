// What the writer and the syncer of a Committer do; who is which, committer.cc says.

#include <algorithm>
#include <new>
#include <utility>

#include "core/mesh/error.h"
#include "server/store/committer.h"
#include "server/store/store_errors.h"

namespace dynmesh {
namespace {

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
    num_passed_ = 0;
    background_from_ = {};  // there may be nobody who wakes then
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
    if (awaited_ && !background_.empty()) ++num_passed_;
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

}  // namespace dynmesh
