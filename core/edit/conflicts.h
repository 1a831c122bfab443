#ifndef DYNMESH_CORE_EDIT_CONFLICTS_H_
#define DYNMESH_CORE_EDIT_CONFLICTS_H_

#include <cstdint>

#include "absl/status/status.h"
#include "core/edit/transaction.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

/// Whether the edits of an open batch touch what somebody else changed after a revision
/// (ConflictPolicy::kTouched). Read off the stamps that the batch's journal found: nobody is asked to lock or
/// to announce anything.
///
/// Errors: ABORTED CONFLICT with metadata kind, ids (the first 100 or so of that kind) and changed_revision,
/// the latest revision that changed one of them. With ConflictPolicy::kNone there is never one. REQUIRES: the
/// batch is open and no slot was given out twice in it; `mesh` outlives this.
class ConflictCheck {
 public:
  ConflictCheck(const Mesh& mesh, ConflictPolicy policy, int64_t as_of_revision)
      : mesh_(mesh), policy_(policy), as_of_(as_of_revision) {}

  /// Of what the batch did since `savepoint`. Cost: one pass over its journal since.
  absl::Status CheckSince(Mesh::Savepoint savepoint) const;

  /// The conflict, if one is why an edit was refused: an entity that it named is gone or is another one, is
  /// no element any more, or has new users. Else `refused` itself, as when the batch has removed it. Derived
  /// edges and faces leave no trace of when they ended, so one that is gone counts as a conflict.
  absl::Status Explain(const absl::Status& refused) const;

 private:
  /// Whether there is anybody else's change that could be touched.
  bool MayConflict() const { return policy_ == ConflictPolicy::kTouched && as_of_ < mesh_.revision(); }

  const Mesh& mesh_;
  const ConflictPolicy policy_;
  const int64_t as_of_;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_EDIT_CONFLICTS_H_
