#include "server/store/local_checkpoint.h"

#include <algorithm>
#include <utility>

#include "core/mesh/error.h"

namespace dynmesh {

void AddTrim(layout::SessionId id, int64_t revision, absl::Span<const RecordRange> kept, EngineBatch& batch) {
  std::vector<RecordRange> sorted(kept.begin(), kept.end());
  std::sort(sorted.begin(), sorted.end(),
            [](const RecordRange& a, const RecordRange& b) { return a.after < b.after; });
  const auto add = [&](int64_t after, int64_t last) {
    if (after >= last) return;
    layout::KeyRange records = layout::RecordsOf(id, after, last);
    batch.DeleteRange(std::move(records.from), std::move(records.to));
  };
  int64_t after = 0;
  for (const RecordRange& range : sorted) {
    add(after, std::min(range.after, revision));
    after = std::max(after, range.last);
  }
  add(after, revision);
  const std::string key = layout::TrimmedKey(id);
  batch.Put(key, layout::Seal(key, layout::WriteNumber(static_cast<uint64_t>(revision))));
}

void AddDrop(layout::SessionId id, uint64_t number, CheckpointTable& table, EngineBatch& batch) {
  for (const layout::PageVersion& version : table.Remove(number)) {
    batch.Delete(layout::PageKeyOf(id, version.page, version.checkpoint));
  }
  batch.Delete(layout::ManifestKey(id, number));
}

LocalCheckpoint::~LocalCheckpoint() {
  if (!ended_) {
    EngineBatch batch;
    for (const auto& [page, change] : changes_) {
      if (change == Change::kWritten) batch.Delete(KeyOf({page, number_}));
    }
    // What a failure leaves there is found as a leftover by the first checkpoint of the next owner.
    (void)Enqueue(std::move(batch));
  }
  session_->checkpoint_open_ = false;
}

std::string LocalCheckpoint::KeyOf(const layout::PageVersion& version) const {
  return layout::PageKeyOf(session_->owned_.id(), version.page, version.checkpoint);
}

absl::Status LocalCheckpoint::Enqueue(EngineBatch batch) {
  DYNMESH_RETURN_IF_ERROR(session_->owned_.AwaitRoom());
  Committer::Write write;
  write.batch = std::move(batch);
  session_->owned_.EnqueueBackground(std::move(write));
  return absl::OkStatus();
}

absl::Status LocalCheckpoint::WritePage(PageKey page, std::string bytes) {
  if (bytes.size() > kMaxStoredBytes) return LimitExceeded("max_stored_bytes", kMaxStoredBytes, bytes.size());
  changes_[page] = Change::kWritten;
  std::string key = KeyOf({page, number_});
  std::string value = layout::Seal(key, std::move(bytes));
  EngineBatch batch;
  batch.Put(std::move(key), std::move(value));
  return Enqueue(std::move(batch));
}

absl::Status LocalCheckpoint::DropPage(PageKey page) {
  const auto [change, is_new] = changes_.try_emplace(page, Change::kDropped);
  if (is_new || change->second == Change::kDropped) return absl::OkStatus();
  change->second = Change::kDropped;
  EngineBatch batch;
  batch.Delete(KeyOf({page, number_}));
  return Enqueue(std::move(batch));
}

absl::Status LocalCheckpoint::Commit(std::string manifest, FormerCheckpoint former) {
  ended_ = true;
  CheckpointTable table = *session_->table_;
  EngineBatch batch;
  for (const layout::PageVersion& leftover : table.leftovers()) batch.Delete(KeyOf(leftover));
  table.ClearLeftovers();
  const uint64_t last = table.last_number();
  table.Add(number_, {revision_, Pages()});
  if (last != 0 && former == FormerCheckpoint::kDrop) AddDrop(session_->owned_.id(), last, table, batch);
  AddManifest(table.last_pages(), std::move(manifest), batch);
  // Records before a gap are of no use, and the chain of those after it begins here.
  if (revision_ > session_->progress_->last) AddTrim(session_->owned_.id(), revision_, {}, batch);
  auto on_disk = [progress = session_->progress_, revision = revision_](const absl::Status& status) {
    progress->SetDurable(revision, status);
  };
  DYNMESH_RETURN_IF_ERROR(session_->owned_.CommitAfterBackground(std::move(batch), std::move(on_disk)));
  NoteCommitted(std::move(table));
  return absl::OkStatus();
}

/// Those of the last checkpoint, with the changes.
std::vector<layout::PageVersion> LocalCheckpoint::Pages() const {
  std::vector<layout::PageVersion> pages;
  for (const layout::PageVersion& version : session_->table_->last_pages()) {
    if (!changes_.contains(version.page)) pages.push_back(version);
  }
  for (const auto& [page, change] : changes_) {
    if (change == Change::kWritten) pages.push_back({page, number_});
  }
  std::sort(pages.begin(), pages.end(),
            [](const layout::PageVersion& a, const layout::PageVersion& b) { return a.page < b.page; });
  return pages;
}

void LocalCheckpoint::AddManifest(const std::vector<layout::PageVersion>& pages, std::string manifest,
                                  EngineBatch& batch) const {
  const std::string key = layout::ManifestKey(session_->owned_.id(), number_);
  batch.Put(key, layout::Seal(key, layout::WriteManifest({revision_, pages, manifest})));
}

void LocalCheckpoint::NoteCommitted(CheckpointTable table) {
  SessionProgress& progress = *session_->progress_;
  if (revision_ > progress.last) progress.trimmed = progress.last = revision_;
  progress.checkpoint = revision_;
  *session_->table_ = std::move(table);
}

}  // namespace dynmesh
