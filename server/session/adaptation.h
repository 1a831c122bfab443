#ifndef DYNMESH_SERVER_SESSION_ADAPTATION_H_
#define DYNMESH_SERVER_SESSION_ADAPTATION_H_

#include <memory>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/adapt/adapter.h"
#include "server/session/budget.h"
#include "server/session/session.h"

namespace dynmesh {

/// An adaptation of a session's mesh under way: each step is at most one revision, which followers see as any
/// other, and between two of them others have the session.
///
/// What was committed stays, whenever this ends. Steps, and Start(), are heavy work for which the caller has
/// its turn at the session. Thread safety: that of std::vector.
class Adaptation {
 public:
  /// Reads the session. Errors: those of Adapter::Start; RESOURCE_EXHAUSTED LIMIT_EXCEEDED
  /// (max_concurrent_adaptations); NOT_FOUND SESSION_DELETED.
  static absl::StatusOr<std::unique_ptr<Adaptation>> Start(SessionPtr session, std::shared_ptr<Budget> places,
                                                           const AdaptOptions& options,
                                                           RevisionNote note = {});

  Session& session() { return *session_; }
  bool done() const { return adapter_->done(); }

  /// Writes the session. REQUIRES: !done(). Errors: those of Adapter::Step; RESOURCE_EXHAUSTED LIMIT_EXCEEDED
  /// changed nothing then, and there is no other.
  absl::Status Step();

  AdaptProgress progress() const { return adapter_->progress(); }
  /// After the last step of this, or of others since.
  int64_t revision() const { return session_->revision(); }

  /// What came of it. Reads the session. Errors: NOT_FOUND SESSION_DELETED.
  absl::StatusOr<AdaptResult> Finish();

 private:
  Adaptation(SessionPtr session, Lease place, RevisionNote note)
      : session_(std::move(session)), place_(std::move(place)), note_(std::move(note)) {}

  const SessionPtr session_;
  Lease place_;              ///< of max_concurrent_adaptations
  const RevisionNote note_;  ///< of each revision that it makes
  std::unique_ptr<Adapter> adapter_;
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_ADAPTATION_H_
