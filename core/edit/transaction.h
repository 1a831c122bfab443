#ifndef DYNMESH_CORE_EDIT_TRANSACTION_H_
#define DYNMESH_CORE_EDIT_TRANSACTION_H_

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/types/optional.h"
#include "absl/types/span.h"
#include "core/edit/batch_checker.h"
#include "core/edit/batch_keeper.h"
#include "core/edit/edits.h"
#include "core/mesh/batch_image.h"
#include "core/mesh/mesh.h"
#include "core/mesh/work_meter.h"

namespace dynmesh {

/// An element that an operator made, and the one whose place it takes.
struct Lineage {
  EntityId element;
  EntityId parent;
};

/// Why an item was skipped.
struct Refusal {
  uint32_t index;
  absl::Status status;
};

/// So many refusals of a batch are told in full.
inline constexpr size_t kMaxRefusals = 100;

/// What one edit did.
struct EditResult {
  /// Of the vertices or elements that it added, in order; of an operator: the vertices. A split has one for
  /// each item, kNoSlot where that was skipped.
  std::vector<Slot> new_slots;
  std::vector<Lineage> lineage;   ///< of operators, with BatchOptions::max_lineage
  std::vector<uint32_t> skipped;  ///< items that were refused, with BatchOptions::skip_refused
  std::vector<Refusal> refusals;  ///< of the first kMaxRefusals of the batch
  uint32_t num_moved = 0;         ///< of the vertices that were to be smoothed
};

/// What a batch did or, for a dry run, would have done.
struct BatchResult {
  int64_t revision = 0;  ///< after the batch; of the dry run: before
  std::vector<EditResult> results;
  Checksum checksum;
  std::array<uint32_t, kNumEntityKinds> counts = {};
  uint64_t num_made = 0;               ///< elements, by operators
  std::vector<EntityId> degenerate;    ///< elements added that name a vertex twice
  std::vector<EntityId> duplicate;     ///< elements added that equal one that was there
  std::vector<BatchWarning> warnings;  ///< of BatchOptions::checker
  absl::optional<BatchImage> image;    ///< with BatchOptions::make_image
};

/// What a batch does about changes that somebody else made after as_of_revision.
enum class ConflictPolicy {
  kNone,  ///< nothing, as long as the ids still mean the same entities
  /// Refuses to touch what they changed, with ABORTED CONFLICT (metadata kind, ids, changed_revision): to
  /// remove it, move it, set its attributes or (of one that others set since) remove these with it, or to add
  /// elements at vertices that were moved. Ids that are stale, or no elements any more, and vertices that
  /// others use by now, are conflicts too. With skip_refused an operator's item is passed over for any of
  /// these.
  kTouched,
};

struct BatchOptions {
  /// Ids must name occupants born at or before this revision; later ones: NOT_FOUND ENTITY_REMOVED.
  int64_t as_of_revision = std::numeric_limits<int64_t>::max();
  ConflictPolicy conflict_policy = ConflictPolicy::kNone;
  /// Roll back after success: the result is what would have been.
  bool dry_run = false;
  /// Items of operators that are refused are reported and passed over. Other edits stay all or nothing.
  bool skip_refused = false;
  /// Tell which elements the operators made of which, as long as these are no more than so many; a batch that
  /// makes more is refused with RESOURCE_EXHAUSTED. 0: do not tell.
  size_t max_lineage = 0;
  /// Elements that operators may make, and entities that they may look at, before the batch is refused with
  /// RESOURCE_EXHAUSTED: one item may touch as many elements as the mesh has.
  uint64_t max_made = std::numeric_limits<uint64_t>::max();
  uint64_t max_work = std::numeric_limits<uint64_t>::max();
  /// The same for bytes of attributes: of rows that are set, and of those that operators make.
  uint64_t max_attribute_bytes = std::numeric_limits<uint64_t>::max();
  /// Looks at the mesh after the last edit, and may refuse the batch or add warnings. It may look at max_work
  /// entities, too. Null: nobody looks.
  BatchChecker* checker = nullptr;
  /// Whom the checker asks before it goes on, so that it ends when nobody wants the batch any more.
  WorkMeter& meter = WorkMeter::Unlimited();
  /// Tell what undoes the batch (RestoreBatches).
  bool make_image = false;
  /// Keeps what the batch did before it is committed. Null: nobody does.
  BatchKeeper* keeper = nullptr;
};

/// Applies `edits` in order to `mesh`, all or nothing, as one revision.
///
/// An edit may use what an earlier one of the batch made: vertices as kNewVertex | k. An id of an occupant
/// that the batch itself removed is refused; ids that it made cannot be named otherwise, because no slot
/// freed in a batch is reused in it and as_of_revision lies before it. A face or edge that was an element,
/// then derived, and is an element again counts as another one.
///
/// Errors: those of Mesh's edits, with metadata "edit" (index in `edits`) and "index" (item of that edit);
/// those of the checker and of the keeper.
/// After an error or a dry run the mesh is as it was, to the last id and stamp.
/// REQUIRES: no batch is open on `mesh`. Cost: linear in the entities touched.
absl::StatusOr<BatchResult> ApplyBatch(Mesh& mesh, absl::Span<const Edit> edits, const BatchOptions& options);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_EDIT_TRANSACTION_H_
