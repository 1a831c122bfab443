// What a session log knows of earlier revisions.

#include <algorithm>
#include <memory>
#include <utility>

#include "core/mesh/error.h"
#include "server/session/durability/session_log.h"
#include "server/session/session_errors.h"

namespace dynmesh {

void SessionLog::SetRetention(const Retention& retention) {
  MutexLock lock(&mu_);
  retained_.SetRetention(retention.Within(options_.retention));
}

int64_t SessionLog::oldest_revision() const {
  MutexLock lock(&mu_);
  return retained_.oldest();
}

absl::StatusOr<PinnedSource> SessionLog::PinRevision(int64_t revision) {
  auto source = std::make_unique<RevisionSource>();
  const auto unpin = [this](const RevisionSource* pinned) {
    {
      MutexLock unpin_lock(&mu_);
      retained_.Unpin(*pinned);
    }
    delete pinned;
  };
  {
    MutexLock lock(&mu_);
    DYNMESH_ASSIGN_OR_RETURN(*source, retained_.FindSource(revision));
    retained_.Pin(*source);
  }
  return PinnedSource(source.release(), unpin);
}

std::vector<Snapshot> SessionLog::snapshots() const {
  MutexLock lock(&mu_);
  return retained_.snapshots();
}

absl::StatusOr<Snapshot> SessionLog::FindSnapshot(absl::string_view name) const {
  MutexLock lock(&mu_);
  const Snapshot* snapshot = retained_.FindSnapshot(name);
  if (snapshot == nullptr) return SnapshotNotFound(name);
  return *snapshot;
}

absl::Status SessionLog::AddSnapshot(Snapshot snapshot) {
  MutexLock lock(&snapshots_mu_);
  if (FindSnapshot(snapshot.name).ok()) return SnapshotExists(snapshot.name);
  std::vector<Snapshot> all = snapshots();
  if (all.size() >= kMaxSnapshots) return LimitExceeded("max_snapshots", kMaxSnapshots, all.size() + 1);
  DYNMESH_ASSIGN_OR_RETURN(const PinnedSource pin, PinRevision(snapshot.revision));
  // What is not on disk yet could be taken back by a crash, and the snapshot not.
  DYNMESH_RETURN_IF_ERROR(durable_->Await(snapshot.revision));
  snapshot.checkpoint = pin->checkpoint;
  snapshot.checkpoint_revision = pin->records.after;
  const auto place =
      std::find_if(all.begin(), all.end(), [&](const Snapshot& each) { return each.name > snapshot.name; });
  all.insert(place, std::move(snapshot));
  return StoreSnapshots(std::move(all));
}

absl::Status SessionLog::DeleteSnapshot(absl::string_view name) {
  MutexLock lock(&snapshots_mu_);
  DYNMESH_RETURN_IF_ERROR(FindSnapshot(name).status());
  std::vector<Snapshot> all = snapshots();
  all.erase(std::find_if(all.begin(), all.end(), [&](const Snapshot& each) { return each.name == name; }));
  return StoreSnapshots(std::move(all));
}

/// What an added one needs is pinned meanwhile; what a deleted one needed stays until it is deleted on disk.
absl::Status SessionLog::StoreSnapshots(std::vector<Snapshot> snapshots) {
  DYNMESH_RETURN_IF_ERROR(store_->PutValue(kSnapshotsName, EncodeSnapshots(snapshots)));
  MutexLock lock(&mu_);
  retained_.SetSnapshots(std::move(snapshots));
  return absl::OkStatus();
}

}  // namespace dynmesh
