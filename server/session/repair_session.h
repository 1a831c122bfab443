#ifndef DYNMESH_SERVER_SESSION_REPAIR_SESSION_H_
#define DYNMESH_SERVER_SESSION_REPAIR_SESSION_H_

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/statusor.h"
#include "absl/types/optional.h"
#include "core/repair/repair.h"
#include "server/session/session.h"
#include "server/session/stop_signal.h"

namespace dynmesh {

/// A repair that somebody asks for; the fields are those of RepairSessionRequest.
struct RepairRequest {
  std::vector<RepairStep> steps;
  absl::optional<int64_t> if_revision = absl::nullopt;
  std::string request_id = {};  ///< empty: none; ignored when validate_only
  bool validate_only = false;
  RevisionNote note = {};
};
inline constexpr size_t kMaxRepairSteps = 20;

/// What a repair did or, for a dry run, would have done; and what a retry of it is told again.
struct RepairOutcome {
  int64_t revision = 0;  ///< after the repair; of a dry run, or where nothing changed: before
  std::vector<RepairReport> reports;
  Checksum checksum;
  std::array<uint32_t, kNumEntityKinds> counts = {};
};

/// Repairs a session as one revision, all or nothing; where nothing changes, without one. Calls done(n) after
/// n steps, n = 0 included, from this thread and under the session's lock: it must not block. Errors:
/// INVALID_ARGUMENT BAD_ARGUMENT (metadata field, step), REQUEST_ID_REUSED; ABORTED REVISION_MISMATCH;
/// RESOURCE_EXHAUSTED (max_session_bytes, max_repair_work, memory); those of `stop`. Nothing changed then.
/// REQUIRES: it is the caller's turn to write the session.
absl::StatusOr<std::shared_ptr<const RepairOutcome>> RepairSession(Session& session,
                                                                   const RepairRequest& request,
                                                                   const StopSignal& stop,
                                                                   absl::FunctionRef<void(size_t)> done);

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_REPAIR_SESSION_H_
