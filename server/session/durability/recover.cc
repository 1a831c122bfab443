#include "server/session/durability/recover.h"

#include <algorithm>
#include <limits>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/archive/rebuilder.h"
#include "core/mesh/error.h"
#include "server/session/answer_memory.h"
#include "server/session/durability/manifest.h"
#include "server/store/store_errors.h"

namespace dynmesh {

namespace {

/// Of all kinds of requests together: at least as many as a session remembers.
constexpr size_t kRememberedRequests = 4 * kRememberedAnswers;
constexpr size_t kRememberedBytes = 4 * kRememberedAnswerBytes;

/// A checkpoint that is being read again.
struct Restart {
  Rebuilder rebuilder;
  SessionManifest manifest;
};

/// Reads its pages. REQUIRES: the store lists it.
absl::StatusOr<Restart> ReadPages(SessionStore& store, const Checkpoint& checkpoint, const Limits& limits) {
  DYNMESH_ASSIGN_OR_RETURN(SessionManifest manifest, DecodeManifest(checkpoint.manifest));
  DYNMESH_ASSIGN_OR_RETURN(Rebuilder rebuilder,
                           Rebuilder::Start(manifest.head, {.max_memory_bytes = MaxRebuildBytes(limits)}));
  const auto add_page = [&](PageKey, absl::string_view bytes) { return rebuilder.AddPage(bytes); };
  DYNMESH_RETURN_IF_ERROR(store.ReadCheckpoint(checkpoint.number, add_page).status());
  return Restart{std::move(rebuilder), std::move(manifest)};
}

absl::StatusOr<std::vector<StoredCheckpoint>> ToStored(const std::vector<Checkpoint>& checkpoints) {
  std::vector<StoredCheckpoint> stored;
  for (const Checkpoint& checkpoint : checkpoints) {
    DYNMESH_ASSIGN_OR_RETURN(const SessionManifest manifest, DecodeManifest(checkpoint.manifest));
    stored.push_back({checkpoint.number, checkpoint.revision, manifest.newest});
  }
  return stored;
}

absl::StatusOr<std::vector<Snapshot>> ReadSnapshots(SessionStore& store) {
  DYNMESH_ASSIGN_OR_RETURN(const absl::optional<std::string> bytes, store.GetValue(kSnapshotsName));
  if (!bytes.has_value()) return std::vector<Snapshot>();
  return DecodeSnapshots(*bytes);
}

/// Forgets the oldest ones when they are more than a session remembers.
void Remember(LoggedRequest request, RecoveredSession& recovered) {
  recovered.answer_bytes += request.answer.size();
  recovered.requests.push_back(std::move(request));
  while (recovered.requests.size() > kRememberedRequests ||
         (recovered.answer_bytes > kRememberedBytes && recovered.requests.size() > 1)) {
    recovered.answer_bytes -= recovered.requests.front().answer.size();
    recovered.requests.pop_front();
  }
}

absl::StatusOr<Checkpoint> FindCheckpoint(SessionStore& store, uint64_t number) {
  DYNMESH_ASSIGN_OR_RETURN(std::vector<Checkpoint> checkpoints, store.ListCheckpoints());
  for (Checkpoint& checkpoint : checkpoints) {
    if (checkpoint.number == number) return std::move(checkpoint);
  }
  return CheckpointNotFound(number);
}

}  // namespace

uint64_t MaxRebuildBytes(const Limits& limits) {
  constexpr uint64_t kSlack = uint64_t{1} << 30;
  const uint64_t bytes = std::min(limits.max_session_bytes, std::numeric_limits<uint64_t>::max() / 4);
  return 2 * bytes + kSlack;
}

absl::StatusOr<RecoveredSession> RecoverSession(SessionStore& store, const Limits& limits) {
  RecoveredSession recovered;
  DYNMESH_ASSIGN_OR_RETURN(const std::vector<Checkpoint> checkpoints, store.ListCheckpoints());
  if (checkpoints.empty()) return StoreDamaged("the session has no checkpoint");
  const Checkpoint& last = checkpoints.back();
  DYNMESH_ASSIGN_OR_RETURN(recovered.stored.checkpoints, ToStored(checkpoints));
  DYNMESH_ASSIGN_OR_RETURN(recovered.stored.snapshots, ReadSnapshots(store));
  DYNMESH_ASSIGN_OR_RETURN(recovered.origin, ReadOrigin(store));
  DYNMESH_ASSIGN_OR_RETURN(Restart restart, ReadPages(store, last, limits));
  recovered.commit_time = restart.manifest.commit_time;
  const auto add_record = [&](int64_t revision, absl::string_view bytes) -> absl::Status {
    DYNMESH_ASSIGN_OR_RETURN(LogRecord record, DecodeLogRecord(bytes));
    const bool has_answer = !record.request.request_id.empty();
    recovered.stored.records.push_back({revision, bytes.size(), record.commit_time, has_answer});
    if (has_answer) Remember(std::move(record.request), recovered);
    if (revision <= last.revision) return absl::OkStatus();
    recovered.commit_time = record.commit_time;
    return restart.rebuilder.AddRecord(record.batch);
  };
  recovered.stored.trimmed = store.trimmed_revision();
  DYNMESH_RETURN_IF_ERROR(store.ReadRecords(recovered.stored.trimmed, add_record));
  recovered.changed_pages = restart.rebuilder.changed_pages();
  DYNMESH_ASSIGN_OR_RETURN(recovered.mesh, std::move(restart.rebuilder).Finish());
  return recovered;
}

absl::StatusOr<RecoveredRevision> RecoverRevision(SessionStore& store, const RevisionSource& source,
                                                  const Limits& limits) {
  DYNMESH_ASSIGN_OR_RETURN(const Checkpoint checkpoint, FindCheckpoint(store, source.checkpoint));
  DYNMESH_ASSIGN_OR_RETURN(Restart restart, ReadPages(store, checkpoint, limits));
  RecoveredRevision recovered{Mesh(), restart.manifest.commit_time};
  const auto add_record = [&](int64_t, absl::string_view bytes) -> absl::Status {
    DYNMESH_ASSIGN_OR_RETURN(const LogRecord record, DecodeLogRecord(bytes));
    recovered.commit_time = record.commit_time;
    return restart.rebuilder.AddRecord(record.batch);
  };
  DYNMESH_RETURN_IF_ERROR(store.ReadRecords(source.records, add_record));
  DYNMESH_ASSIGN_OR_RETURN(recovered.mesh, std::move(restart.rebuilder).Finish());
  if (recovered.mesh.revision() == source.revision()) return recovered;
  return StoreDamaged(
      absl::StrCat("revision ", source.revision(), " was found to be ", recovered.mesh.revision()));
}

absl::StatusOr<absl::optional<Origin>> ReadOrigin(SessionStore& store) {
  DYNMESH_ASSIGN_OR_RETURN(const absl::optional<std::string> bytes, store.GetValue(kOriginName));
  if (!bytes.has_value()) return absl::optional<Origin>();
  DYNMESH_ASSIGN_OR_RETURN(Origin origin, DecodeOrigin(*bytes));
  return absl::optional<Origin>(std::move(origin));
}

}  // namespace dynmesh
