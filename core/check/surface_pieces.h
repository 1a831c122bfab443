#ifndef DYNMESH_CORE_CHECK_SURFACE_PIECES_H_
#define DYNMESH_CORE_CHECK_SURFACE_PIECES_H_

#include <cstdint>

#include "absl/functional/function_ref.h"
#include "absl/status/statusor.h"
#include "core/mesh/mesh.h"
#include "core/mesh/work_meter.h"

namespace dynmesh {

/// What some faces of a mesh are as surfaces. A piece is what hangs together across edges of just two faces;
/// where more meet, and at vertices where only points touch, the surface is cut.
struct SurfaceSummary {
  uint64_t pieces = 0;
  uint64_t non_manifold = 0;  ///< pieces with an edge at which more than two faces meet
  uint64_t non_orientable = 0;
  uint64_t holes = 0;                ///< loops of edges with one face
  uint64_t genus = 0;                ///< handles of all pieces that can be oriented
  int64_t euler_characteristic = 0;  ///< of all pieces: vertices - edges + faces, after cutting
};

/// Looks at the faces that `is_member` picks. Errors: those of `meter`. REQUIRES: no member is degenerate.
/// Cost: linear in the faces and edges of the mesh, nearly; 4 bytes for each slot of a face and 24 for each
/// member meanwhile, and more for members at a rim.
absl::StatusOr<SurfaceSummary> SummarizeSurface(const Mesh& mesh, absl::FunctionRef<bool(FaceId)> is_member,
                                                WorkMeter& meter);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_CHECK_SURFACE_PIECES_H_
