#ifndef DYNMESH_SERVER_SESSION_SELECTION_H_
#define DYNMESH_SERVER_SESSION_SELECTION_H_

#include <cstdint>
#include <variant>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/types/optional.h"
#include "core/mesh/box.h"
#include "core/mesh/error.h"
#include "core/mesh/mesh.h"
#include "core/mesh/work_meter.h"
#include "server/session/shared_spatial_index.h"

namespace dynmesh {

/// Which entities of one kind a query speaks of: those that `which` names and no filter holds back.
struct Selection {
  struct All {};
  struct Range {
    Slot begin = 0;
    Slot end = 0;  ///< exclusive
  };
  std::variant<All, Range, std::vector<Slot>> which;
  int64_t as_of_revision = 0;  ///< for lists: the revision at which the ids were read; 0: the current one
  bool boundary_only = false;  ///< not for cells, which are never on the boundary
  absl::optional<Box> box = absl::nullopt;  ///< the entity's bounding box meets this
};

/// Where to look for what is selected.
struct SelectionScope {
  const Mesh& mesh;
  SharedSpatialIndex& spatial;
  WorkMeter& meter;
};

/// Calls fn for each selected slot, in the order of the selection, until it fails. What filters hold back is
/// charged here, the rest is left to fn. Everything in a box is found by the index.
/// Errors: fn's; before any call NOT_FOUND ENTITY_REMOVED or UNKNOWN_ENTITY (metadata ids: the first that are
/// not live), OUT_OF_RANGE REVISION_IN_FUTURE, INVALID_ARGUMENT BAD_ARGUMENT, BAD_ENTITY_KIND; those of
/// SharedSpatialIndex::Read.
absl::Status ForEachSelected(const SelectionScope& scope, EntityKind kind, const Selection& selection,
                             absl::FunctionRef<absl::Status(Slot)> fn);

/// INVALID_ARGUMENT BAD_ENTITY_KIND for cells.
absl::Status CheckHasBoundary(EntityKind kind);

/// Arrays of one message hold at most about this much.
inline constexpr size_t kChunkBytes = size_t{1} << 20;

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_SELECTION_H_
