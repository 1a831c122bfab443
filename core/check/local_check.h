#ifndef DYNMESH_CORE_CHECK_LOCAL_CHECK_H_
#define DYNMESH_CORE_CHECK_LOCAL_CHECK_H_

#include "absl/status/statusor.h"
#include "absl/types/optional.h"
#include "core/check/check.h"
#include "core/mesh/mesh.h"
#include "core/mesh/work_meter.h"

namespace dynmesh {

/// What a check measures at an entity; nullopt where it says nothing: of derived entities where only elements
/// count, of edges without surface faces, and so on. Duplicates count as elements, but not as neighbours.
///
/// Errors: those of `meter`. REQUIRES: IsLocal(check), `id` is live. Cost: constant for shapes, else linear
/// in the incidences at `id`; sorting them for links.
absl::StatusOr<absl::optional<double>> MeasureEntity(const Mesh& mesh, CheckKind check, EntityId id,
                                                     WorkMeter& meter);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_CHECK_LOCAL_CHECK_H_
