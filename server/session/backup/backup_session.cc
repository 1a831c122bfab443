#include "server/session/backup/backup_session.h"

#include <utility>

#include "absl/types/optional.h"
#include "core/mesh/error.h"
#include "server/session/fingerprint.h"
#include "server/session/session_errors.h"

namespace dynmesh {
namespace {

const std::string& NameOf(const BackupIdentity& identity, const BackupRestoreOptions& options) {
  return options.name.empty() ? identity.name : options.name;
}

SessionDurability DurabilityOf(const BackupIdentity& identity, const BackupRestoreOptions& options) {
  const bool is_named = options.durability != SessionDurability::kDefault;
  return is_named ? options.durability : identity.settings.durability;
}

}  // namespace

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

absl::Status CheckRestore(const SessionRegistry& registry, const BackupIdentity& identity,
                          const BackupRestoreOptions& options) {
  if (!registry.keeps_sessions() && DurabilityOf(identity, options) != SessionDurability::kNone) {
    return NoStore();
  }
  const bool may_be_retry = !options.request_id.empty() && !options.validate_only;
  return may_be_retry ? absl::OkStatus() : registry.CheckCreation(NameOf(identity, options));
}

SessionSeed SeedOf(Backup backup, const BackupRestoreOptions& options) {
  SessionSeed seed{.name = NameOf(backup.identity, options),
                   .settings = backup.identity.settings,
                   .mesh = std::move(backup.mesh),
                   .commit_time = backup.identity.commit_time,
                   .request_id = options.request_id,
                   .validate_only = options.validate_only};
  seed.settings.durability = DurabilityOf(backup.identity, options);
  Fingerprint fingerprint;
  fingerprint.AddString(options.name);
  fingerprint.AddNumber(static_cast<uint64_t>(options.durability));
  fingerprint.AddNumber(backup.checksum);
  seed.fingerprint = fingerprint.value();
  return seed;
}

}  // namespace dynmesh
