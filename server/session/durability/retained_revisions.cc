#include "server/session/durability/retained_revisions.h"

#include <algorithm>
#include <limits>

#include "server/session/session_errors.h"

namespace dynmesh {
namespace {

/// Of about so many parts of what is retained the oldest goes at once: there is a checkpoint after each.
constexpr uint64_t kCheckpointsPerRetention = 4;

template <typename T>
T OrMax(T limit) {
  return limit == 0 ? std::numeric_limits<T>::max() : limit;
}

}  // namespace

void RetainedRevisions::Reset(StoredRevisions stored) {
  checkpoints_ = std::move(stored.checkpoints);
  snapshots_ = std::move(stored.snapshots);
  records_.assign(stored.records.begin(), stored.records.end());
  trimmed_ = stored.trimmed;
}

void RetainedRevisions::AddRecord(const StoredRecord& record) { records_.push_back(record); }

void RetainedRevisions::BeginAgain(const StoredCheckpoint& checkpoint) {
  records_.clear();
  trimmed_ = checkpoint.revision;
  AddCheckpoint(checkpoint);
}

RetainedRevisions::Superfluous RetainedRevisions::TakeSuperfluous(const AnswersToKeep& answers,
                                                                  absl::Time now) {
  Superfluous superfluous;
  if (checkpoints_.empty()) return superfluous;
  const size_t base = FindBase(now);
  ForgetRecords(std::min(checkpoints_[base].revision, SuperfluousForAnswers(answers)));
  superfluous.checkpoints = DropCheckpoints(base);
  superfluous.records = trimmed_;
  superfluous.kept = KeptRecords();
  return superfluous;
}

int64_t RetainedRevisions::oldest() const {
  return checkpoints_.empty() ? 0 : checkpoints_[FirstWithAllRecords()].newest;
}

absl::StatusOr<RevisionSource> RetainedRevisions::FindSource(int64_t revision) const {
  if (revision > last()) return RevisionInFuture(revision, last());
  for (auto it = checkpoints_.rbegin(); it != checkpoints_.rend(); ++it) {
    if (it->newest <= revision && HasAllRecords(*it, revision)) {
      return RevisionSource{it->number, {it->revision, revision}};
    }
  }
  return RevisionGone(revision, oldest());
}

void RetainedRevisions::Unpin(const RevisionSource& source) {
  const auto found = std::find(pins_.begin(), pins_.end(), source);
  if (found != pins_.end()) pins_.erase(found);
}

const Snapshot* RetainedRevisions::FindSnapshot(absl::string_view name) const {
  const auto found = std::find_if(snapshots_.begin(), snapshots_.end(),
                                  [name](const Snapshot& snapshot) { return snapshot.name == name; });
  return found == snapshots_.end() ? nullptr : &*found;
}

int64_t RetainedRevisions::last() const {
  const int64_t checkpoint = checkpoints_.empty() ? 0 : checkpoints_.back().revision;
  return records_.empty() ? checkpoint : std::max(checkpoint, records_.back().revision);
}

/// Those of the last one are always there.
size_t RetainedRevisions::FirstWithAllRecords() const {
  size_t first = 0;
  while (first + 1 < checkpoints_.size() && checkpoints_[first].revision < trimmed_) ++first;
  return first;
}

bool RetainedRevisions::HasAllRecords(const StoredCheckpoint& checkpoint, int64_t revision) const {
  if (checkpoint.revision >= trimmed_ || revision == checkpoint.revision) return true;
  return std::any_of(snapshots_.begin(), snapshots_.end(), [&](const Snapshot& snapshot) {
    return snapshot.checkpoint == checkpoint.number && revision <= snapshot.revision;
  });
}

bool RetainedRevisions::IsNeeded(const StoredCheckpoint& checkpoint) const {
  const auto needs = [&](const auto& user) { return user.checkpoint == checkpoint.number; };
  return std::any_of(snapshots_.begin(), snapshots_.end(), needs) ||
         std::any_of(pins_.begin(), pins_.end(), needs);
}

/// The last revision is always wanted.
int64_t RetainedRevisions::OldestWanted(absl::Time now) const {
  const uint32_t max_records = OrMax(retention_.max_revisions);
  const uint64_t max_bytes = OrMax(retention_.max_bytes);
  const absl::Time since =
      retention_.max_age == absl::ZeroDuration() ? absl::InfinitePast() : now - retention_.max_age;
  int64_t oldest = last();
  uint64_t bytes = 0;
  uint32_t count = 0;
  for (auto it = records_.rbegin(); it != records_.rend(); ++it) {
    bytes += it->bytes;
    if (++count > max_records || bytes > max_bytes || it->commit_time < since) return oldest;
    oldest = it->revision;
  }
  // All of them: then what was before the first as well.
  return records_.empty() ? oldest : std::min(oldest, this->oldest());
}

uint64_t RetainedRevisions::BytesBetween(int64_t after, int64_t last) const {
  uint64_t bytes = 0;
  for (const StoredRecord& record : records_) {
    if (record.revision > after && record.revision <= last) bytes += record.bytes;
  }
  return bytes;
}

int64_t RetainedRevisions::SuperfluousForAnswers(const AnswersToKeep& answers) const {
  size_t count = 0;
  uint64_t bytes = 0;
  for (const StoredRecord& record : records_) {
    if (!record.has_answer) continue;
    ++count;
    bytes += record.bytes;
  }
  int64_t last = trimmed_;
  for (const StoredRecord& record : records_) {
    if (record.has_answer) {
      if (count <= 1 || (count <= answers.records && bytes <= answers.bytes)) break;
      bytes -= record.bytes;
      --count;
    }
    last = record.revision;
  }
  return last;
}

void RetainedRevisions::ForgetRecords(int64_t revision) {
  while (!records_.empty() && records_.front().revision <= revision) records_.pop_front();
  trimmed_ = std::max(trimmed_, revision);
}

/// The checkpoint that gives the oldest revision that is wanted.
size_t RetainedRevisions::FindBase(absl::Time now) const {
  const int64_t wanted = OldestWanted(now);
  size_t base = FirstWithAllRecords();
  for (size_t i = base + 1; i < checkpoints_.size() && checkpoints_[i].newest <= wanted; ++i) base = i;
  return base;
}

/// Those before `base`, and after it those that lie close between others; but none that somebody needs.
std::vector<uint64_t> RetainedRevisions::DropCheckpoints(size_t base) {
  const uint64_t spacing = BytesBetween(checkpoints_[base].revision, last()) / kCheckpointsPerRetention;
  std::vector<uint64_t> dropped;
  std::vector<StoredCheckpoint> stay;
  for (size_t i = 0; i < checkpoints_.size(); ++i) {
    const StoredCheckpoint& each = checkpoints_[i];
    const bool is_inner = i > base && i + 1 < checkpoints_.size();
    const bool is_close =
        is_inner && BytesBetween(stay.back().revision, checkpoints_[i + 1].revision) < spacing;
    if (IsNeeded(each) || (i >= base && !is_close)) {
      stay.push_back(each);
    } else {
      dropped.push_back(each.number);
    }
  }
  checkpoints_ = std::move(stay);
  return dropped;
}

std::vector<RecordRange> RetainedRevisions::KeptRecords() const {
  std::vector<RecordRange> kept;
  for (const Snapshot& snapshot : snapshots_) {
    if (snapshot.checkpoint_revision < trimmed_)
      kept.push_back({snapshot.checkpoint_revision, snapshot.revision});
  }
  for (const RevisionSource& pin : pins_) kept.push_back(pin.records);
  return kept;
}

}  // namespace dynmesh
