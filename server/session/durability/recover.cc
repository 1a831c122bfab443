#include "server/session/durability/recover.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "core/archive/rebuilder.h"
#include "core/mesh/error.h"
#include "server/session/durability/manifest.h"
#include "server/store/store_errors.h"

namespace dynmesh {

uint64_t MaxRebuildBytes(const Limits& limits) {
  constexpr uint64_t kSlack = uint64_t{1} << 30;
  const uint64_t bytes = std::min(limits.max_session_bytes, std::numeric_limits<uint64_t>::max() / 4);
  return 2 * bytes + kSlack;
}

absl::StatusOr<RecoveredSession> RecoverSession(SessionStore& store, const Limits& limits) {
  RecoveredSession recovered;
  DYNMESH_ASSIGN_OR_RETURN(const absl::optional<Checkpoint> checkpoint, store.FindCheckpoint());
  if (!checkpoint.has_value()) return StoreDamaged("the session has no checkpoint");
  DYNMESH_ASSIGN_OR_RETURN(const SessionManifest manifest, DecodeManifest(checkpoint->manifest));
  recovered.commit_time = manifest.commit_time;
  recovered.checkpoint_revision = checkpoint->revision;
  DYNMESH_ASSIGN_OR_RETURN(Rebuilder rebuilder,
                           Rebuilder::Start(manifest.head, {.max_memory_bytes = MaxRebuildBytes(limits)}));
  const auto add_page = [&](PageKey, absl::string_view bytes) { return rebuilder.AddPage(bytes); };
  DYNMESH_RETURN_IF_ERROR(store.ReadCheckpoint(add_page).status());
  const auto add_record = [&](int64_t revision, absl::string_view bytes) -> absl::Status {
    DYNMESH_ASSIGN_OR_RETURN(LogRecord record, DecodeLogRecord(bytes));
    recovered.records.push_back({revision, bytes.size()});
    if (!record.request.request_id.empty()) recovered.requests.push_back(std::move(record.request));
    if (revision <= checkpoint->revision) return absl::OkStatus();
    recovered.commit_time = record.commit_time;
    return rebuilder.AddRecord(record.batch);
  };
  DYNMESH_RETURN_IF_ERROR(store.ReadRecords(store.trimmed_revision(), add_record));
  recovered.changed_pages = rebuilder.changed_pages();
  DYNMESH_ASSIGN_OR_RETURN(recovered.mesh, std::move(rebuilder).Finish());
  return recovered;
}

}  // namespace dynmesh
