#include "server/session/backup/backup_session.h"

#include <utility>

#include "absl/types/optional.h"
#include "core/mesh/error.h"
#include "server/session/fingerprint.h"

namespace dynmesh {

absl::StatusOr<SessionBackup> BeginBackup(const Session& session, Lease& lease,
                                          absl::FunctionRef<void()> copied) {
  absl::optional<Mesh> copy;
  absl::Time commit_time;
  const absl::Status read = session.Read([&](const SessionView& view) {
    DYNMESH_RETURN_IF_ERROR(lease.Grow(view.mesh.memory_bytes()));
    copy = view.mesh.Clone();
    commit_time = view.commit_time;
    return absl::OkStatus();
  });
  copied();
  if (!read.ok()) return read;
  SessionBackup backup;
  backup.info = session.Describe(*copy, SummaryCache().Of(*copy), commit_time);
  BackupIdentity identity{session.name(), session.uid(), backup.info.create_time, commit_time,
                          backup.info.settings};
  backup.writer = std::make_unique<BackupWriter>(std::move(identity), *std::move(copy));
  return backup;
}

SessionSeed SeedOf(Backup backup, const RestoreOptions& options) {
  SessionSeed seed{.name = options.name.empty() ? backup.identity.name : options.name,
                   .settings = std::move(backup.identity.settings),
                   .mesh = std::move(backup.mesh),
                   .commit_time = backup.identity.commit_time,
                   .request_id = options.request_id,
                   .validate_only = options.validate_only};
  if (options.durability != SessionDurability::kDefault) seed.settings.durability = options.durability;
  Fingerprint fingerprint;
  fingerprint.AddString(options.name);
  fingerprint.AddNumber(static_cast<uint64_t>(options.durability));
  fingerprint.AddNumber(backup.checksum);
  seed.fingerprint = fingerprint.value();
  return seed;
}

}  // namespace dynmesh
