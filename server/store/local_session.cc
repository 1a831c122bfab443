#include "server/store/local_session.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "core/mesh/error.h"
#include "server/store/local_checkpoint.h"
#include "server/store/store_errors.h"

namespace dynmesh {
namespace {

// The payload under a key, or nullopt.
absl::StatusOr<absl::optional<std::string>> GetPayload(const Engine& engine, const std::string& key) {
  DYNMESH_ASSIGN_OR_RETURN(absl::optional<std::string> value, engine.Get(key));
  if (!value.has_value()) return value;
  DYNMESH_ASSIGN_OR_RETURN(const absl::string_view payload, layout::Unseal(key, *value));
  value->resize(payload.size());
  return value;
}

absl::Status CheckSize(size_t bytes) {
  return bytes <= kMaxStoredBytes ? absl::OkStatus()
                                  : LimitExceeded("max_stored_bytes", kMaxStoredBytes, bytes);
}

absl::Status CheckValueName(absl::string_view name) {
  return name.size() <= kMaxNameBytes ? absl::OkStatus()
                                      : LimitExceeded("max_name_bytes", kMaxNameBytes, name.size());
}

// Says whether each record follows the one before it.
class RecordChain {
 public:
  explicit RecordChain(int64_t after) : last_(after) {}

  absl::Status Follow(int64_t revision, int64_t previous) {
    const bool follows = first_ ? previous <= last_ : previous == last_;
    if (!follows) {
      return StoreDamaged(
          absl::StrCat("records between revisions ", last_, " and ", revision, " are missing"));
    }
    first_ = false;
    last_ = revision;
    return absl::OkStatus();
  }

 private:
  int64_t last_;
  bool first_ = true;
};

}  // namespace

absl::StatusOr<std::unique_ptr<SessionStore>> LocalSession::Open(OwnedSession owned) {
  std::unique_ptr<LocalSession> session(new LocalSession(std::move(owned)));
  DYNMESH_RETURN_IF_ERROR(session->Named(session->Load()));
  return std::unique_ptr<SessionStore>(std::move(session));
}

absl::Status LocalSession::Load() {
  DYNMESH_RETURN_IF_ERROR(LoadCheckpoint());
  DYNMESH_RETURN_IF_ERROR(LoadRecords());
  progress_->durable = progress_->last.load();  // the store has synced what former owners wrote
  return absl::OkStatus();
}

absl::Status LocalSession::LoadCheckpoint() {
  DYNMESH_ASSIGN_OR_RETURN(const std::vector<Checkpoint> checkpoints, ListCheckpoints());
  if (!checkpoints.empty()) progress_->checkpoint = progress_->last = checkpoints.back().revision;
  return absl::OkStatus();
}

absl::StatusOr<std::vector<Checkpoint>> LocalSession::ListCheckpoints() {
  std::vector<Checkpoint> checkpoints;
  const layout::KeyRange range = layout::ManifestsOf(owned_.id());
  const auto visit = [&](absl::string_view key, absl::string_view value) -> absl::Status {
    DYNMESH_ASSIGN_OR_RETURN(const uint64_t number, layout::CheckpointOfKey(key));
    DYNMESH_ASSIGN_OR_RETURN(const absl::string_view payload, layout::Unseal(key, value));
    DYNMESH_ASSIGN_OR_RETURN(const layout::StoredManifest manifest, layout::ReadManifest(payload));
    checkpoints.push_back({manifest.revision, std::string(manifest.bytes), number});
    return absl::OkStatus();
  };
  DYNMESH_RETURN_IF_ERROR(Named(owned_.engine().Scan(range.from, range.to, visit)));
  return checkpoints;
}

absl::Status LocalSession::LoadRecords() {
  DYNMESH_ASSIGN_OR_RETURN(const auto payload, GetPayload(owned_.engine(), layout::TrimmedKey(owned_.id())));
  if (payload.has_value()) {
    DYNMESH_ASSIGN_OR_RETURN(const uint64_t trimmed, layout::ReadNumber(*payload));
    progress_->trimmed = static_cast<int64_t>(trimmed);
  }
  if (progress_->trimmed > progress_->checkpoint) return StoreDamaged("its last checkpoint is missing");
  const layout::KeyRange range = layout::RecordsOf(owned_.id(), 0);
  DYNMESH_ASSIGN_OR_RETURN(const auto last, owned_.engine().LastKey(range.from, range.to));
  if (!last.has_value()) return absl::OkStatus();
  DYNMESH_ASSIGN_OR_RETURN(const int64_t revision, layout::RevisionOfKey(*last));
  progress_->last = std::max(progress_->last.load(), revision);
  return absl::OkStatus();
}

absl::Status LocalSession::CheckAppend(const Record& record) const {
  const int64_t last = progress_->last;
  if (record.revision <= last) return BadRevision(record.revision, absl::StrCat("greater than ", last));
  return CheckSize(record.bytes.size());
}

void LocalSession::Append(Record record, Durability durability, Done done) {
  Committer::Write write;
  write.durability = durability;
  write.done = std::move(done);
  write.refusal = CheckAppend(record);
  if (write.refusal.ok()) {
    const int64_t revision = record.revision;
    std::string key = layout::RecordKey(owned_.id(), revision);
    std::string value = layout::Seal(key, layout::WriteRecord({progress_->last, record.bytes}));
    write.batch.Put(std::move(key), std::move(value));
    write.on_disk = [progress = progress_, revision](const absl::Status& status) {
      progress->SetDurable(revision, status);
    };
    progress_->last = revision;
  }
  owned_.Enqueue(std::move(write));
}

absl::Status LocalSession::ReadRecords(const RecordRange& range, RecordFn fn) {
  const int64_t after = std::max<int64_t>(range.after, 0);
  RecordChain chain(after);
  bool any = false;
  const auto visit = [&](absl::string_view key, absl::string_view value) -> absl::Status {
    DYNMESH_ASSIGN_OR_RETURN(const int64_t revision, layout::RevisionOfKey(key));
    DYNMESH_ASSIGN_OR_RETURN(const absl::string_view payload, layout::Unseal(key, value));
    DYNMESH_ASSIGN_OR_RETURN(const layout::StoredRecord record, layout::ReadRecord(payload));
    const absl::Status follows = chain.Follow(revision, record.previous);
    if (!follows.ok()) return IsTrimmed(after) ? StoreTrimmed(after, progress_->trimmed) : follows;
    any = true;
    return fn(revision, record.bytes);
  };
  const layout::KeyRange keys = layout::RecordsOf(owned_.id(), after, std::max(range.last, after));
  DYNMESH_RETURN_IF_ERROR(Named(owned_.engine().Scan(keys.from, keys.to, visit)));
  if (any || after >= range.last || !IsTrimmed(after)) return absl::OkStatus();
  return StoreTrimmed(after, progress_->trimmed);
}

absl::StatusOr<Checkpoint> LocalSession::ReadCheckpoint(uint64_t number, PageFn fn) {
  DYNMESH_ASSIGN_OR_RETURN(absl::optional<Checkpoint> checkpoint, ReadPages(number, fn));
  if (!checkpoint.has_value() || number == 0) return CheckpointNotFound(number);
  return *std::move(checkpoint);
}

absl::StatusOr<absl::optional<Checkpoint>> LocalSession::ReadPages(uint64_t number, PageFn fn) {
  absl::optional<Checkpoint> checkpoint;
  absl::StatusOr<CheckpointTable> table =
      CheckpointTable::Read(owned_.engine(), owned_.id(), number, checkpoint, fn);
  DYNMESH_RETURN_IF_ERROR(Named(table.status()));
  KeepTable(*std::move(table));
  return checkpoint;
}

absl::StatusOr<std::unique_ptr<CheckpointWriter>> LocalSession::BeginCheckpoint(int64_t revision) {
  if (checkpoint_open_.exchange(true)) return CheckpointOpen(owned_.name());
  const int64_t before = progress_->checkpoint;
  absl::Status status =
      revision >= before
          ? LoadTable()
          : BadRevision(revision, absl::StrCat("that of the last checkpoint, ", before, ", or greater"));
  if (!status.ok()) {
    checkpoint_open_ = false;
    return status;
  }
  return std::unique_ptr<CheckpointWriter>(std::make_unique<LocalCheckpoint>(this, revision));
}

absl::Status LocalSession::LoadTable() {
  if (HasTable()) return absl::OkStatus();
  return ReadPages(0, [](PageKey, absl::string_view) { return absl::OkStatus(); }).status();
}

// If none is there: what is there knows of all checkpoints of this owner, and `table` may not.
void LocalSession::KeepTable(CheckpointTable table) {
  MutexLock lock(&mu_);
  if (!table_.has_value()) table_ = std::move(table);
}

bool LocalSession::HasTable() {
  MutexLock lock(&mu_);
  return table_.has_value();
}

absl::Status LocalSession::DropCheckpoint(uint64_t number) {
  if (checkpoint_open_.exchange(true)) return CheckpointOpen(owned_.name());
  const absl::Status dropped = DropNow(number);
  checkpoint_open_ = false;
  return dropped;
}

absl::Status LocalSession::DropNow(uint64_t number) {
  DYNMESH_RETURN_IF_ERROR(LoadTable());
  if (!table_->Contains(number) || number == table_->last_number()) return CheckpointNotFound(number);
  const std::vector<layout::PageVersion> pages = table_->Remove(number);
  EngineBatch manifest;
  manifest.Delete(layout::ManifestKey(owned_.id(), number));
  AwaitedWrite write(std::move(manifest), Durability::kAsync);
  owned_.EnqueueBackground(std::move(write.write));
  DYNMESH_RETURN_IF_ERROR(write.Wait());
  return DeletePages(pages);
}

// A part at a time, so that nobody waits for all. What a crash leaves the next owner finds.
absl::Status LocalSession::DeletePages(const std::vector<layout::PageVersion>& pages) {
  constexpr size_t kPagesAtOnce = 128;
  for (size_t begin = 0; begin < pages.size(); begin += kPagesAtOnce) {
    Committer::Write write;
    for (size_t i = begin; i < std::min(begin + kPagesAtOnce, pages.size()); ++i) {
      write.batch.Delete(layout::PageKeyOf(owned_.id(), pages[i].page, pages[i].checkpoint));
    }
    DYNMESH_RETURN_IF_ERROR(owned_.AwaitRoom());
    owned_.EnqueueBackground(std::move(write));
  }
  return absl::OkStatus();
}

absl::Status LocalSession::TrimRecords(int64_t revision, absl::Span<const RecordRange> kept) {
  const int64_t checkpoint = progress_->checkpoint;
  if (revision > checkpoint) {
    return BadRevision(revision, absl::StrCat("that of the last checkpoint, ", checkpoint, ", or less"));
  }
  if (revision <= progress_->trimmed) revision = progress_->trimmed;  // ranges may be kept no more
  if (revision <= 0) return absl::OkStatus();
  Committer::Write write;
  AddTrim(owned_.id(), revision, kept, write.batch);
  progress_->trimmed = revision;
  owned_.EnqueueBackground(std::move(write));
  return absl::OkStatus();
}

absl::Status LocalSession::PutValue(absl::string_view name, std::string bytes) {
  DYNMESH_RETURN_IF_ERROR(CheckValueName(name));
  DYNMESH_RETURN_IF_ERROR(CheckSize(bytes.size()));
  std::string key = layout::ValueKey(owned_.id(), name);
  std::string value = layout::Seal(key, std::move(bytes));
  EngineBatch batch;
  batch.Put(std::move(key), std::move(value));
  return owned_.Commit(std::move(batch));
}

absl::Status LocalSession::DeleteValue(absl::string_view name) {
  EngineBatch batch;
  batch.Delete(layout::ValueKey(owned_.id(), name));
  return owned_.Commit(std::move(batch));
}

absl::StatusOr<absl::optional<std::string>> LocalSession::GetValue(absl::string_view name) {
  auto payload = GetPayload(owned_.engine(), layout::ValueKey(owned_.id(), name));
  DYNMESH_RETURN_IF_ERROR(Named(payload.status()));
  return payload;
}

absl::Status LocalSession::Named(const absl::Status& status) const {
  return InSession(status, owned_.name());
}

}  // namespace dynmesh
