#include "server/session/durability/session_log.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/archive/head.h"
#include "core/archive/page.h"
#include "core/mesh/error.h"
#include "server/session/catch_exceptions.h"
#include "server/session/durability/manifest.h"
#include "server/store/store_errors.h"

namespace dynmesh {
namespace {

/// Pages that are encoded before edits get their turn again: less than half a millisecond.
constexpr size_t kPagesAtOnce = 8;

/// Leaves room for the request and its answer.
constexpr size_t kMaxBatchBytes = kMaxStoredBytes / 2;

absl::Status RevisionNotStored(int64_t revision) {
  return StoreFailed(absl::StrCat("revision ", revision, " was not stored"));
}

struct EncodedPage {
  PageId id;
  std::string bytes;  ///< empty: the mesh has it no more
};

PageKey KeyOf(PageId page) { return uint64_t{static_cast<uint8_t>(Dimension(page.kind))} << 32 | page.index; }

EncodedPage Encode(const Mesh& mesh, PageId page) {
  const bool is_there = page.index < NumPages(mesh.slots(page.kind).limit());
  return {page, is_there ? EncodePage(mesh, page) : std::string()};
}

absl::Status Write(EncodedPage page, CheckpointWriter& writer) {
  const PageKey key = KeyOf(page.id);
  return page.bytes.empty() ? writer.DropPage(key) : writer.WritePage(key, std::move(page.bytes));
}

}  // namespace

SessionLog::SessionLog(std::unique_ptr<SessionStore> store, const SessionLogOptions& options,
                       Executor* executor)
    : options_(options),
      store_(std::move(store)),
      executor_(executor),
      acknowledged_(std::make_shared<RevisionGate>(store_->last_revision(), executor)),
      durable_(std::make_shared<RevisionGate>(store_->durable_revision(), executor)),
      retained_(options.retention) {}

void SessionLog::WatchDurable(absl::AnyInvocable<void()> watcher) {
  const auto shared = std::make_shared<absl::AnyInvocable<void()>>(std::move(watcher));
  store_->WatchDurable([acknowledged = acknowledged_, durable = durable_, executor = executor_,
                        shared](const absl::StatusOr<int64_t>& revision) {
    if (!revision.ok()) {
      acknowledged->Fail(revision.status());
      durable->Fail(revision.status());
      return;
    }
    durable->Reach(*revision);
    executor->Post([shared] { (*shared)(); });
  });
}

absl::Status SessionLog::Keep(const Mesh& mesh) {
  DYNMESH_RETURN_IF_ERROR(status());
  batch_ = encoder_.Encode(mesh, {});
  if (batch_.size() > kMaxBatchBytes) return LimitExceeded("max_record_bytes", kMaxBatchBytes, batch_.size());
  MutexLock lock(&mu_);
  dirty_.Add(mesh.journal());
  return absl::OkStatus();
}

void SessionLog::Append(int64_t revision, absl::Time commit_time, const LoggedRequest& request) {
  // After a gap nobody could read what comes.
  if (revision != store_->last_revision() + 1) return Fail(RevisionNotStored(store_->last_revision() + 1));
  Record record{revision, EncodeLogRecord({commit_time, request, batch_})};
  bytes_since_checkpoint_ += record.bytes.size();
  {
    MutexLock lock(&mu_);
    retained_.AddRecord({revision, record.bytes.size(), commit_time, !request.request_id.empty()});
  }
  auto done = [revision, acknowledged = acknowledged_, durable = durable_](const absl::Status& status) {
    if (status.ok()) return acknowledged->Reach(revision);
    acknowledged->Fail(status);
    durable->Fail(status);
  };
  store_->Append(std::move(record), options_.durability, std::move(done));
}

void SessionLog::Fail(const absl::Status& status) {
  acknowledged_->Fail(status);
  durable_->Fail(status);
}

absl::Status SessionLog::StoreAll(const Mesh& mesh, absl::Time commit_time, const LoggedRequest& request) {
  DYNMESH_RETURN_IF_ERROR(status());
  DYNMESH_RETURN_IF_ERROR(CommitAll(mesh, {mesh.revision(), 0, commit_time, request}));
  DropSuperfluous().IgnoreError();  // what fails there is told when the next checkpoint is made
  acknowledged_->Reach(mesh.revision());
  durable_->Reach(mesh.revision());
  return absl::OkStatus();
}

absl::Status SessionLog::CommitAll(const Mesh& mesh, Origin origin) {
  DYNMESH_ASSIGN_OR_RETURN(const auto writer, store_->BeginCheckpoint(origin.revision));
  DirtyPages all;
  all.AddAll(mesh);
  for (PageId page : all.List()) {
    EncodedPage encoded = Encode(mesh, page);
    origin.bytes += encoded.bytes.size();
    DYNMESH_RETURN_IF_ERROR(Write(std::move(encoded), *writer));
  }
  if (origin.revision > 0) DYNMESH_RETURN_IF_ERROR(store_->PutValue(kOriginName, EncodeOrigin(origin)));
  const std::string manifest = EncodeManifest({origin.commit_time, EncodeHead(mesh), origin.revision});
  DYNMESH_RETURN_IF_ERROR(writer->Commit(manifest, FormerCheckpoint::kKeep));
  MutexLock lock(&mu_);
  retained_.BeginAgain({writer->number(), origin.revision, origin.revision});
  return absl::OkStatus();
}

absl::Status SessionLog::WriteCheckpoint(Reader read) {
  DYNMESH_RETURN_IF_ERROR(status());
  DirtyPages pages;
  SessionManifest manifest;
  int64_t revision = 0;
  uint64_t bytes = 0;
  DYNMESH_RETURN_IF_ERROR(read([&](const Mesh& mesh, absl::Time commit_time) {
    manifest = {commit_time, EncodeHead(mesh), mesh.revision()};
    revision = mesh.revision();
    bytes = bytes_since_checkpoint_.exchange(0);
    MutexLock lock(&mu_);
    std::swap(pages, dirty_);  // cannot fail, and comes last
    return absl::OkStatus();
  }));
  const absl::Status written = CatchExceptions([&]() -> absl::Status {
    DYNMESH_ASSIGN_OR_RETURN(const auto writer, store_->BeginCheckpoint(revision));
    DYNMESH_RETURN_IF_ERROR(WritePages(read, pages, *writer, manifest.newest));
    // Pages may tell of later revisions than the head: those must not vanish when these stay.
    DYNMESH_RETURN_IF_ERROR(durable_->Await(manifest.newest));
    DYNMESH_RETURN_IF_ERROR(writer->Commit(EncodeManifest(manifest), FormerCheckpoint::kKeep));
    MutexLock lock(&mu_);
    retained_.AddCheckpoint({writer->number(), revision, manifest.newest});
    return absl::OkStatus();
  });
  if (!written.ok()) {
    bytes_since_checkpoint_ += bytes;
    MutexLock lock(&mu_);
    const absl::Status kept = CatchExceptions([&]() ABSL_NO_THREAD_SAFETY_ANALYSIS {
      dirty_.Add(pages);
      return absl::OkStatus();
    });
    if (!kept.ok()) Fail(kept);  // a later checkpoint would not know of them
    return written;
  }
  return DropSuperfluous();
}

void SessionLog::NoteStored(StoredRevisions stored, const DirtyPages& changed) {
  MutexLock lock(&mu_);
  dirty_.Add(changed);
  uint64_t since = 0;
  for (const StoredRecord& record : stored.records) {
    if (record.revision > stored.checkpoints.back().revision) since += record.bytes;
  }
  bytes_since_checkpoint_ = since;
  retained_.Reset(std::move(stored));
}

void SessionLog::Rest() {
  std::string().swap(batch_);
  encoder_ = RecordEncoder();
  MutexLock lock(&mu_);
  dirty_ = DirtyPages();
  retained_.Reset({});
}

absl::Status SessionLog::DropSuperfluous() {
  RetainedRevisions::Superfluous superfluous;
  {
    MutexLock lock(&mu_);
    superfluous = retained_.TakeSuperfluous(options_.kept_answers, absl::Now());
  }
  for (uint64_t checkpoint : superfluous.checkpoints) {
    DYNMESH_RETURN_IF_ERROR(store_->DropCheckpoint(checkpoint));
  }
  return store_->TrimRecords(superfluous.records, superfluous.kept);
}

absl::Status SessionLog::WritePages(Reader read, const DirtyPages& pages, CheckpointWriter& writer,
                                    int64_t& newest) {
  const std::vector<PageId> list = pages.List();
  for (size_t begin = 0; begin < list.size(); begin += kPagesAtOnce) {
    std::vector<EncodedPage> encoded;
    DYNMESH_RETURN_IF_ERROR(read([&](const Mesh& mesh, absl::Time) {
      for (size_t i = begin; i < std::min(begin + kPagesAtOnce, list.size()); ++i) {
        encoded.push_back(Encode(mesh, list[i]));
      }
      newest = mesh.revision();
      return absl::OkStatus();
    }));
    for (EncodedPage& page : encoded) DYNMESH_RETURN_IF_ERROR(Write(std::move(page), writer));
  }
  return absl::OkStatus();
}

}  // namespace dynmesh
