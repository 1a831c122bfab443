#ifndef DYNMESH_CORE_CODEC_SURFACE_CODEC_H_
#define DYNMESH_CORE_CODEC_SURFACE_CODEC_H_

#include <array>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/mesh/checksum.h"
#include "core/mesh/ids.h"

namespace dynmesh {

/// Triangles of a surface over their own vertex table.
struct TriangleSurface {
  std::vector<VertexId> vertex_slots;             ///< the mesh vertex behind each surface vertex, ascending
  std::vector<Point> positions;                   ///< of vertex_slots
  std::vector<std::array<uint32_t, 3>> triangles; ///< indices into vertex_slots
};

/// `surface` as a plain .drc file that any Draco decoder opens: Edgebreaker triangle mesh, positions
/// quantised to `position_bits` (1-30; more than 24 count as 24, which is what float32 holds), and a GENERIC
/// uint32 attribute holding the vertex slot. Where a slot is 2^20 or more, that attribute has two components
/// instead of one: the low and the high 16 bits of the slot.
///
/// Degenerate triangles and vertices without a triangle are left out. Draco reorders, and splits
/// non-manifold vertices: match by slot.
/// Errors: INVALID_ARGUMENT for an index out of range or a coordinate beyond a quarter of float32's range,
/// FAILED_PRECONDITION for a surface without a triangle of three vertices, RESOURCE_EXHAUSTED when memory ran out, INTERNAL when Draco refuses.
absl::StatusOr<std::string> EncodeSurface(const TriangleSurface& surface, int position_bits);

/// The reverse, for tests and tools: of trusted bytes only, because nothing stands before Draco here. `positions` are what the quantised file holds.
absl::StatusOr<TriangleSurface> DecodeSurface(const std::string& bytes);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_CODEC_SURFACE_CODEC_H_
