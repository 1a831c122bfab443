#ifndef DYNMESH_CORE_MESH_RINGS_H_
#define DYNMESH_CORE_MESH_RINGS_H_

#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "absl/types/span.h"
#include "core/mesh/bit_set.h"
#include "core/mesh/mesh.h"
#include "core/mesh/work_meter.h"

namespace dynmesh {

/// The k-rings of entities: what can be reached in at most k steps from an entity to an adjacent one of its
/// kind (relations.h: vertices through an edge, edges through a vertex, faces through an edge, cells through
/// a face).
///
///     RingWalk walk(mesh, EntityKind::kVertex, WorkMeter::Unlimited());
///     walk.Walk(slot, 2, row);   // neighbours of `slot`, and their neighbours, without `slot`
///
/// Cost: linear in the incidences within the ring, however often these lead to the same entity: each edge,
/// vertex or face that connects entities is gone through once. Memory that a walker keeps: a bit for each
/// entity of two kinds. Thread safety: that of std::vector.
class RingWalk {
 public:
  RingWalk(const Mesh& mesh, EntityKind kind, WorkMeter& meter) : mesh_(mesh), kind_(kind), meter_(meter) {}

  /// Puts the ids of the ring into `row`, ascending. After an error this must not be used any more.
  /// REQUIRES: `start` is live, the mesh has not changed since this was made. Errors: the meter's.
  absl::Status Walk(Slot start, uint32_t rings, std::vector<Slot>& row);

 private:
  absl::Status Expand(Slot slot, std::vector<Slot>& row);
  absl::Status ExpandVertex(VertexId v, std::vector<Slot>& row);
  bool CrossFirst(Slot connector);
  template <typename Id>
  absl::Status Reach(absl::Span<const Id> ids, std::vector<Slot>& row);
  absl::Status Finish(Slot start, std::vector<Slot>& row);

  const Mesh& mesh_;
  const EntityKind kind_;
  WorkMeter& meter_;
  BitSet reached_;                ///< empty between walks, as are the others
  BitSet crossed_;                ///< edges, vertices or faces that were gone through
  std::vector<Slot> connectors_;  ///< the members of crossed_
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_MESH_RINGS_H_
