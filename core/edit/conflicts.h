#ifndef DYNMESH_CORE_EDIT_CONFLICTS_H_
#define DYNMESH_CORE_EDIT_CONFLICTS_H_

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "absl/container/flat_hash_map.h"
#include "absl/status/status.h"
#include "core/edit/transaction.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

class Conflict;

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
  /// Cost: once the journal since the last call, to be asked for each refusal before the batch goes on.
  absl::Status Explain(const absl::Status& refused);

 private:
  /// Finds in a journal the step that made or ended an entity. Reads each entry once.
  class Steps {
   public:
    explicit Steps(const Mesh& mesh) : mesh_(mesh) {}
    /// Entries have been taken back, perhaps.
    void Shorten() { read_ = std::min(read_, mesh_.journal().entries.size()); }
    /// The first one, or null. `op` is kCreate or kDestroy.
    const JournalEntry* Find(JournalOp op, EntityId id);

   private:
    static uint64_t KeyOf(JournalOp op, EntityId id) {
      return static_cast<uint64_t>(op) << 40 | static_cast<uint64_t>(id.kind) << 32 | id.slot;
    }

    bool IsAt(size_t place, uint64_t key) const;

    const Mesh& mesh_;
    absl::flat_hash_map<uint64_t, size_t> places_;
    size_t read_ = 0;
  };

  void NoteEnd(EntityId id, Conflict& conflict);

  /// Whether there is anybody else's change that could be touched.
  bool MayConflict() const { return policy_ == ConflictPolicy::kTouched && as_of_ < mesh_.revision(); }

  const Mesh& mesh_;
  const ConflictPolicy policy_;
  const int64_t as_of_;
  Steps steps_{mesh_};
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_EDIT_CONFLICTS_H_
