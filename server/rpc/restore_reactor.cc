#include "server/rpc/restore_reactor.h"

#include <algorithm>
#include <utility>

#include "absl/time/clock.h"
#include "core/mesh/error.h"
#include "server/rpc/call_stop.h"
#include "server/rpc/convert_backups.h"
#include "server/rpc/convert_sessions.h"
#include "server/rpc/status.h"
#include "server/rpc/unary.h"
#include "server/session/catch_exceptions.h"
#include "server/session/session_errors.h"

namespace dynmesh {
namespace {

constexpr char kRestoreRpc[] = "RestoreBackup";

}  // namespace

RestoreReactor* RestoreReactor::Start() {
  {
    MutexLock lock(&watch_->mu);
    watch_->reactor = this;
  }
  WatchUntil(absl::Now() + services_.limits().import_idle_timeout);
  ReadNext();
  return this;
}

void RestoreReactor::OnDone() {
  {
    MutexLock lock(&watch_->mu);
    watch_->reactor = nullptr;
  }
  delete this;
}

// ---- Waiting for the peer ----

void RestoreReactor::ReadNext() {
  {
    MutexLock lock(&mu_);
    waiting_since_ = absl::Now();
  }
  StartRead(&request_);
}

void RestoreReactor::WatchUntil(absl::Time when) {
  services_.registry.workers().timer->RunAt(when, [watch = watch_] {
    MutexLock lock(&watch->mu);
    if (watch->reactor != nullptr) watch->reactor->OnWatch();
  });
}

// Holds watch_->mu, so OnDone() waits.
void RestoreReactor::OnWatch() {
  const absl::Duration timeout = services_.limits().import_idle_timeout;
  const absl::Time now = absl::Now();
  absl::Time due;
  {
    MutexLock lock(&mu_);
    if (ended_) return;
    due = std::min(waiting_since_, now) + timeout;
    ended_ = due <= now;  // a read that ends now is ignored
  }
  if (due > now) return WatchUntil(due);
  services_.heavy().Post([this] { EndWith(ImportIdle(services_.limits().import_idle_timeout)); });
}

void RestoreReactor::OnReadDone(bool ok) {
  {
    MutexLock lock(&mu_);
    waiting_since_ = absl::InfiniteFuture();
    if (ended_) return;
  }
  const absl::Status posted =
      services_.heavy().TryPost([this, ok] { ok ? Receive() : Build(); }, ok ? request_.ByteSizeLong() : 0);
  if (!posted.ok()) EndWith(posted);
}

absl::Status RestoreReactor::CheckWanted() const {
  return cancelled_ ? CallCancelled() : CallStop(context_).Check();
}

// ---- What it sends ----

void RestoreReactor::Receive() {
  const absl::Status received = CatchExceptions([this] { return ReceivePart(); });
  received.ok() ? ReadNext() : EndWith(received);
}

absl::Status RestoreReactor::ReceivePart() {
  DYNMESH_RETURN_IF_ERROR(CheckWanted());
  DYNMESH_RETURN_IF_ERROR(CheckMessageSize(request_, services_.limits()));
  return reader_ == nullptr ? Begin() : AddBytes();
}

absl::Status RestoreReactor::Begin() {
  if (!request_.has_header()) return BadField("header", "a restore begins with a header");
  DYNMESH_ASSIGN_OR_RETURN(options_, ToRestoreOptions(request_.header()));
  DYNMESH_ASSIGN_OR_RETURN(ticket_, services_.registry.import_gate().Enter());
  reader_ =
      std::make_unique<BackupReader>(services_.limits(), Lease(services_.registry.import_gate().staged()));
  return absl::OkStatus();
}

absl::Status RestoreReactor::AddBytes() {
  if (request_.part_case() != v1::RestoreBackupRequest::kData) {
    return BadField("data", "after the header a restore is nothing but data");
  }
  DYNMESH_RETURN_IF_ERROR(reader_->Add(request_.data()));
  if (reader_->identity() == nullptr || std::exchange(is_checked_, true)) return absl::OkStatus();
  return CheckRestore(services_.registry, *reader_->identity(), options_);
}

// ---- What becomes of it ----

void RestoreReactor::Build() {
  EndWith(CatchExceptions([this] { return BuildSession(); }));
}

absl::Status RestoreReactor::BuildSession() {
  DYNMESH_RETURN_IF_ERROR(CheckWanted());
  if (reader_ == nullptr) return BadField("header", "a restore begins with a header");
  DYNMESH_ASSIGN_OR_RETURN(Backup backup, std::move(*reader_).Finish());
  DYNMESH_RETURN_IF_ERROR(CheckWanted());
  response_->set_source_name(backup.identity.name);
  response_->set_source_uid(backup.identity.uid);
  DYNMESH_ASSIGN_OR_RETURN(const SessionInfo info,
                           services_.registry.CreateFrom(SeedOf(std::move(backup), options_)));
  *response_->mutable_session() = FromSessionInfo(info);
  response_->set_revision(info.revision);
  return absl::OkStatus();
}

void RestoreReactor::EndWith(const absl::Status& status) {
  {
    MutexLock lock(&mu_);
    ended_ = true;
  }
  reader_ = nullptr;
  ticket_ = nullptr;  // before the peer knows that it may come again
  Finish(LoggedStatus(kRestoreRpc, status));
}

}  // namespace dynmesh
