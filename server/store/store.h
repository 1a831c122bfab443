#ifndef DYNMESH_SERVER_STORE_STORE_H_
#define DYNMESH_SERVER_STORE_STORE_H_

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/functional/any_invocable.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/types/optional.h"
#include "absl/types/span.h"

/// Where sessions outlive the daemon. A store keeps bytes: what they mean is the session's business.
namespace dynmesh {

/// When an append is acknowledged. Sessions that need neither have no store.
enum class Durability {
  kAsync,  ///< once written: survives the process; loss of power takes the last CommitterOptions::async_delay
  kSync,   ///< once it is on disk
};

/// What a session is after the record or the checkpoint before it, up to `revision`.
struct Record {
  int64_t revision = 0;  ///< greater than that of what came before; more than one more is allowed
  std::string bytes;
};

/// The head of a checkpoint.
struct Checkpoint {
  int64_t revision = 0;
  std::string manifest;  ///< the session's own: how to read the pages
  uint64_t number = 0;   ///< greater than those of all before; never used again
};

/// What becomes of the checkpoint before when another is made.
enum class FormerCheckpoint { kDrop, kKeep };

/// Records with revisions in (after, last].
struct RecordRange {
  int64_t after = 0;
  int64_t last = 0;
};

using PageKey = uint64_t;

/// A checkpoint being made. Destroyed without Commit(), it leaves nothing behind, and neither does a crash.
///
/// Pages go to the disk in the background of appends. Those that are neither written nor dropped stay as they
/// are in the checkpoint before, and lie on the disk once for all that have them.
/// Errors: those of everything that writes to the SessionStore; of pages that were fenced, by Commit().
/// Thread safety: one thread at a time. Must not outlive its session.
class CheckpointWriter {
 public:
  virtual ~CheckpointWriter() = default;

  /// Checkpoint::number of what Commit() makes.
  virtual uint64_t number() const = 0;

  /// Blocks while too much waits to be written. Writing a page again replaces it.
  virtual absl::Status WritePage(PageKey page, std::string bytes) = 0;
  /// The page is no part of the checkpoint. Dropping one that is not there does nothing.
  virtual absl::Status DropPage(PageKey page) = 0;
  /// Makes it the session's checkpoint, all or nothing, and returns once it is on disk. The writer cannot be
  /// used after it.
  virtual absl::Status Commit(std::string manifest, FormerCheckpoint former) = 0;
  absl::Status Commit(std::string manifest) { return Commit(std::move(manifest), FormerCheckpoint::kDrop); }
};

/// One session's records, checkpoints and named values, for as long as no other owner opens it.
///
///     session->Append({43, bytes}, Durability::kSync, [](const absl::Status& status) { ... });
///     auto writer = session->BeginCheckpoint(43);          // *writer: ->WritePage(...), ->Commit(...)
///     session->TrimRecords(43);
///
/// Recovery: ReadCheckpoint(), then ReadRecords() after its revision. The same with an older one that was
/// kept gives what the session was before.
///
/// Errors of all that writes: ABORTED FENCED when another owner has opened the session since; NOT_FOUND
/// SESSION_DELETED; UNAVAILABLE STORE_FAILED or RESOURCE_EXHAUSTED STORE_FULL when it failed;
/// FAILED_PRECONDITION STORE_FAILED or RESOURCE_EXHAUSTED STORE_FULL when one before it failed, for then the
/// store only reads until it is opened again.
/// Errors of all that reads: DATA_LOSS STORE_DAMAGED, naming the session; UNAVAILABLE STORE_FAILED.
/// Thread safety: full, except that one thread at a time calls Append(), and one BeginCheckpoint() and
/// DropCheckpoint(). Must not outlive its store.
class SessionStore {
 public:
  /// Called exactly once, on a thread of the store, never from within the call that was given it. Must be
  /// short and must not wait for the store.
  using Done = absl::AnyInvocable<void(const absl::Status&)>;
  using Watcher = absl::AnyInvocable<void(const absl::StatusOr<int64_t>& durable_revision)>;
  using RecordFn = absl::FunctionRef<absl::Status(int64_t revision, absl::string_view bytes)>;
  using PageFn = absl::FunctionRef<absl::Status(PageKey page, absl::string_view bytes)>;

  virtual ~SessionStore() = default;

  /// Greater than the token of every owner before.
  virtual uint64_t fencing_token() const = 0;
  /// The revision of the last record or checkpoint, acknowledged or not; 0 when there is none.
  virtual int64_t last_revision() const = 0;
  /// Records up to this revision are gone.
  virtual int64_t trimmed_revision() const = 0;
  /// The last one that is known to survive a loss of power.
  virtual int64_t durable_revision() const = 0;
  /// From now on `watcher` is called whenever that has grown, and with an error when what was written will
  /// never be on disk, on threads of the store, one call at a time; null: nobody is. It must be short, and
  /// must not wait for the store. One call may still be under way when this, or the destructor, returns.
  virtual void WatchDurable(Watcher watcher) = 0;

  /// Acknowledgements come in the order of the calls among those of the same durability; a kAsync one does
  /// not wait for the disk, so it may come before that of a kSync call that was earlier. A record that was
  /// not acknowledged may be found after a crash all the same, but only whole and only with all before it.
  /// Errors: INVALID_ARGUMENT BAD_ARGUMENT (the revision is not a later one); RESOURCE_EXHAUSTED
  /// LIMIT_EXCEEDED (kMaxStoredBytes).
  virtual void Append(Record record, Durability durability, Done done) = 0;

  /// Records of the range, in order; fn's first error ends it and is returned. fn must not write to the
  /// store. Errors: OUT_OF_RANGE STORE_TRIMMED: the first ones are gone. The last ones of a range that was
  /// trimmed in part are not missed: look at the last revision.
  virtual absl::Status ReadRecords(const RecordRange& range, RecordFn fn) = 0;
  /// The same for all with greater revisions than `after`.
  absl::Status ReadRecords(int64_t after, RecordFn fn) { return ReadRecords({after, INT64_MAX}, fn); }

  /// Those that are kept, by number: the last one is the session's, the others its former ones.
  virtual absl::StatusOr<std::vector<Checkpoint>> ListCheckpoints() = 0;

  /// A checkpoint that is kept, with its pages in ascending order. Pages are handed out before the last one
  /// is known to be good: drop them on an error. Errors: NOT_FOUND CHECKPOINT_NOT_FOUND.
  virtual absl::StatusOr<Checkpoint> ReadCheckpoint(uint64_t number, PageFn fn) = 0;

  /// One at a time. Recovery applies the records after `revision` to the pages, so these hold all that
  /// records up to it say. They may also hold what later ones say, each page up to another revision, if
  ///  - applying a record to pages that hold it already changes nothing, and
  ///  - when Commit() is called, durable_revision() is at least the last revision of which any page holds
  ///    something: else a loss of power leaves the page without the record that tells the rest of that
  ///    change.
  /// A checkpoint beyond the last record replaces all records, so its pages hold exactly `revision`.
  /// Errors: FAILED_PRECONDITION CHECKPOINT_OPEN; INVALID_ARGUMENT BAD_ARGUMENT (a revision before the last
  /// checkpoint's).
  virtual absl::StatusOr<std::unique_ptr<CheckpointWriter>> BeginCheckpoint(int64_t revision) = 0;

  /// Deletes a former checkpoint and the pages that no other one has. Not from a Done. Errors: NOT_FOUND
  /// CHECKPOINT_NOT_FOUND, also for the last one; FAILED_PRECONDITION CHECKPOINT_OPEN.
  virtual absl::Status DropCheckpoint(uint64_t number) = 0;

  /// Deletes records up to and including `revision`, but for those of `kept`, soon.
  /// Errors: INVALID_ARGUMENT BAD_ARGUMENT: no checkpoint holds what they say.
  virtual absl::Status TrimRecords(int64_t revision, absl::Span<const RecordRange> kept) = 0;
  absl::Status TrimRecords(int64_t revision) { return TrimRecords(revision, {}); }

  /// Small values by name, on disk when the call returns. Not from a Done.
  virtual absl::Status PutValue(absl::string_view name, std::string bytes) = 0;
  virtual absl::Status DeleteValue(absl::string_view name) = 0;
  virtual absl::StatusOr<absl::optional<std::string>> GetValue(absl::string_view name) = 0;
};

/// The sessions that are kept, by name. Opening a store reads their names only.
///
/// Errors of what writes: as SessionStore's.
/// Thread safety: full.
class Store {
 public:
  virtual ~Store() = default;

  /// Sorted by name, damaged ones among them.
  virtual std::vector<std::string> ListSessions() const = 0;

  /// Errors: ALREADY_EXISTS SESSION_EXISTS; INVALID_ARGUMENT BAD_SESSION_NAME (empty, or over kMaxNameBytes).
  virtual absl::Status CreateSession(absl::string_view name) = 0;

  /// Takes the session over from whoever has it. What the former owner appended before is there.
  /// Errors: NOT_FOUND SESSION_NOT_FOUND; DATA_LOSS STORE_DAMAGED.
  virtual absl::StatusOr<std::unique_ptr<SessionStore>> OpenSession(absl::string_view name) = 0;

  /// With all its data, whoever has it open. Errors: NOT_FOUND SESSION_NOT_FOUND.
  virtual absl::Status DeleteSession(absl::string_view name) = 0;

  /// OK, or why the store only reads until it is opened again.
  virtual absl::Status status() const = 0;
};

inline constexpr size_t kMaxNameBytes = 1024;               ///< of sessions and of values
inline constexpr size_t kMaxStoredBytes = size_t{1} << 30;  ///< of a record, a page, a value

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_STORE_STORE_H_
