#include "server/store/ownership.h"

#include "server/store/store_errors.h"

namespace dynmesh {

absl::StatusOr<uint64_t> Ownership::TakeOver() {
  MutexLock lock(&mu_);
  if (deleted_) return StoredSessionNotFound(name_);
  return ++token_;
}

absl::Status Ownership::Delete() {
  MutexLock lock(&mu_);
  if (deleted_) return StoredSessionNotFound(name_);
  deleted_ = true;
  return absl::OkStatus();
}

bool Ownership::deleted() const {
  MutexLock lock(&mu_);
  return deleted_;
}

absl::Status Ownership::Check(uint64_t token) const {
  if (deleted_) return StoredSessionDeleted(name_);
  return token == token_ ? absl::OkStatus() : Fenced(name_);
}

void OwnedSession::Enqueue(Committer::Write write) const {
  ownership_->AsOwner(token_, [&](const absl::Status& owner) {
    if (write.refusal.ok()) write.refusal = owner;
    committer_->Enqueue(std::move(write));
  });
}

void OwnedSession::EnqueueBackground(Committer::Write write) const {
  ownership_->AsOwner(token_, [&](const absl::Status& owner) {
    if (write.refusal.ok()) write.refusal = owner;
    committer_->EnqueueBackground(std::move(write));
  });
}

absl::Status OwnedSession::Commit(EngineBatch batch) const {
  AwaitedWrite write(std::move(batch));
  Enqueue(std::move(write.write));
  return write.Wait();
}

absl::Status OwnedSession::CommitAfterBackground(EngineBatch batch,
                                                 Committer::OnDisk on_disk) const {
  AwaitedWrite write(std::move(batch));
  write.write.on_disk = std::move(on_disk);
  EnqueueBackground(std::move(write.write));
  return write.Wait();
}

}  // namespace dynmesh
