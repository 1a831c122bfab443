#ifndef DYNMESH_SERVER_SESSION_DURABILITY_RETAINED_REVISIONS_H_
#define DYNMESH_SERVER_SESSION_DURABILITY_RETAINED_REVISIONS_H_

#include <cstdint>
#include <deque>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "server/session/durability/retention.h"
#include "server/session/durability/snapshot.h"
#include "server/store/store.h"

namespace dynmesh {

/// A record that the store holds.
struct StoredRecord {
  int64_t revision = 0;
  uint64_t bytes = 0;
  absl::Time commit_time;
  bool has_answer = false;  ///< to a request that has an id
};

/// A checkpoint that the store holds. With the records after `revision` it gives any revision from `newest`
/// on: some of its pages may be as late as that.
struct StoredCheckpoint {
  uint64_t number = 0;
  int64_t revision = 0;
  int64_t newest = 0;
};

/// What the store of a session holds; all ascending.
struct StoredRevisions {
  std::vector<StoredCheckpoint> checkpoints;
  std::vector<StoredRecord> records;  ///< after `trimmed`
  int64_t trimmed = 0;                ///< records up to this revision are gone, but for those of snapshots
  std::vector<Snapshot> snapshots;
};

/// Where a revision comes from: a checkpoint, and the records after it up to the revision.
struct RevisionSource {
  uint64_t checkpoint = 0;
  RecordRange records;

  int64_t revision() const { return records.last; }
  friend bool operator==(const RevisionSource& a, const RevisionSource& b) {
    return a.checkpoint == b.checkpoint && a.records.last == b.records.last;
  }
};

/// Which revisions of a session the store can give, and what it must keep for that.
///
///     checkpoints   C1 ------- C2 --------------- C3                 (kept as long as a revision needs them)
///     records       . . . . . . . . . . . . . . . . . . . . .
///     revisions           [oldest() ------------------- last]        and those of snapshots
///
/// Reads and writes nothing: the log does what this says. Thread safety: that of std::vector.
class RetainedRevisions {
 public:
  explicit RetainedRevisions(const Retention& retention) : retention_(retention) {}

  void SetRetention(const Retention& retention) { retention_ = retention; }

  /// What the store holds already.
  void Reset(StoredRevisions stored);
  void AddRecord(const StoredRecord& record);
  void AddCheckpoint(const StoredCheckpoint& checkpoint) { checkpoints_.push_back(checkpoint); }
  /// The same of one to which no records lead: those that there were are gone.
  void BeginAgain(const StoredCheckpoint& checkpoint);

  /// What nobody needs any more.
  struct Superfluous {
    std::vector<uint64_t> checkpoints;
    int64_t records = 0;            ///< up to this revision; 0: none
    std::vector<RecordRange> kept;  ///< but for these
  };
  /// So many of the last records with answers stay in any case, and so many bytes of them, for retries; the
  /// last one always.
  struct AnswersToKeep {
    size_t records = 0;
    uint64_t bytes = 0;
  };
  /// Forgets it, too.
  Superfluous TakeSuperfluous(const AnswersToKeep& answers, absl::Time now);

  /// This and all later revisions can be had.
  int64_t oldest() const;
  /// Errors: OUT_OF_RANGE REVISION_GONE, REVISION_IN_FUTURE.
  absl::StatusOr<RevisionSource> FindSource(int64_t revision) const;

  /// While it is pinned, it is not superfluous. Pins count.
  void Pin(const RevisionSource& source) { pins_.push_back(source); }
  void Unpin(const RevisionSource& source);

  /// By name.
  const std::vector<Snapshot>& snapshots() const { return snapshots_; }
  const Snapshot* FindSnapshot(absl::string_view name) const;
  /// In the place of all.
  void SetSnapshots(std::vector<Snapshot> snapshots) { snapshots_ = std::move(snapshots); }

 private:
  bool HasAllRecords(const StoredCheckpoint& checkpoint, int64_t revision) const;
  bool IsNeeded(const StoredCheckpoint& checkpoint) const;
  int64_t OldestWanted(absl::Time now) const;
  uint64_t BytesBetween(int64_t after, int64_t last) const;
  int64_t SuperfluousForAnswers(const AnswersToKeep& answers) const;
  void ForgetRecords(int64_t revision);
  int64_t last() const;
  size_t FirstWithAllRecords() const;
  size_t FindBase(absl::Time now) const;
  std::vector<uint64_t> DropCheckpoints(size_t base);
  std::vector<RecordRange> KeptRecords() const;

  Retention retention_;
  std::vector<StoredCheckpoint> checkpoints_;
  std::deque<StoredRecord> records_;  ///< after trimmed_
  std::vector<Snapshot> snapshots_;
  std::vector<RevisionSource> pins_;
  int64_t trimmed_ = 0;
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_DURABILITY_RETAINED_REVISIONS_H_
