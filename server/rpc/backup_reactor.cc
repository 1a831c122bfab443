#include "server/rpc/backup_reactor.h"

#include <algorithm>
#include <utility>

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
  const absl::Status posted = Post();
  if (!posted.ok()) Finish(LoggedStatus(kBackupRpc, posted));
  return this;
}

absl::Status BackupReactor::Post() {
  DYNMESH_ASSIGN_OR_RETURN(const SessionPtr session, services_.registry.Find(session_name_));
  return PostWork(services_, session, {AccessMode::kRead, /*heavy=*/true, session_name_.size()},
                  [this, session](AccessGrant grant) { CopyAndWrite(*session, std::move(grant)); });
}

void BackupReactor::CopyAndWrite(const Session& session, AccessGrant grant) {
  absl::Status status = stop_.Check();
  if (status.ok()) status = CatchExceptions([&] { return Copy(session, grant); });
  grant.Release();
  status.ok() ? StartWrite(&response_) : EndWith(status);
}

absl::Status BackupReactor::Copy(const Session& session, AccessGrant& grant) {
  DYNMESH_ASSIGN_OR_RETURN(SessionBackup backup, BeginBackup(session, lease_, [&grant] { grant.Release(); }));
  writer_ = std::move(backup.writer);
  response_.set_revision(backup.info.revision);
  response_.set_total(writer_->num_pages());
  *response_.mutable_session() = FromSessionInfo(backup.info);
  return absl::OkStatus();
}

// Freeing a copy takes a while, too: not on a thread of gRPC.
void BackupReactor::OnWriteDone(bool ok) {
  services_.heavy().Post([this, ok] { ok ? WriteNext() : EndWith(CallCancelled()); });
}

void BackupReactor::WriteNext() {
  const absl::StatusOr<bool> more = CatchExceptions([this] { return FillNext(); });
  more.ok() && *more ? StartWrite(&response_) : EndWith(more.status());
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
  writer_ = nullptr;
  lease_ = Lease();  // before the peer knows that it may come again
  Finish(LoggedStatus(kBackupRpc, status));
}

}  // namespace dynmesh
