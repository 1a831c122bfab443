#include "server/session/fork.h"

#include <utility>

#include "core/mesh/error.h"
#include "server/session/fingerprint.h"

namespace dynmesh {
namespace {

uint64_t FingerprintOf(const Session& source, const ForkOptions& options) {
  Fingerprint fingerprint;
  fingerprint.AddString("fork");
  fingerprint.AddString(source.name());
  fingerprint.AddString(options.name);
  fingerprint.AddNumber(options.revision);
  fingerprint.AddString(options.snapshot);
  fingerprint.AddNumber(static_cast<uint64_t>(options.durability));
  return fingerprint.value();
}

}  // namespace

absl::StatusOr<SessionInfo> Fork(SessionRegistry& registry, Session& source, const ForkOptions& options) {
  DYNMESH_RETURN_IF_ERROR(CheckSessionName(options.name));
  DYNMESH_RETURN_IF_ERROR(CheckRequestId(options.request_id));
  DYNMESH_RETURN_IF_ERROR(CheckNote(options.note));
  const uint64_t fingerprint = FingerprintOf(source, options);
  DYNMESH_ASSIGN_OR_RETURN(const auto created,
                           registry.FindCreated(options.name, options.request_id, fingerprint));
  if (created != nullptr) return *created;
  DYNMESH_RETURN_IF_ERROR(registry.CheckCreation(options.name));  // before the work
  int64_t revision = options.revision;
  if (!options.snapshot.empty()) {
    DYNMESH_ASSIGN_OR_RETURN(revision, FindSnapshotRevision(source, options.snapshot));
  }
  SessionSeed seed;
  seed.name = options.name;
  seed.settings = source.Settings();
  if (options.durability != SessionDurability::kDefault) seed.settings.durability = options.durability;
  DYNMESH_ASSIGN_OR_RETURN(RecoveredRevision then, MeshAt(source, revision));
  seed.mesh = std::move(then.mesh);
  seed.commit_time = then.commit_time;
  seed.note = options.note;
  seed.request_id = options.request_id;
  seed.fingerprint = fingerprint;
  return registry.CreateFrom(std::move(seed));
}

}  // namespace dynmesh
