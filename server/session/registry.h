#ifndef DYNMESH_SERVER_SESSION_REGISTRY_H_
#define DYNMESH_SERVER_SESSION_REGISTRY_H_

#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/container/flat_hash_set.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "server/session/answer_memory.h"
#include "server/session/budget.h"
#include "server/session/durability/manifest.h"
#include "server/session/importer/importer.h"
#include "server/session/limits.h"
#include "server/session/mutex.h"
#include "server/session/session.h"
#include "server/session/wall_clock.h"
#include "server/session/workers.h"
#include "server/store/store.h"

namespace dynmesh {

/// When sessions are unloaded: see SessionRegistry::UnloadIdle().
struct UnloadPolicy {
  absl::Duration idle_timeout = absl::InfiniteDuration();            ///< that nobody has used it
  uint64_t max_loaded_bytes = std::numeric_limits<uint64_t>::max();  ///< of all that could be unloaded
};

/// A session that is to be made of a mesh.
struct SessionSeed {
  std::string name;
  SessionSettings settings = {};  ///< but `duplicates`, which is the mesh's
  Mesh mesh;                      ///< of any revision, whatever relations it stores; no batch is open
  absl::Time commit_time = NowToTheMicrosecond();  ///< of mesh.revision()
  absl::Time create_time = NowToTheMicrosecond();
  RevisionNote note = {};
  // For retries: the fingerprint is of all that tells the request from others, the name too.
  std::string request_id = {};
  uint64_t fingerprint = 0;
  bool validate_only = false;  ///< nothing is made; the answer, without uid and etag, is what would be
};

/// The sessions of a daemon by name.
///
/// A session that a store has is loaded when it is found, and unloaded again when UnloadIdle() is called and
/// nobody uses it. Whoever has a SessionPtr uses a session: a call, a follower, an edit that is not
/// acknowledged yet.
///
///     kStored -- Find() --> loading --> kLoaded -- UnloadIdle() --> kStored: another Session, the same log
///
/// Thread safety: full. Its lock is held for look-ups only, never while a session works or the disk.
class SessionRegistry {
 public:
  /// Without a store all sessions end with the process.
  SessionRegistry(const Limits& limits, const Workers& workers, std::unique_ptr<Store> store = nullptr,
                  const SessionLogOptions& log_options = {})
      : limits_(limits),
        workers_(workers),
        store_(std::move(store)),
        log_options_(log_options),
        import_gate_(limits),
        answer_budget_(std::make_shared<Budget>("max_answer_bytes", limits.max_answer_bytes)),
        backup_budget_(std::make_shared<Budget>("max_backup_bytes", limits.max_backup_bytes)),
        adaptation_budget_(
            std::make_shared<Budget>("max_concurrent_adaptations", limits.max_concurrent_adaptations)) {}

  /// Adds the sessions that the store has, without reading what they hold: Find() begins that. One that is
  /// damaged is added as such. Call it once, before all else. Errors: those of Store::DeleteSession, for what
  /// a crash has left half made.
  absl::Status AddStored();

  /// Makes an empty session. The same request_id with the same name and settings: what the first call gave.
  /// Errors: INVALID_ARGUMENT BAD_SESSION_NAME, REQUEST_ID_REUSED; ALREADY_EXISTS SESSION_EXISTS;
  /// RESOURCE_EXHAUSTED LIMIT_EXCEEDED (max_sessions); UNAVAILABLE SHUTTING_DOWN; FAILED_PRECONDITION
  /// NO_STORE; those of the store. May wait for the disk.
  absl::StatusOr<SessionInfo> Create(const std::string& name, const SessionSettings& settings,
                                     const std::string& request_id);

  /// Makes a session that begins with a mesh, at the revision which that has: its stamps stay, so ids are as
  /// old as they were, and differences can be asked for from earlier revisions. It has no batches to undo.
  /// All or nothing: nobody finds it before it is whole, and on disk if it is durable. A retry gets what the
  /// first call gave; `seed` is used up then, as it is by an error.
  /// Errors: those of Create; RESOURCE_EXHAUSTED LIMIT_EXCEEDED (max_vertices to max_cells,
  /// max_session_bytes) when the mesh is more than a session may hold here. Cost: storing all pages.
  absl::StatusOr<SessionInfo> CreateFrom(SessionSeed seed);

  /// What a request that created a session of that name got, nullptr if there was none. Errors:
  /// INVALID_ARGUMENT REQUEST_ID_REUSED. Waits for a creation of the name that is under way.
  absl::StatusOr<std::shared_ptr<const SessionInfo>> FindCreated(const std::string& name,
                                                                 const std::string& request_id,
                                                                 uint64_t fingerprint)
      ABSL_LOCKS_EXCLUDED(create_mu_);

  /// OK, or why no session of that name can be made now: errors of Create but for those of the store.
  absl::Status CheckCreation(const std::string& name) const ABSL_LOCKS_EXCLUDED(mu_) {
    return CheckRoom(name, 0);
  }

  /// Calls Session::EnsureLoaded(). Errors: NOT_FOUND SESSION_NOT_FOUND.
  absl::StatusOr<SessionPtr> Find(absl::string_view name);

  /// Up to `max_sessions` sessions with names after `after`, sorted by name.
  std::vector<SessionPtr> ListAfter(absl::string_view after, size_t max_sessions) const;

  /// Unloads sessions that nobody uses, those found longest ago first: those that nobody has used for
  /// idle_timeout, and while all that are stored and loaded hold more than max_loaded_bytes, those that rest
  /// for a second. Where loading would have much log to read, a checkpoint is begun instead, and a later call
  /// unloads. Followers and answers to requests stay what they were; what undoes batches is lost, as by a
  /// restart. Returns how many were unloaded. To be called again and again by one thread that may take its
  /// time. `now` is absl::Now(), or a later time in tests.
  size_t UnloadIdle(absl::Time now, const UnloadPolicy& policy) ABSL_LOCKS_EXCLUDED(mu_);

  /// Deletes a session and ends what follows it; returns its last revision.
  /// Errors: NOT_FOUND SESSION_NOT_FOUND; ABORTED ETAG_MISMATCH.
  absl::StatusOr<int64_t> Delete(absl::string_view name, absl::string_view etag);
  /// The same for a session that was found. Errors: NOT_FOUND SESSION_DELETED; ABORTED ETAG_MISMATCH.
  absl::StatusOr<int64_t> Delete(const SessionPtr& session, absl::string_view etag);

  /// Ends all subscriptions with UNAVAILABLE SHUTTING_DOWN, and refuses new ones and new sessions.
  void Drain();

  /// Whether creating and deleting sessions may wait for the disk.
  bool keeps_sessions() const { return store_ != nullptr; }
  ImportGate& import_gate() { return import_gate_; }
  /// Of answers that are gathered and wait to be read (max_answer_bytes).
  const std::shared_ptr<Budget>& answer_budget() const { return answer_budget_; }
  /// Of copies of sessions that backups are written of (max_backup_bytes).
  const std::shared_ptr<Budget>& backup_budget() const { return backup_budget_; }
  /// Of adaptations that are under way: one each.
  const std::shared_ptr<Budget>& adaptation_budget() const { return adaptation_budget_; }
  const Limits& limits() const { return limits_; }
  const Workers& workers() const { return workers_; }

 private:
  struct Entry {
    SessionPtr session;
    absl::Time last_used = absl::Now();
  };
  struct Unloaded {
    SessionPtr session;
    uint64_t bytes;
    absl::Duration idle;
  };
  struct NewSession {
    SessionPtr session;
    SessionInfo info;  ///< of the beginning
  };

  absl::Status Prepare(SessionSeed& seed) const;
  absl::StatusOr<SessionInfo> DescribeSeed(SessionSeed& seed) const;
  /// What the same request got before; null, and the name is taken until EndCreation(), if that is new.
  absl::StatusOr<std::shared_ptr<const SessionInfo>> BeginCreation(const SessionSeed& seed)
      ABSL_LOCKS_EXCLUDED(create_mu_);
  void EndCreation(const SessionSeed& seed, const absl::StatusOr<NewSession>& made)
      ABSL_LOCKS_EXCLUDED(create_mu_, mu_);
  absl::Status CheckRoom(const std::string& name, size_t num_creating) const ABSL_LOCKS_EXCLUDED(mu_);
  absl::StatusOr<NewSession> MakeSession(SessionSeed& seed);
  absl::StatusOr<NewSession> BeginSession(SessionSeed& seed, const Session::Options& options,
                                          std::unique_ptr<SessionLog> log);
  absl::StatusOr<std::unique_ptr<SessionLog>> StoreSeed(const SessionSeed& seed,
                                                        const SessionIdentity& identity);
  absl::StatusOr<SessionPtr> OpenStored(const std::string& name) ABSL_EXCLUSIVE_LOCKS_REQUIRED(create_mu_);
  std::unique_ptr<SessionLog> LogFor(std::unique_ptr<SessionStore> store,
                                     const SessionSettings& settings) const;

  // registry_unloading.cc
  /// Puts others in the place of those that are to go, which nobody can find any more.
  std::vector<Unloaded> TakeIdle(absl::Time now, const UnloadPolicy& policy) ABSL_LOCKS_EXCLUDED(mu_);
  /// What can be unloaded, the least recently used first; notes what is used, and what all that is loaded
  /// holds.
  std::vector<Entry*> FindIdle(absl::Time now, uint64_t& loaded_bytes) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mu_);

  const Limits limits_;
  const Workers workers_;
  const std::unique_ptr<Store> store_;  ///< null: there is none. Outlives the sessions
  const SessionLogOptions log_options_;
  ImportGate import_gate_;
  const std::shared_ptr<Budget> answer_budget_;
  const std::shared_ptr<Budget> backup_budget_;
  const std::shared_ptr<Budget> adaptation_budget_;
  Mutex create_mu_;
  CondVar created_one_;
  /// Sessions that are being made, which may wait for the disk: others of the same name wait for them.
  absl::flat_hash_set<std::string> creating_ ABSL_GUARDED_BY(create_mu_);
  mutable Mutex mu_;
  std::map<std::string, Entry, std::less<>> sessions_ ABSL_GUARDED_BY(mu_);
  AnswerMemory<SessionInfo> created_ ABSL_GUARDED_BY(create_mu_);
  bool draining_ ABSL_GUARDED_BY(mu_) = false;
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_REGISTRY_H_
