#ifndef DYNMESH_SERVER_SESSION_SELECTION_H_
#define DYNMESH_SERVER_SESSION_SELECTION_H_

#include <cstdint>
#include <variant>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "core/mesh/error.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

/// Which entities of one kind a query speaks of.
struct Selection {
  struct All {};
  struct Range {
    Slot begin = 0;
    Slot end = 0;  ///< exclusive
  };
  std::variant<All, Range, std::vector<Slot>> which;
  int64_t as_of_revision = 0;  ///< for lists: the revision at which the ids were read; 0: the current one
};

/// Calls fn for each selected slot, in the order of the selection, until it fails.
/// Errors: fn's; before any call NOT_FOUND ENTITY_REMOVED or UNKNOWN_ENTITY (metadata ids: the first that are
/// not live), OUT_OF_RANGE REVISION_IN_FUTURE, INVALID_ARGUMENT BAD_ARGUMENT.
absl::Status ForEachSelected(const Mesh& mesh, EntityKind kind, const Selection& selection,
                             absl::FunctionRef<absl::Status(Slot)> fn);

/// Arrays of one message hold at most about this much.
inline constexpr size_t kChunkBytes = size_t{1} << 20;

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_SELECTION_H_
