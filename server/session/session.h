#ifndef DYNMESH_SERVER_SESSION_SESSION_H_
#define DYNMESH_SERVER_SESSION_SESSION_H_

#include <array>
#include <atomic>
#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "absl/types/optional.h"
#include "absl/types/span.h"
#include "core/edit/restore_batches.h"
#include "core/edit/run_batch.h"
#include "core/edit/transaction.h"
#include "core/mesh/mesh.h"
#include "server/session/access_queue.h"
#include "server/session/answer_memory.h"
#include "server/session/delta_source.h"
#include "server/session/durability/session_log.h"
#include "server/session/follower_list.h"
#include "server/session/history.h"
#include "server/session/limits.h"
#include "server/session/mutex.h"
#include "server/session/session_info.h"
#include "server/session/shared_spatial_index.h"
#include "server/session/stop_signal.h"
#include "server/session/wall_clock.h"
#include "server/session/workers.h"

namespace dynmesh {

/// How a batch is to be applied; the fields are those of ApplyEditsRequest.
struct ApplyOptions {
  int64_t as_of_revision = 0;  ///< 0: the current revision
  absl::optional<int64_t> if_revision = absl::nullopt;
  std::string request_id = {};  ///< empty: none; ignored when validate_only
  bool validate_only = false;
  bool skip_refused = false;    ///< items of operators
  bool report_lineage = false;  ///< of at most kMaxLineage elements
  /// kTouched takes an as_of_revision.
  ConflictPolicy conflict_policy = ConflictPolicy::kNone;
  RevisionNote note = {};
};

/// How batches are to be undone or redone; the fields are those of UndoEditsRequest.
struct HistoryOptions {
  uint32_t count = 1;
  absl::optional<int64_t> if_revision = absl::nullopt;
  std::string request_id = {};  ///< as of ApplyOptions
  bool validate_only = false;
  RevisionNote note = {};
  std::string target = {};  ///< of RestoreTo(): what to go back to, in the words of the request
};

/// What undoing or redoing did or, for validate_only, would have done.
struct HistoryResult {
  int64_t revision = 0;  ///< after it; for validate_only: before
  uint32_t count = 0;    ///< of batches; 0 for one that went back to a revision
  Checksum checksum;
  std::array<uint32_t, kNumEntityKinds> counts = {};
  uint32_t undoable_batches = 0;  ///< after it
  uint32_t redoable_batches = 0;
  int64_t target_revision = 0;  ///< that RestoreTo() went back to
};

/// So many elements that operators made can be told of in one answer, which is then some 4 MB.
inline constexpr size_t kMaxLineage = 400'000;

/// What a session holds while somebody reads it.
struct SessionView {
  const Mesh& mesh;
  absl::Time commit_time;  ///< of mesh.revision()
};

/// What an import gave, and what a retry of it gets again.
struct ImportOutcome;

/// The same of a repair.
struct RepairOutcome;

struct RecoveredSession;

/// INVALID_ARGUMENT BAD_SESSION_NAME unless `name` is 1-64 of [A-Za-z0-9_.-] and starts with a letter or
/// digit.
absl::Status CheckSessionName(absl::string_view name);

/// A named mesh with its revision, its lock and its followers.
///
///     Session ── AccessQueue ── calls that wait for their turn
///        ├────── SessionLog ── SessionStore: what outlives the process, if it is to
///        ├────── mu_ (reader/writer) ── Mesh, commit time, History, answers to request ids
///        ├────── SharedSpatialIndex ── read under the reader lock, with locks of its own
///        ├────── FollowerList ── Follower ── DeltaSink (an RPC stream)
///        └────── DeltaSource ── encoded payloads shared by followers, quantisation grids
///
/// Edits take the writer lock for as long as they compute; reads share the reader lock. Neither is held over
/// network or encoding. Followers are woken after each commit, when the lock is free again.
/// Read(), Apply() and what else takes the lock may wait for it. So threads that others share ask access()
/// for their turn first, and then do not wait; what is marked "Never waits" needs no turn. Once deleted,
/// every call fails with NOT_FOUND SESSION_DELETED. Thread safety: full. Always owned by a shared_ptr.
class Session : public std::enable_shared_from_this<Session> {
 public:
  struct Options {
    std::string name;
    SessionSettings settings;  ///< at first
    Limits limits;
    Workers workers;
    std::string uid = {};  ///< empty: a new one
    absl::Time create_time = NowToTheMicrosecond();
    // Of the request that created it, which its log's store remembers.
    std::string create_request_id = {};
    uint64_t create_fingerprint = 0;
    int64_t create_revision = 0;  ///< at which it began
    // Of one that was loaded before.
    absl::optional<absl::Time> update_time = absl::nullopt;
    uint64_t num_updates = 0;                ///< of settings, which etags tell of
    absl::Status damage = absl::OkStatus();  ///< why what is stored cannot be had, if so
  };

  /// Where a session begins: empty, or what its log's store holds, which is read when it is asked for.
  enum class Content { kEmpty, kStored };

  /// Without a log it ends with the process.
  explicit Session(const Options& options, std::shared_ptr<SessionLog> log = nullptr,
                   Content content = Content::kEmpty);
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;
  ~Session();

  /// Makes `mesh`, of any revision, what this begins with; a log has stored it already. REQUIRES: nobody else
  /// has this yet; the mesh stores the relations of the settings.
  void BeginWith(Mesh mesh, absl::Time commit_time) ABSL_LOCKS_EXCLUDED(mu_);

  /// 16 hexadecimal digits.
  static std::string NewUid();

  const std::string& name() const { return options_.name; }
  /// Whether a store has it.
  bool is_stored() const { return log_ != nullptr || !options_.damage.ok(); }
  DuplicatePolicy duplicates() const { return options_.settings.duplicates; }
  const Limits& limits() const { return options_.limits; }
  const Workers& workers() const { return options_.workers; }
  /// Tells this session from an earlier or later one of the same name: 16 hexadecimal digits.
  const std::string& uid() const { return uid_; }
  /// Of the last commit. Never waits.
  int64_t revision() const { return revision_.load(); }
  /// Live entities of a kind at about the last commit. Never waits.
  uint32_t num_live(EntityKind kind) const { return num_live_[Dimension(kind)].load(); }

  /// Where calls wait for their turn to read or write this.
  AccessQueue& access() { return *access_; }

  /// Begins to read a kStored session, once: whoever asks access() for a turn after that finds it there.
  /// Until then, and where it cannot be read, calls fail with UNAVAILABLE SESSION_LOADING or DATA_LOSS.
  /// Never waits.
  void EnsureLoaded();

  /// What unloading would give back: mesh, indices, history and answers, as they were measured last. Never
  /// waits.
  uint64_t loaded_bytes() const { return measured_bytes_ + spatial_.memory_bytes() + history_bytes_; }
  /// Whether a checkpoint is under way, which keeps a reference to this. Never waits.
  bool writes_checkpoint() const { return writes_checkpoint_; }

  // Unloading (session_unloading.cc). All four are for whoever knows that nobody else has a reference to
  // this, nor can get one meanwhile: then none of them waits.

  /// Whether the store has all that this is, but for what undoes batches. Not before the first revision:
  /// there is nothing to free.
  bool CanUnload() const ABSL_LOCKS_EXCLUDED(mu_);
  /// Begins a checkpoint where loading would have much log to read; false when there is no need, or when one
  /// was tried at this revision.
  bool BeginLastCheckpoint();
  /// Makes loaded_bytes() exact.
  void MeasureMemory() ABSL_LOCKS_EXCLUDED(mu_, repairs_mu_);
  /// The session that takes the place of this one: it is kStored, and shares the log. Destroy this soon.
  /// REQUIRES: CanUnload().
  std::shared_ptr<Session> Unload() ABSL_LOCKS_EXCLUDED(mu_);

  /// Calls `done` once the edit that made `revision` may be acknowledged: at once without a log, else as its
  /// durability says. Errors: what the store says against it; then nobody knows whether it will be there
  /// after a restart. Never waits.
  using Done = SessionLog::Done;
  void AwaitAcknowledged(int64_t revision, Done done);
  /// The same for a thread that has nothing else to do.
  absl::Status WaitUntilAcknowledged(int64_t revision);
  /// As AwaitAcknowledged for when followers may be told of it: once it is on disk.
  void AwaitDurable(int64_t revision, Done done);
  /// The last revision that is on disk; without a log the last one. Never waits.
  int64_t durable_revision() const { return log_ == nullptr ? revision() : log_->durable_revision(); }

  absl::Status WaitUntilDurable(int64_t revision);

  /// What keeps it on disk, and earlier revisions; null: nothing does.
  SessionLog* log() const { return log_.get(); }

  /// Calls fn under the reader lock and returns what it returns.
  absl::Status Read(absl::FunctionRef<absl::Status(const SessionView&)> fn) const ABSL_LOCKS_EXCLUDED(mu_);

  /// The same for a function with a result.
  template <typename T>
  absl::StatusOr<T> ReadAs(absl::FunctionRef<absl::StatusOr<T>(const SessionView&)> fn) const {
    absl::StatusOr<T> result;
    const absl::Status read = Read([&](const SessionView& view) {
      result = fn(view);
      return result.status();
    });
    if (!read.ok()) return read;
    return result;
  }

  absl::StatusOr<SessionInfo> Info() const ABSL_LOCKS_EXCLUDED(mu_);

  /// As they are now. Takes the reader lock for a moment.
  SessionSettings Settings() const ABSL_LOCKS_EXCLUDED(mu_, settings_mu_);

  /// Whether Info() can be had. Never waits.
  SessionState state() const { return state_.load(); }
  /// What is known of a session that is not loaded. Takes the reader lock for a moment.
  SessionInfo Outline() const ABSL_LOCKS_EXCLUDED(mu_);

  /// What Info() says when `mesh` is the content.
  SessionInfo Describe(const Mesh& mesh, const MeshSummary& summary, absl::Time update_time) const;

  /// Applies a batch as one revision, all or nothing. Without edits it answers with the current state.
  /// Makes the checks() of the session on what the batch touches, which may refuse it (NeighborhoodCheck).
  /// Errors: those of ApplyBatch; ABORTED REVISION_MISMATCH (metadata expected, actual); OUT_OF_RANGE
  /// REVISION_IN_FUTURE; INVALID_ARGUMENT REQUEST_ID_REUSED; RESOURCE_EXHAUSTED; those of `stop`, which the
  /// checks ask. Nothing changed then.
  absl::StatusOr<std::shared_ptr<const BatchResult>> Apply(absl::Span<const Edit> edits,
                                                           const ApplyOptions& options,
                                                           const StopSignal& stop = StopSignal::Never())
      ABSL_LOCKS_EXCLUDED(mu_);

  /// Edits the mesh in whatever way, as one revision: calls edit(mesh) in an open batch, which then ends as
  /// that says, and then ended(mesh), both under the writer lock. For what is no list of edits. An edit that
  /// takes long must see itself that it stays within memory and that somebody waits for it (MeshMeter).
  /// `ended` says what the log is to know of the request; it is not asked after a roll-back.
  /// Errors: those of edit; RESOURCE_EXHAUSTED. Nothing changed then, and ended is not called.
  absl::Status EditMesh(absl::FunctionRef<absl::StatusOr<BatchEnding>(Mesh&)> edit,
                        absl::FunctionRef<LoggedRequest(const Mesh&)> ended) ABSL_LOCKS_EXCLUDED(mu_);

  /// Undoes the last batches, or redoes those that were undone last, all or nothing, as one revision.
  /// Errors: FAILED_PRECONDITION NOTHING_TO_UNDO or NOTHING_TO_REDO when there are not as many; ABORTED
  /// REVISION_MISMATCH; INVALID_ARGUMENT REQUEST_ID_REUSED; RESOURCE_EXHAUSTED; those of `stop`. Nothing
  /// changed then.
  absl::StatusOr<std::shared_ptr<const HistoryResult>> MoveInHistory(
      HistoryMove move, const HistoryOptions& options, const StopSignal& stop = StopSignal::Never())
      ABSL_LOCKS_EXCLUDED(mu_);

  /// Puts the session back to what it was, all or nothing, as one revision: `then` is its mesh of an earlier
  /// one (MeshAt()). It can be undone unless that takes more than max_undo_bytes. options.count is not used.
  /// Errors: ABORTED REVISION_MISMATCH; INVALID_ARGUMENT REQUEST_ID_REUSED; RESOURCE_EXHAUSTED; those of
  /// `stop`. Nothing changed then. Cost: that of RestoreRevision.
  absl::StatusOr<std::shared_ptr<const HistoryResult>> RestoreTo(const Mesh& then,
                                                                 const HistoryOptions& options,
                                                                 const StopSignal& stop = StopSignal::Never())
      ABSL_LOCKS_EXCLUDED(mu_);
  /// What such a request got, nullptr if there was none. Errors: INVALID_ARGUMENT REQUEST_ID_REUSED.
  absl::StatusOr<std::shared_ptr<const HistoryResult>> FindRestoration(const HistoryOptions& options) const
      ABSL_LOCKS_EXCLUDED(mu_);

  /// What the import `request_id` gave, nullptr if there was none. Errors: INVALID_ARGUMENT
  /// REQUEST_ID_REUSED. Never waits.
  absl::StatusOr<std::shared_ptr<const ImportOutcome>> FindImport(absl::string_view request_id,
                                                                  uint64_t fingerprint) const
      ABSL_LOCKS_EXCLUDED(imports_mu_);

  /// FindImport and RememberImport for repairs.
  absl::StatusOr<std::shared_ptr<const RepairOutcome>> FindRepair(absl::string_view request_id,
                                                                  uint64_t fingerprint) const
      ABSL_LOCKS_EXCLUDED(repairs_mu_);
  void RememberRepair(const std::string& request_id, uint64_t fingerprint,
                      std::shared_ptr<const RepairOutcome> outcome, size_t bytes)
      ABSL_LOCKS_EXCLUDED(repairs_mu_);

  /// Changes settings, on disk too; no revision is made. All or nothing. Takes the writer lock for as long as
  /// that takes.
  /// Errors: those of StoreJust; ABORTED ETAG_MISMATCH (an empty `etag` fits any).
  absl::Status Update(const SettingsUpdate& update, absl::string_view etag,
                      const StopSignal& stop = StopSignal::Never()) ABSL_LOCKS_EXCLUDED(mu_, settings_mu_);

  /// Just the relations of Update().
  absl::Status StoreRelations(absl::Span<const Relation> wanted, absl::string_view etag,
                              const StopSignal& stop = StopSignal::Never()) ABSL_LOCKS_EXCLUDED(mu_) {
    return Update({.stored_relations = std::vector<Relation>(wanted.begin(), wanted.end())}, etag, stop);
  }

  /// How much the batch names that is to be undone, or redone, next: entities and rows. Never waits.
  uint64_t num_history_items(HistoryMove move) const {
    return num_history_items_[static_cast<int>(move)].load();
  }

  /// What is checked of each batch. Never waits.
  CheckSettings checks() const ABSL_LOCKS_EXCLUDED(settings_mu_) {
    MutexLock lock(&settings_mu_);
    return checks_;
  }

  /// How far back earlier revisions are kept; its own, not the daemon's. Never waits.
  Retention retention() const ABSL_LOCKS_EXCLUDED(settings_mu_) {
    MutexLock lock(&settings_mu_);
    return retention_;
  }

  /// FAILED_PRECONDITION SESSION_NOT_EMPTY unless the session is at revision 0. Never waits.
  absl::Status CheckEmpty() const;

  /// Makes `mesh`, which is at revision 1, the content. It should store the relations that this does: else
  /// they are switched under the lock. Errors: as CheckEmpty; RESOURCE_EXHAUSTED. Nothing changed then.
  absl::Status Adopt(Mesh& mesh, const LoggedRequest& request = {LoggedCall::kImport})
      ABSL_LOCKS_EXCLUDED(mu_);

  void RememberImport(const std::string& request_id, uint64_t fingerprint,
                      std::shared_ptr<const ImportOutcome> outcome) ABSL_LOCKS_EXCLUDED(imports_mu_);

  /// Ends the session and its followers; returns its last revision. An empty `etag` fits any.
  /// Errors: ABORTED ETAG_MISMATCH; NOT_FOUND SESSION_DELETED.
  absl::StatusOr<int64_t> Delete(absl::string_view etag) ABSL_LOCKS_EXCLUDED(mu_);

  /// Where entities are; to be read while the session is.
  SharedSpatialIndex& spatial() const { return spatial_; }

  FollowerList& followers() { return *followers_; }
  DeltaSource& deltas() { return deltas_; }

 private:
  using AnswerPtr = std::shared_ptr<const BatchResult>;
  using HistoryAnswerPtr = std::shared_ptr<const HistoryResult>;

  /// OK unless nobody may edit: it is gone, or an import is being stored.
  absl::Status CheckEditable() const ABSL_SHARED_LOCKS_REQUIRED(mu_);
  std::string EtagAt(int64_t revision) const;
  absl::Status CheckEtag(absl::string_view etag) const ABSL_SHARED_LOCKS_REQUIRED(mu_);
  absl::Status CheckRevisions(const ApplyOptions& options) const ABSL_SHARED_LOCKS_REQUIRED(mu_);
  absl::Status CheckRevision(absl::optional<int64_t> if_revision) const ABSL_SHARED_LOCKS_REQUIRED(mu_);
  absl::StatusOr<AnswerPtr> ApplyLocked(absl::Span<const Edit> edits, const ApplyOptions& options,
                                        uint64_t fingerprint, const StopSignal& stop)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mu_);
  absl::StatusOr<AnswerPtr> ApplyOnce(absl::Span<const Edit> edits, const ApplyOptions& options,
                                      uint64_t fingerprint, const StopSignal& stop)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mu_);
  absl::StatusOr<BatchEnding> EditLocked(absl::FunctionRef<absl::StatusOr<BatchEnding>(Mesh&)> edit)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mu_);
  /// What a request with an id got before; else what answer_now() says, under the writer lock, which is
  /// remembered.
  absl::StatusOr<HistoryAnswerPtr> AnswerOnce(
      const HistoryOptions& options, const LoggedRequest& request,
      absl::FunctionRef<absl::StatusOr<HistoryAnswerPtr>()> answer_now) ABSL_LOCKS_EXCLUDED(mu_);
  absl::StatusOr<HistoryAnswerPtr> MoveLocked(HistoryMove move, const HistoryOptions& options,
                                              const LoggedRequest& request, const StopSignal& stop)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mu_);
  absl::StatusOr<HistoryAnswerPtr> RestoreLocked(const Mesh& then, const HistoryOptions& options,
                                                 const LoggedRequest& request, const StopSignal& stop)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mu_);
  absl::StatusOr<RestoredBatches> RunRestore(
      const HistoryOptions& options, const StopSignal& stop,
      absl::FunctionRef<absl::StatusOr<RestoredBatches>(const RestoreOptions&)> restore)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mu_);
  HistoryAnswerPtr Restored(HistoryResult result, const HistoryOptions& options, const LoggedRequest& request)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mu_);
  /// The result of fn(), which edits mesh_. When that throws, an edit has been left half way: the session is
  /// damaged then, and its error is returned.
  absl::Status RunEdit(absl::FunctionRef<absl::Status()> fn) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mu_);
  /// Whether the edits, with those since it was last so, are enough to measure memory for.
  absl::StatusOr<bool> CheckMemory(absl::Span<const Edit> edits) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mu_);
  /// Keeps what undoes the batch that was just committed. Where memory runs out all is forgotten.
  void Remember(absl::optional<BatchImage> image) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mu_);
  /// Batches were undone or redone. Where memory runs out all is forgotten.
  void Moved(HistoryMove move, uint32_t count, std::deque<BatchImage> images)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mu_);
  void CountHistory() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mu_);
  /// An index can be made again: it goes when the mesh needs its room, and what undoes batches goes next.
  void MakeRoom(uint64_t mesh_bytes) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mu_);
  AnswerPtr Unchanged() const ABSL_SHARED_LOCKS_REQUIRED(mu_);
  absl::Status AdoptLocked(Mesh& mesh) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mu_);
  void Committed() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mu_);
  /// Those who follow are told of what is committed, at once or when it is durable.
  void WakeFollowers();

  // session_durability.cc
  void Load();
  void StoreRelationsAgain(Mesh& mesh) const;
  absl::Status LoadLocked(RecoveredSession& recovered) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mu_);
  absl::Status ForgetWrongOrigin(RecoveredSession& recovered) const;
  absl::Status RememberAgain(const LoggedRequest& request) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mu_);
  /// Sends the batch that was just committed to the log, if there is one. What fails there is told to those
  /// who await its revision.
  void Log(absl::FunctionRef<LoggedRequest()> request) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mu_);
  void StartCheckpoint();
  void WriteCheckpoint();
  /// Stores what is to be adopted. After success nobody else edits until that is done.
  absl::Status StoreImport(const Mesh& mesh, absl::Time commit_time, const LoggedRequest& request)
      ABSL_LOCKS_EXCLUDED(mu_);
  absl::Status StoreIdentity() ABSL_LOCKS_EXCLUDED(mu_);
  absl::Status ChangeSettings(const SettingsUpdate& update, absl::string_view etag, const StopSignal& stop)
      ABSL_LOCKS_EXCLUDED(mu_, settings_mu_);

  const Options options_;
  const std::string uid_;
  const absl::Time create_time_;
  const std::shared_ptr<AccessQueue> access_ = std::make_shared<AccessQueue>();
  const std::shared_ptr<SessionLog> log_;  ///< shared with the one that this takes the place of, which goes
  std::atomic<SessionState> state_{SessionState::kLoaded};
  std::atomic<bool> load_begun_{true};
  std::atomic<bool> load_failed_{false};
  std::atomic<bool> writes_checkpoint_{false};
  std::atomic<int64_t> last_checkpoint_tried_{-1};  ///< by BeginLastCheckpoint(): the revision

  mutable SharedMutex mu_;
  Mesh mesh_ ABSL_GUARDED_BY(mu_);
  absl::Time commit_time_ ABSL_GUARDED_BY(mu_);
  absl::Status gone_ ABSL_GUARDED_BY(mu_);  ///< not OK: deleted, damaged by a failure half way, not loaded
  bool stores_import_ ABSL_GUARDED_BY(mu_) = false;
  uint64_t items_since_check_ ABSL_GUARDED_BY(mu_) = 0;
  AnswerMemory<BatchResult> answers_ ABSL_GUARDED_BY(mu_);
  History history_ ABSL_GUARDED_BY(mu_);
  AnswerMemory<HistoryResult> history_answers_ ABSL_GUARDED_BY(mu_);
  std::atomic<int64_t> revision_{0};
  std::atomic<uint64_t> num_updates_;  ///< of settings
  std::array<std::atomic<uint32_t>, kNumEntityKinds> num_live_ = {};
  std::atomic<uint32_t> num_undoable_{0}, num_redoable_{0};
  std::array<std::atomic<uint64_t>, 2> num_history_items_ = {};
  std::atomic<uint64_t> history_bytes_{0};
  std::atomic<uint64_t> measured_bytes_{0};  ///< mesh and answers

  Mutex identity_mu_;  ///< held while settings are changed and stored
  mutable Mutex settings_mu_;
  CheckSettings checks_ ABSL_GUARDED_BY(settings_mu_);
  Retention retention_ ABSL_GUARDED_BY(settings_mu_);  ///< its own; the log has it with the daemon's

  mutable Mutex imports_mu_;
  AnswerMemory<ImportOutcome> imports_ ABSL_GUARDED_BY(imports_mu_);

  mutable Mutex repairs_mu_;
  AnswerMemory<RepairOutcome> repairs_ ABSL_GUARDED_BY(repairs_mu_);

  mutable SummaryCache summary_;
  mutable SharedSpatialIndex spatial_;
  const std::shared_ptr<FollowerList> followers_;  ///< the log wakes them, whatever has become of this
  DeltaSource deltas_;
};

using SessionPtr = std::shared_ptr<Session>;

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_SESSION_H_
