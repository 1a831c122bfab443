#ifndef DYNMESH_CORE_EDIT_TRANSACTION_H_
#define DYNMESH_CORE_EDIT_TRANSACTION_H_

#include <cstdint>
#include <limits>
#include <string>
#include <variant>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

/// In a batch, vertex id kNewVertex | k means the k-th vertex that the batch has added so far.
inline constexpr Slot kNewVertex = 0x80000000u;

/// The edits of a batch, as values. Slots are what the caller read; positions are xyz.
struct AddVerticesEdit {
  std::vector<Point> positions;
};
struct RemoveVerticesEdit {
  std::vector<Slot> vertices;
};
struct MoveVerticesEdit {
  std::vector<Slot> vertices;
  std::vector<Point> positions;
};
struct AddElementsEdit {
  ElementType type = ElementType::kUnspecified;
  std::vector<Slot> vertices;  ///< NumVertices(type) for each element
};
struct RemoveElementsEdit {
  EntityKind kind = EntityKind::kCell;
  std::vector<Slot> elements;
};
struct AddAttributeEdit {
  AttributeSpec spec;
};
struct SetAttributeEdit {
  AttributeSpec spec;  ///< must equal the column's
  std::vector<Slot> slots;
  std::vector<uint8_t> rows;
};

using Edit = std::variant<AddVerticesEdit, RemoveVerticesEdit, MoveVerticesEdit, AddElementsEdit,
                          RemoveElementsEdit, AddAttributeEdit, SetAttributeEdit>;

/// How many vertices, elements or rows an edit names.
uint64_t NumItems(const Edit& edit);

/// What one edit did.
struct EditResult {
  std::vector<Slot> new_slots;  ///< of the vertices or elements that it added, in order
};

/// What a batch did or, for a dry run, would have done.
struct BatchResult {
  int64_t revision = 0;  ///< after the batch; of the dry run: before
  std::vector<EditResult> results;
  Checksum checksum;
  std::array<uint32_t, kNumEntityKinds> counts = {};
  std::vector<EntityId> degenerate;  ///< elements added that name a vertex twice
  std::vector<EntityId> duplicate;   ///< elements added that equal one that was there
};

struct BatchOptions {
  /// Ids must name occupants born at or before this revision; later ones: NOT_FOUND ENTITY_REMOVED.
  int64_t as_of_revision = std::numeric_limits<int64_t>::max();
  /// Roll back after success: the result is what would have been.
  bool dry_run = false;
};

/// Applies `edits` in order to `mesh`, all or nothing, as one revision.
///
/// An edit may use what an earlier one of the batch made: vertices as kNewVertex | k. An id of an occupant
/// that the batch itself removed is refused; ids that it made cannot be named otherwise, because no slot
/// freed in a batch is reused in it and as_of_revision lies before it. A face or edge that was an element, then derived,
/// and is an element again counts as another one.
///
/// Errors: those of Mesh's edits, with metadata "edit" (index in `edits`) and "index" (item of that edit).
/// After an error or a dry run the mesh is as it was, to the last id and stamp.
/// REQUIRES: no batch is open on `mesh`. Cost: linear in the entities touched.
absl::StatusOr<BatchResult> ApplyBatch(Mesh& mesh, absl::Span<const Edit> edits, const BatchOptions& options);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_EDIT_TRANSACTION_H_
