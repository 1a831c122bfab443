#ifndef DYNMESH_CORE_CHECK_INCIDENCE_H_
#define DYNMESH_CORE_CHECK_INCIDENCE_H_

#include <cstdint>

#include "absl/status/statusor.h"
#include "core/mesh/mesh.h"
#include "core/mesh/work_meter.h"

/// What lies round one entity. Errors of all: those of `meter`, which is charged the entries of the lists
/// that are gone through. REQUIRES for all: live ids.
namespace dynmesh {

/// Whether a face is part of a surface: an element, neither degenerate nor a duplicate.
inline bool IsSurfaceFace(const Mesh& mesh, FaceId f) {
  return mesh.IsElement(f) && !mesh.IsDuplicate(f) && !mesh.IsDegenerate(f);
}

/// Whether face `f` runs along its k-th edge from the first vertex that the edge has stored to the second.
bool RunsForward(const Mesh& mesh, FaceId f, int k);

absl::StatusOr<uint64_t> CountSurfaceFaces(const Mesh& mesh, EdgeId e, WorkMeter& meter);

/// Groups that cells at an edge fall into, when those are joined that share a face there. 0 without cells.
absl::StatusOr<uint64_t> CountCellFans(const Mesh& mesh, EdgeId e, WorkMeter& meter);

/// The same at a vertex; and of its surface faces, when those are joined that share an edge there.
struct VertexFans {
  uint64_t cells = 0;
  uint64_t faces = 0;
};
absl::StatusOr<VertexFans> CountFans(const Mesh& mesh, VertexId v, WorkMeter& meter);

/// How two neighbours are turned. kNone: there are not just two, or the two are one.
enum class Agreement { kNone, kAgree, kDisagree };

/// Of the two surface faces at an edge: they agree when they run along it in opposite directions.
absl::StatusOr<Agreement> AgreementAt(const Mesh& mesh, EdgeId e, WorkMeter& meter);
/// Of the two cells at a face: they agree when it looks outwards from one and inwards from the other.
Agreement AgreementAt(const Mesh& mesh, FaceId f);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_CHECK_INCIDENCE_H_
