#ifndef DYNMESH_CORE_EDIT_TRIANGLE_FAN_H_
#define DYNMESH_CORE_EDIT_TRIANGLE_FAN_H_

#include "absl/container/inlined_vector.h"
#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

/// The triangles round a vertex v, in the order in which they follow each other: faces[i] turns as v,
/// ring[i], ring[i + 1] do. Open at the boundary of a surface: then the ring has one vertex more than there
/// are faces.
struct TriangleFan {
  absl::InlinedVector<VertexId, 8> ring;
  absl::InlinedVector<FaceId, 8> faces;

  bool closed() const { return ring.size() == faces.size(); }
};

/// The fan that `faces` are. Errors: FAILED_PRECONDITION NOT_SIMPLEX, NON_MANIFOLD_EDGE,
/// INCONSISTENT_ORIENTATION, NON_MANIFOLD_VERTEX. REQUIRES: `faces` are all the face elements at `v`, none of
/// them degenerate, and not empty. Cost: O(n log n).
absl::StatusOr<TriangleFan> FanRound(const Mesh& mesh, VertexId v, absl::Span<const FaceId> faces);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_EDIT_TRIANGLE_FAN_H_
