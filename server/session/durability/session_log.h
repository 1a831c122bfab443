#ifndef DYNMESH_SERVER_SESSION_DURABILITY_SESSION_LOG_H_
#define DYNMESH_SERVER_SESSION_DURABILITY_SESSION_LOG_H_

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/functional/any_invocable.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "core/archive/dirty_pages.h"
#include "core/archive/record.h"
#include "core/edit/batch_keeper.h"
#include "core/mesh/mesh.h"
#include "server/session/durability/log_record.h"
#include "server/session/durability/retained_revisions.h"
#include "server/session/durability/revision_gate.h"
#include "server/session/executor.h"
#include "server/session/mutex.h"
#include "server/store/store.h"

namespace dynmesh {

struct SessionLogOptions {
  Durability durability = Durability::kSync;  ///< what acknowledges an edit
  /// Records of so many bytes make another checkpoint due.
  uint64_t checkpoint_bytes = uint64_t{64} << 20;
  /// What stays when a checkpoint has made it superfluous: for the answers that retries get, and for those
  /// who go back.
  RetainedRevisions::AnswersToKeep kept_answers = {4096, uint64_t{64} << 20};
  Retention retention = {kDefaultRetainedRevisions, absl::ZeroDuration(), kDefaultRetainedBytes};
};

/// Where a revision comes from, which stays for as long as this is held.
using PinnedSource = std::shared_ptr<const RevisionSource>;

/// Keeps a session in its store: a record of each batch, checkpoints from time to time.
///
///     batch -- Keep() -- Mesh::Commit() -- Append() --> record --> written --> on disk
///                                                                    |           |
///                                         AwaitAcknowledged(): kAsync            +-- kSync, AwaitDurable()
///
/// What cannot be stored is not edited any more: after the first failure Keep() refuses every batch with it.
/// Thread safety: Keep() and Append() are for whoever has the session's writer lock, StoreAll() and
/// WriteCheckpoint() for one thread at a time; all else full.
class SessionLog final : public BatchKeeper {
 public:
  using Done = RevisionGate::Done;
  /// Calls its argument with the session's mesh, which nobody edits meanwhile.
  using Reader = absl::FunctionRef<absl::Status(absl::FunctionRef<absl::Status(const Mesh&, absl::Time)>)>;

  /// The store holds what the session is. Waiters are called on threads of `executor`.
  SessionLog(std::unique_ptr<SessionStore> store, const SessionLogOptions& options, Executor* executor);

  /// Calls `watcher` on a thread of the executor whenever more revisions are durable, in place of the one
  /// before. Call it before anybody waits for that.
  void WatchDurable(absl::AnyInvocable<void()> watcher);

  /// Encodes what the open batch did. Errors: those of status(); RESOURCE_EXHAUSTED LIMIT_EXCEEDED
  /// (max_record_bytes) when that is more than a store takes.
  absl::Status Keep(const Mesh& mesh) override;
  /// The batch kept last is committed: it goes to the store as `revision`.
  void Append(int64_t revision, absl::Time commit_time, const LoggedRequest& request);

  /// What was committed could not be handed to the store: from here on nothing is acknowledged.
  void Fail(const absl::Status& status);

  /// Calls `done` once an edit that made `revision` may be acknowledged, or what the store says against it.
  void AwaitAcknowledged(int64_t revision, Done done) { acknowledged_->Wait(revision, std::move(done)); }
  absl::Status WaitUntilAcknowledged(int64_t revision) { return acknowledged_->Await(revision); }
  absl::Status WaitUntilDurable(int64_t revision) { return durable_->Await(revision); }
  /// The same for when it is on disk, so that followers may be told.
  void AwaitDurable(int64_t revision, Done done) { durable_->Wait(revision, std::move(done)); }
  int64_t acknowledged_revision() const { return acknowledged_->reached(); }
  int64_t durable_revision() const { return durable_->reached(); }
  /// OK, or why the session takes no more edits until it is opened again.
  absl::Status status() const { return acknowledged_->status(); }

  /// What the store holds already, and the pages that its last checkpoint has not as they are. To be called
  /// before anything is appended.
  void NoteStored(StoredRevisions stored, const DirtyPages& changed);

  /// The session is unloaded: frees what NoteStored() brings back. For whoever has the session's writer lock,
  /// when no checkpoint is under way.
  void Rest();

  /// Makes `mesh`, which no records lead to, what the store holds. Blocks until it is on disk.
  absl::Status StoreAll(const Mesh& mesh, absl::Time commit_time, const LoggedRequest& request);

  /// Whether records have come to so much since the last checkpoint that another one is due.
  bool IsCheckpointDue() const { return bytes_since_checkpoint_ > options_.checkpoint_bytes; }
  /// Whether it is much to read again, so that a session had better write one before it is unloaded.
  bool IsLongSinceCheckpoint() const { return bytes_since_checkpoint_ > options_.checkpoint_bytes / 8; }
  /// Writes the pages that batches have touched since the last one, between edits, and trims records. Blocks
  /// until it is on disk.
  absl::Status WriteCheckpoint(Reader read);

  // Earlier revisions (session_log_revisions.cc). Thread safety: full.

  void SetRetention(const Retention& retention);
  /// This and all later revisions can be had.
  int64_t oldest_revision() const;
  /// Errors: OUT_OF_RANGE REVISION_GONE, REVISION_IN_FUTURE. REQUIRES: this outlives what is returned.
  absl::StatusOr<PinnedSource> PinRevision(int64_t revision);

  std::vector<Snapshot> snapshots() const;
  /// Errors: NOT_FOUND SNAPSHOT_NOT_FOUND.
  absl::StatusOr<Snapshot> FindSnapshot(absl::string_view name) const;
  /// Keeps a revision under a name; on disk when it returns. `snapshot` says name, revision, time and note.
  /// Errors: those of PinRevision; ALREADY_EXISTS SNAPSHOT_EXISTS; RESOURCE_EXHAUSTED LIMIT_EXCEEDED
  /// (max_snapshots); those of the store.
  absl::Status AddSnapshot(Snapshot snapshot);
  /// What only it needs goes with the next checkpoint. Errors: NOT_FOUND SNAPSHOT_NOT_FOUND; those of the
  /// store.
  absl::Status DeleteSnapshot(absl::string_view name);

  SessionStore& store() { return *store_; }
  const SessionLogOptions& options() const { return options_; }

 private:
  /// Without a word to those who wait for it.
  absl::Status CommitAll(const Mesh& mesh, Origin origin);
  absl::Status DropSuperfluous();
  absl::Status StoreSnapshots(std::vector<Snapshot> snapshots) ABSL_EXCLUSIVE_LOCKS_REQUIRED(snapshots_mu_);
  absl::Status WritePages(Reader read, const DirtyPages& pages, CheckpointWriter& writer, int64_t& newest);

  const SessionLogOptions options_;
  const std::unique_ptr<SessionStore> store_;
  Executor* const executor_;
  // Shared with callbacks of the store that may run after this is gone.
  const std::shared_ptr<RevisionGate> acknowledged_;
  const std::shared_ptr<RevisionGate> durable_;
  RecordEncoder encoder_;
  std::string batch_;  ///< of the batch kept last
  std::atomic<uint64_t> bytes_since_checkpoint_{0};
  Mutex snapshots_mu_;  ///< held while the list of snapshots is stored
  mutable Mutex mu_;
  DirtyPages dirty_ ABSL_GUARDED_BY(mu_);
  RetainedRevisions retained_ ABSL_GUARDED_BY(mu_);
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_DURABILITY_SESSION_LOG_H_
