#include "server/session/revisions.h"

#include <algorithm>
#include <utility>

#include "core/mesh/error.h"
#include "server/session/session_errors.h"

namespace dynmesh {
namespace {

absl::StatusOr<SessionLog*> LogOf(Session& session) {
  if (session.log() == nullptr) return NoHistory(session.name());
  return session.log();
}

/// Those of [first, last] that a record tells of, ascending.
absl::StatusOr<std::vector<RevisionInfo>> ReadRevisions(SessionStore& store, int64_t first, int64_t last) {
  std::vector<RevisionInfo> revisions;
  const auto add = [&](int64_t revision, absl::string_view bytes) -> absl::Status {
    DYNMESH_ASSIGN_OR_RETURN(LogRecord record, DecodeLogRecord(bytes));
    LoggedRequest& request = record.request;
    revisions.push_back({revision, request.call, std::move(request.note), record.commit_time, bytes.size(),
                         std::move(request.request_id)});
    return absl::OkStatus();
  };
  const int64_t after = std::max(first - 1, store.trimmed_revision());
  const absl::Status read = store.ReadRecords({after, last}, add);
  if (absl::IsOutOfRange(read)) revisions.clear();  // trimmed meanwhile: they are told no more
  if (!read.ok() && !absl::IsOutOfRange(read)) return read;
  return revisions;
}

absl::Status AddOrigin(SessionStore& store, int64_t first, int64_t last,
                       std::vector<RevisionInfo>& revisions) {
  const int64_t next = revisions.empty() ? last + 1 : revisions.front().revision;
  DYNMESH_ASSIGN_OR_RETURN(absl::optional<Origin> origin, ReadOrigin(store));
  if (!origin.has_value() || origin->revision < first || origin->revision >= next) return absl::OkStatus();
  LoggedRequest& request = origin->request;
  revisions.insert(revisions.begin(), {origin->revision, request.call, std::move(request.note),
                                       origin->commit_time, origin->bytes, std::move(request.request_id)});
  return absl::OkStatus();
}

/// What a session says that is gone: then what its store says is no damage.
absl::Status StillThere(Session& session) {
  return session.Read([](const SessionView&) { return absl::OkStatus(); });
}

/// Nullopt unless the session is at that revision.
absl::StatusOr<absl::optional<RecoveredRevision>> CopyIfLast(Session& session, int64_t revision) {
  const AccessGrant turn = session.access().Acquire(AccessMode::kRead);
  absl::optional<RecoveredRevision> current;
  DYNMESH_RETURN_IF_ERROR(session.Read([&](const SessionView& view) {
    const bool is_last = revision == kLastRevision || revision == view.mesh.revision();
    if (is_last) current = RecoveredRevision{view.mesh.Clone(), view.commit_time};
    return absl::OkStatus();
  }));
  return current;
}

}  // namespace

absl::Status AwaitLoaded(Session& session) {
  const AccessGrant turn = session.access().Acquire(AccessMode::kRead);
  return StillThere(session);
}

absl::StatusOr<RevisionList> ListRevisions(Session& session, int64_t before, size_t max_count) {
  DYNMESH_ASSIGN_OR_RETURN(SessionLog* const log, LogOf(session));
  RevisionList list;
  list.last = log->acknowledged_revision();  // later ones may not be written yet
  list.oldest = log->oldest_revision();
  const int64_t last = before > 0 ? std::min(before - 1, list.last) : list.last;
  const int64_t first = std::max(last - static_cast<int64_t>(max_count) + 1, list.oldest);
  if (first > last) return list;
  DYNMESH_ASSIGN_OR_RETURN(list.revisions, ReadRevisions(log->store(), first, last));
  DYNMESH_RETURN_IF_ERROR(AddOrigin(log->store(), first, last, list.revisions));
  std::reverse(list.revisions.begin(), list.revisions.end());
  return list;
}

absl::StatusOr<RecoveredRevision> MeshAt(Session& session, int64_t revision) {
  DYNMESH_ASSIGN_OR_RETURN(absl::optional<RecoveredRevision> current, CopyIfLast(session, revision));
  if (current.has_value()) return *std::move(current);
  DYNMESH_ASSIGN_OR_RETURN(SessionLog* const log, LogOf(session));
  DYNMESH_ASSIGN_OR_RETURN(const PinnedSource source, log->PinRevision(revision));
  DYNMESH_RETURN_IF_ERROR(session.WaitUntilAcknowledged(revision));  // so that it is written
  absl::StatusOr<RecoveredRevision> recovered = RecoverRevision(log->store(), *source, session.limits());
  if (!recovered.ok()) DYNMESH_RETURN_IF_ERROR(StillThere(session));
  return recovered;
}

absl::StatusOr<std::shared_ptr<const HistoryResult>> GoBackTo(Session& session, int64_t revision,
                                                              const HistoryOptions& options,
                                                              const StopSignal& stop) {
  DYNMESH_ASSIGN_OR_RETURN(const RecoveredRevision then, MeshAt(session, revision));
  DYNMESH_RETURN_IF_ERROR(stop.Check());
  const AccessGrant turn = session.access().Acquire(AccessMode::kWrite);
  return session.RestoreTo(then.mesh, options, stop);
}

absl::StatusOr<int64_t> FindSnapshotRevision(Session& session, absl::string_view name) {
  DYNMESH_ASSIGN_OR_RETURN(SessionLog* const log, LogOf(session));
  DYNMESH_ASSIGN_OR_RETURN(const Snapshot snapshot, log->FindSnapshot(name));
  return snapshot.revision;
}

absl::StatusOr<Snapshot> CreateSnapshot(Session& session, absl::string_view name, int64_t revision,
                                        const RevisionNote& note) {
  DYNMESH_ASSIGN_OR_RETURN(SessionLog* const log, LogOf(session));
  if (!CheckSessionName(name).ok()) return BadSnapshotName();
  DYNMESH_RETURN_IF_ERROR(CheckNote(note));
  if (revision < 0) return BadField("revision", "revision is negative");
  Snapshot snapshot;
  snapshot.name = std::string(name);
  snapshot.revision = revision == 0 ? session.revision() : revision;
  snapshot.create_time = NowToTheMicrosecond();
  snapshot.note = note;
  DYNMESH_RETURN_IF_ERROR(log->AddSnapshot(snapshot));
  return snapshot;
}

absl::StatusOr<std::vector<Snapshot>> ListSnapshots(Session& session) {
  DYNMESH_ASSIGN_OR_RETURN(SessionLog* const log, LogOf(session));
  return log->snapshots();
}

absl::Status DeleteSnapshot(Session& session, absl::string_view name) {
  DYNMESH_ASSIGN_OR_RETURN(SessionLog* const log, LogOf(session));
  return log->DeleteSnapshot(name);
}

}  // namespace dynmesh
