#ifndef DYNMESH_CORE_CHECK_SUMMARY_H_
#define DYNMESH_CORE_CHECK_SUMMARY_H_

#include <cstdint>

#include "absl/status/statusor.h"
#include "core/check/check.h"
#include "core/check/surface_pieces.h"
#include "core/mesh/mesh.h"
#include "core/mesh/work_meter.h"

namespace dynmesh {

/// What a mesh is as a whole.
struct MeshTopology {
  int64_t euler_characteristic = 0;  ///< vertices - edges + faces - cells
  uint64_t components = 0;           ///< parts that no edge connects; isolated vertices are none
  uint64_t isolated_vertices = 0;
  uint64_t bodies = 0;                 ///< of cells that hang together through faces of just two
  uint64_t non_orientable_bodies = 0;  ///< whose cells cannot be turned so that all agree
  SurfaceSummary surface;              ///< of the faces that IsSurfaceFace() names
  SurfaceSummary shells;               ///< of the faces of just one cell
};

/// Errors: those of `meter`. Cost: linear in the mesh, nearly; up to 30 bytes an entity meanwhile.
absl::StatusOr<MeshTopology> SummarizeTopology(const Mesh& mesh, WorkMeter& meter);

/// The number that a check of the whole mesh compares. REQUIRES: !IsLocal(check).
double ValueOf(CheckKind check, const MeshTopology& topology);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_CHECK_SUMMARY_H_
