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

/// The one thread that writes to an engine: whatever waits goes into one batch with at most one sync, so that
/// many editors share its cost.
///
///     editors --Enqueue()-----------> [ foreground ] --all of it--+
///                                                                 +--> one batch, one sync --> Done ...
///     pages ----EnqueueBackground()-> [ background ] --a part-----+
///
/// Each lane keeps its order; a write overtakes those of the background, and no other. Syncs when a write
/// asks for it, or when the oldest one that did not has waited for async_delay. After a write has failed, so
/// do all later ones (StoreReadOnly): nobody knows any more what is there.
/// Thread safety: full, until the destructor runs, which writes and syncs what waits.
class Committer {
 public:
  using Done = SessionStore::Done;
  using OnDisk = absl::AnyInvocable<void(const absl::Status&)>;

  struct Write {
    EngineBatch batch;
    Durability durability = Durability::kAsync;
    /// If not null: when it is on disk, before `done` of a kSync write; or with the error, when it never will
    /// be. Not called for a refusal.
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

  /// Returns when all that was enqueued before is written, and of the foreground on disk, or has failed. Not
  /// from a Done.
  void Drain();

  /// OK, or what writes get since one has failed.
  absl::Status status() const;

 private:
  using Clock = std::chrono::steady_clock;
  struct Round {
    std::vector<Write> writes;
    Engine::Sync sync = Engine::Sync::kNo;
  };

  void Run();
  bool AwaitWork();
  Round TakeRound();
  bool IsDirtyAfter(const Round& round) const;
  bool SyncIsDue() const { return sync_at_.has_value() && Clock::now() >= *sync_at_; }
  absl::Status Commit(Round& round);
  void Acknowledge(Round& round);
  void SetOnDisk(Write& write, Engine::Sync sync);
  void Fail(Round& round, const absl::Status& status);

  Engine* const engine_;
  const CommitterOptions options_;
  mutable Mutex mu_;
  CondVar news_;  ///< something to write, or the end
  CondVar room_;
  std::deque<Write> foreground_ ABSL_GUARDED_BY(mu_);
  std::deque<Write> background_ ABSL_GUARDED_BY(mu_);
  size_t waiting_bytes_ ABSL_GUARDED_BY(mu_) = 0;
  absl::Status status_ ABSL_GUARDED_BY(mu_);
  bool stopping_ ABSL_GUARDED_BY(mu_) = false;

  // The thread's own.
  absl::optional<Clock::time_point> sync_at_;  ///< set while something that was written is not on disk
  std::vector<OnDisk> not_on_disk_;

  std::thread thread_;
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
