#ifndef DYNMESH_SERVER_STORE_COMMITTER_H_
#define DYNMESH_SERVER_STORE_COMMITTER_H_

#include <chrono>
#include <cstddef>
#include <deque>
#include <future>
#include <thread>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/functional/any_invocable.h"
#include "absl/status/status.h"
#include "absl/time/time.h"
#include "absl/types/optional.h"
#include "server/session/mutex.h"
#include "server/store/engine.h"
#include "server/store/store.h"

namespace dynmesh {

struct CommitterOptions {
  /// How long a kAsync write may wait for the disk: what a loss of power takes is what was written within
  /// this time, and within that of one sync.
  absl::Duration async_delay = absl::Milliseconds(50);
  size_t max_waiting_bytes = size_t{8} << 20;  ///< of background writes that wait, before AwaitRoom() blocks
  size_t background_round_bytes = size_t{1} << 18;  ///< so much of them goes along with the others at once
  size_t round_bytes = size_t{32} << 20;            ///< about so much is written at once
};

/// What writes to an engine and syncs it: whatever waits goes into one batch, and whatever is written goes to
/// disk by one sync, so that many editors share the cost of both.
///
///     editors --Enqueue()-----------> [ foreground ] --all of it--+
///                                                                 +--> writer --> kAsync Done ...
///     pages ----EnqueueBackground()-> [ background ] --a part-----+      |
///                                                        [ not on disk ] +--> syncer --> OnDisk, kSync Done
///                                                        ...
///
/// Two threads take two roles in turn. Who has written a round that somebody wants on disk, or finds that the
/// oldest write has waited for async_delay, syncs it himself, and the other goes on writing; what comes while
/// a sync runs is covered by the next one. So one editor's sync costs no change of threads.
///
/// No kAsync write of the foreground waits for a sync. Small kSync writes do: when one runs, they wait for
/// its end, and then a part of its time for those whom it was for, to share the next one with them. The
/// background waits while a sync runs that somebody awaits, which would take as much longer, but not for two
/// in a row.
///
/// Each lane keeps its order; a write overtakes those of the background, and no other. Acknowledgements keep
/// it among writes of the same durability. After a write or a sync has failed, so do all later writes
/// (StoreReadOnly): nobody knows any more what is there.
/// Thread safety: full, until the destructor runs, which writes and syncs what waits.
class Committer {
 public:
  using Done = SessionStore::Done;
  using OnDisk = absl::AnyInvocable<void(const absl::Status&)>;

  struct Write {
    EngineBatch batch;
    Durability durability = Durability::kAsync;
    /// If not null: when it is on disk, before `done` of a kSync write; or with the error, when it never will
    /// be. Not called for a refusal. No two of these run at once.
    OnDisk on_disk;
    Done done;             ///< if not null: when it is acknowledged
    absl::Status refusal;  ///< if not OK: nothing is written, and `done` gets it in its turn
  };

  Committer(Engine* engine, const CommitterOptions& options);
  Committer(const Committer&) = delete;
  Committer& operator=(const Committer&) = delete;
  ~Committer();

  void Enqueue(Write write);

  /// For much that nobody waits for: call AwaitRoom() before, without locks.
  void EnqueueBackground(Write write);
  /// Blocks while too much waits. Errors: those of status().
  absl::Status AwaitRoom();

  /// Returns when all that was enqueued before is on disk, or has failed. Not from a Done.
  void Drain();

  /// OK, or what writes get since one has failed.
  absl::Status status() const;

 private:
  using Clock = std::chrono::steady_clock;
  enum class Role { kWriter, kSyncer, kNone };

  /// What is written at once.
  struct Round {
    std::vector<Write> writes;
    Clock::time_point began;
    bool follows_sync = false;  ///< kSync writes before it are not acknowledged yet
    bool changes = false;       ///< something was handed to the engine
    size_t num_syncing = 0;     ///< writes that wait for the disk
    absl::Status status;
  };

  void Run();
  Role AwaitRole();
  Role TakeRole() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mu_);
  void AwaitNews() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mu_);
  bool HasWaiting() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mu_);
  bool SyncIsDue() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mu_);
  bool WriteIsDue() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mu_);
  bool BackgroundWaits() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mu_);
  bool BackgroundIsDue() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mu_);
  absl::optional<Clock::time_point> NextDue() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mu_);
  bool TakeCall() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mu_);
  void Call() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mu_);

  void WriteRound();
  Round TakeRound();
  bool HasBackground() const;
  absl::Status Commit(Round& round);
  void AcknowledgeWritten(Round& round);
  void HandOver(Round round);

  void SyncRounds();
  absl::Status Sync(std::vector<Round>& rounds);
  absl::Status SyncEngine();
  void Settle(Round& round, const absl::Status& synced);
  void NoteFailure(const absl::Status& status) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mu_);

  Engine* const engine_;
  const CommitterOptions options_;
  mutable Mutex mu_;
  CondVar news_;  ///< something to do for a thread that has no role
  CondVar room_;
  std::deque<Write> foreground_ ABSL_GUARDED_BY(mu_);
  size_t foreground_bytes_ ABSL_GUARDED_BY(mu_) = 0;
  size_t num_async_ ABSL_GUARDED_BY(mu_) = 0;  ///< of the foreground
  /// So many of those whom the last sync was for have not come back; until gather_until_ what needs a sync
  /// waits for them.
  size_t num_expected_ ABSL_GUARDED_BY(mu_) = 0;
  Clock::time_point gather_until_ ABSL_GUARDED_BY(mu_);
  std::deque<Write> background_ ABSL_GUARDED_BY(mu_);
  size_t waiting_bytes_ ABSL_GUARDED_BY(mu_) = 0;
  Clock::time_point background_from_ ABSL_GUARDED_BY(mu_);  ///< until then the engine is left to catch up
  absl::Status failure_ ABSL_GUARDED_BY(mu_);               ///< the first one
  absl::Status status_ ABSL_GUARDED_BY(mu_);
  bool stopping_ ABSL_GUARDED_BY(mu_) = false;

  bool writing_ ABSL_GUARDED_BY(mu_) = false;  ///< somebody is the writer
  bool syncing_ ABSL_GUARDED_BY(mu_) = false;  ///< somebody is the syncer
  bool awaited_ ABSL_GUARDED_BY(mu_) = false;  ///< and somebody waits for that sync
  int num_passed_ ABSL_GUARDED_BY(mu_) = 0;    ///< awaited syncs begun since the background last had a turn
  int num_idle_ ABSL_GUARDED_BY(mu_) = 0;      ///< threads that wait for news
  int num_timed_ ABSL_GUARDED_BY(mu_) = 0;     ///< those of them that wake when a sync is due
  bool called_ ABSL_GUARDED_BY(mu_) = false;   ///< an idle thread was told, and has not begun to look

  /// Written by rounds that no sync covers yet: what is to be told to whom once one has.
  std::vector<Round> not_on_disk_ ABSL_GUARDED_BY(mu_);
  /// Set while something that was written waits for a sync to begin.
  absl::optional<Clock::time_point> sync_at_ ABSL_GUARDED_BY(mu_);
  bool sync_wanted_ ABSL_GUARDED_BY(mu_) = false;  ///< not_on_disk_ has somebody who waits for it

  std::thread threads_[2];
};

/// A write that syncs, and its result when somebody has committed it. Do not wait in a Done.
struct AwaitedWrite {
  explicit AwaitedWrite(EngineBatch batch, Durability durability = Durability::kSync);
  absl::Status Wait() { return result.get(); }

  Committer::Write write;
  std::future<absl::Status> result;
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_STORE_COMMITTER_H_
