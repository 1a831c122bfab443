#include "server/store/local_checkpoint.h"

#include <utility>

#include "core/mesh/error.h"

namespace dynmesh {

void AddTrim(layout::SessionId id, int64_t revision, EngineBatch& batch) {
  layout::KeyRange records = layout::RecordsOf(id, 0, revision);
  batch.DeleteRange(std::move(records.from), std::move(records.to));
  const std::string key = layout::TrimmedKey(id);
  batch.Put(key, layout::Seal(key, layout::WriteNumber(static_cast<uint64_t>(revision))));
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

absl::Status LocalCheckpoint::Commit(std::string manifest) {
  ended_ = true;
  PageTable pages = *session_->pages_;
  EngineBatch batch;
  AddPages(pages, batch);
  AddManifest(pages, std::move(manifest), batch);
  // Records before a gap are of no use, and the chain of those after it begins here.
  if (revision_ > session_->progress_->last) AddTrim(session_->owned_.id(), revision_, batch);
  auto on_disk = [progress = session_->progress_, revision = revision_](const absl::Status& status) {
    progress->SetDurable(revision, status);
  };
  DYNMESH_RETURN_IF_ERROR(session_->owned_.CommitAfterBackground(std::move(batch), std::move(on_disk)));
  NoteCommitted(std::move(pages));
  return absl::OkStatus();
}

void LocalCheckpoint::AddPages(PageTable& pages, EngineBatch& batch) const {
  for (const layout::PageVersion& leftover : pages.leftovers()) batch.Delete(KeyOf(leftover));
  pages.ClearLeftovers();
  for (const auto& [page, change] : changes_) {
    if (const uint64_t replaced = pages.Find(page); replaced != 0) batch.Delete(KeyOf({page, replaced}));
    if (change == Change::kWritten) {
      pages.Put({page, number_});
    } else {
      pages.Remove(page);
    }
  }
}

void LocalCheckpoint::AddManifest(const PageTable& pages, std::string manifest, EngineBatch& batch) const {
  const std::string key = layout::ManifestKey(session_->owned_.id());
  batch.Put(key, layout::Seal(
                     key, layout::WriteManifest({number_, revision_, pages.size(), pages.hash(), manifest})));
}

void LocalCheckpoint::NoteCommitted(PageTable pages) {
  SessionProgress& progress = *session_->progress_;
  if (revision_ > progress.last) progress.trimmed = progress.last = revision_;
  progress.checkpoint = revision_;
  *session_->pages_ = std::move(pages);
}

}  // namespace dynmesh
