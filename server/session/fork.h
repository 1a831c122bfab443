#ifndef DYNMESH_SERVER_SESSION_FORK_H_
#define DYNMESH_SERVER_SESSION_FORK_H_

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "server/session/durability/revision_note.h"
#include "server/session/registry.h"
#include "server/session/revisions.h"
#include "server/session/session.h"

namespace dynmesh {

/// What the fork of a session is to be; the fields are those of ForkSessionRequest.
struct ForkOptions {
  std::string name = {};
  std::string request_id = {};
  int64_t revision = kLastRevision;                            ///< of the source
  std::string snapshot = {};                                   ///< or this one of it
  SessionDurability durability = SessionDurability::kDefault;  ///< kDefault: that of the source
  RevisionNote note = {};
};

/// Makes a session that begins with what `source` was at a revision; the settings are those of `source`.
/// Errors: those of MeshAt and of SessionRegistry::CreateFrom. REQUIRES: `source` is loaded. Cost: that of
/// both.
absl::StatusOr<SessionInfo> Fork(SessionRegistry& registry, Session& source, const ForkOptions& options);

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_FORK_H_
