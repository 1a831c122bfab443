#ifndef DYNMESH_CORE_EDIT_BATCH_NAMES_H_
#define DYNMESH_CORE_EDIT_BATCH_NAMES_H_

#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/edit/edits.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

/// What the ids in the edits of one batch mean: entities that were there at a revision, and vertices that the
/// batch itself has added so far (kNewVertex | k).
///
/// Errors of all: NOT_FOUND ENTITY_REMOVED or UNKNOWN_ENTITY; INVALID_ARGUMENT UNKNOWN_ENTITY for a new
/// vertex that no edit has added yet; with metadata kind and ids.
class BatchNames {
 public:
  /// Knows occupants born at or before `as_of_revision`. REQUIRES: `mesh` outlives this.
  BatchNames(const Mesh& mesh, int64_t as_of_revision) : mesh_(mesh), as_of_(as_of_revision) {}

  /// Says what the next new vertex is; invalid: an item that was refused would have made it.
  void AddNewVertex(VertexId v) { new_vertices_.push_back(v); }

  /// The vertex that a caller's id names. A new one may be gone again.
  absl::StatusOr<VertexId> Vertex(Slot slot) const;
  /// The same for a vertex that must still be there.
  absl::StatusOr<VertexId> LiveVertex(Slot slot) const;
  absl::StatusOr<FaceId> Face(Slot slot) const;
  absl::StatusOr<EntityId> Entity(EntityKind kind, Slot slot) const;
  absl::StatusOr<EdgeId> Edge(const EdgeNames& edges, size_t i) const;
  /// The end that was named first; invalid where edges are named by their ids. REQUIRES: Edge(edges, i) is
  /// OK.
  VertexId OriginOf(const EdgeNames& edges, size_t i) const;

  /// Whether `id` is no element that is younger: a face may have lived on as a derived one in between.
  absl::Status CheckElement(EntityId id) const;

 private:
  absl::StatusOr<VertexId> NewVertex(Slot slot) const;

  const Mesh& mesh_;
  const int64_t as_of_;
  std::vector<VertexId> new_vertices_;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_EDIT_BATCH_NAMES_H_
