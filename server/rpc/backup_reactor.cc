#include "server/rpc/backup_reactor.h"

#include <algorithm>
#include <utility>

#include "absl/time/clock.h"
#include "core/mesh/error.h"
#include "server/rpc/convert_sessions.h"
#include "server/rpc/session_work.h"
#include "server/rpc/status.h"
#include "server/session/backup/backup_session.h"
#include "server/session/catch_exceptions.h"
#include "server/session/selection.h"
#include "server/session/session_errors.h"

namespace dynmesh {
namespace {

constexpr char kBackupRpc[] = "BackupSession";

}  // namespace

BackupReactor* BackupReactor::Start() {
  {
    MutexLock lock(&watch_->mu);
    watch_->reactor = this;
  }
  WatchUntil(absl::Now() + services_.limits().import_idle_timeout);
  const absl::Status posted = Post();
  if (!posted.ok()) Finish(LoggedStatus(kBackupRpc, posted));
  return this;
}

void BackupReactor::OnDone() {
  {
    MutexLock lock(&watch_->mu);
    watch_->reactor = nullptr;
  }
  delete this;
}

// ---- Waiting for the peer ----

void BackupReactor::WatchUntil(absl::Time when) {
  services_.registry.workers().timer->RunAt(when, [watch = watch_] {
    MutexLock lock(&watch->mu);
    if (watch->reactor != nullptr) watch->reactor->OnWatch();
  });
}

// Holds watch_->mu, so OnDone() waits.
void BackupReactor::OnWatch() {
  const absl::Duration timeout = services_.limits().import_idle_timeout;
  const absl::Time now = absl::Now();
  absl::Time due;
  {
    MutexLock lock(&mu_);
    if (ended_) return;
    due = std::min(waiting_since_, now) + timeout;
    ended_ = due <= now;  // a write that ends now is ignored
  }
  if (due > now) return WatchUntil(due);
  services_.heavy().Post([this] { EndWith(BackupIdle(services_.limits().import_idle_timeout)); });
}

void BackupReactor::Write() {
  {
    MutexLock lock(&mu_);
    waiting_since_ = absl::Now();
  }
  StartWrite(&response_);
}

// Freeing a copy takes a while, too: not on a thread of gRPC.
void BackupReactor::OnWriteDone(bool ok) {
  {
    MutexLock lock(&mu_);
    waiting_since_ = absl::InfiniteFuture();
    if (ended_) return;
  }
  services_.heavy().Post([this, ok] { ok ? WriteNext() : EndWith(CallCancelled()); });
}

// ---- What it writes ----

absl::Status BackupReactor::Post() {
  DYNMESH_ASSIGN_OR_RETURN(const SessionPtr session, services_.registry.Find(session_name_));
  return PostWork(services_, session, {AccessMode::kRead, /*heavy=*/true, session_name_.size()},
                  [this, session](AccessGrant grant) { CopyAndWrite(*session, std::move(grant)); });
}

void BackupReactor::CopyAndWrite(const Session& session, AccessGrant grant) {
  absl::Status status = stop_.Check();
  if (status.ok()) status = CatchExceptions([&] { return Copy(session, grant); });
  grant.Release();
  status.ok() ? Write() : EndWith(status);
}

absl::Status BackupReactor::Copy(const Session& session, AccessGrant& grant) {
  DYNMESH_ASSIGN_OR_RETURN(SessionBackup backup, BeginBackup(session, lease_, [&grant] { grant.Release(); }));
  writer_ = std::move(backup.writer);
  response_.set_revision(backup.info.revision);
  response_.set_total(writer_->num_pages());
  *response_.mutable_session() = FromSessionInfo(backup.info);
  return absl::OkStatus();
}

void BackupReactor::WriteNext() {
  const absl::StatusOr<bool> more = CatchExceptions([this] { return FillNext(); });
  more.ok() && *more ? Write() : EndWith(more.status());
}

absl::StatusOr<bool> BackupReactor::FillNext() {
  DYNMESH_RETURN_IF_ERROR(stop_.Check());
  if (next_ == piece_.size()) {
    if (writer_->done()) return false;
    piece_ = writer_->Next();
    next_ = 0;
  }
  const size_t size = std::min(kChunkBytes, piece_.size() - next_);
  response_.set_data(piece_.data() + next_, size);
  response_.set_done(writer_->pages_done());
  next_ += size;
  return true;
}

void BackupReactor::EndWith(const absl::Status& status) {
  {
    MutexLock lock(&mu_);
    ended_ = true;
  }
  writer_ = nullptr;
  lease_ = Lease();  // before the peer knows that it may come again
  Finish(LoggedStatus(kBackupRpc, status));
}

}  // namespace dynmesh
