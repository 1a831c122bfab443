#ifndef DYNMESH_SERVER_SESSION_CHECK_SESSION_H_
#define DYNMESH_SERVER_SESSION_CHECK_SESSION_H_

#include <cstdint>

#include "absl/functional/function_ref.h"
#include "absl/status/statusor.h"
#include "absl/types/optional.h"
#include "core/check/report.h"
#include "server/session/query_budget.h"
#include "server/session/selection.h"
#include "server/session/session.h"

/// Reports of checks on a session.
namespace dynmesh {

inline constexpr uint32_t kDefaultFindings = 1000;
inline constexpr uint32_t kMaxFindings = 1'000'000;

struct CheckQuestion {
  /// Which checks are made; absent: all, those that are on in the session with its settings, others as
  /// warnings with their defaults.
  absl::optional<CheckSettings> checks;
  size_t max_findings = kDefaultFindings;  ///< of each check and kind
  /// Some entities of a kind only: local checks, and no topology.
  struct Part {
    EntityKind kind;
    Selection selection;
  };
  absl::optional<Part> part;
};

/// Checks all of a copy of the session, so that nobody waits but while it is made: `copied` is called then.
/// Errors: whatever `terms.stop` says; RESOURCE_EXHAUSTED LIMIT_EXCEEDED (max_answer_bytes, max_check_work);
/// those of Session::Read. REQUIRES: no `part`.
absl::StatusOr<CheckReport> CheckWholeSession(const Session& session, const CheckQuestion& question,
                                              const QueryTerms& terms, ReportMonitor& monitor,
                                              absl::FunctionRef<void(int64_t revision)> copied);

/// Checks what `question.part` selects, under the reader lock. Errors: those of ForEachSelected and
/// QueryBudget. REQUIRES: a `part`.
absl::StatusOr<CheckReport> CheckPartOfSession(const Session& session, const CheckQuestion& question,
                                               const QueryTerms& terms);

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_CHECK_SESSION_H_
