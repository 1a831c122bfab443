// Elements in place of others: what both use lives on.

#include "absl/container/inlined_vector.h"
#include "core/mesh/mesh.h"

namespace dynmesh {
namespace {

constexpr size_t kTypicalCells = 16;  ///< in place of those round an edge
constexpr size_t kTypicalFaces = 32;

}  // namespace

absl::Status Mesh::ReplaceElements(absl::Span<const EntityId> removed, absl::Span<const NewElement> added,
                                   absl::FunctionRef<void(size_t, EntityId)> replaced) {
  for (EntityId id : removed) DYNMESH_RETURN_IF_ERROR(CheckRemovable(id));
  for (const NewElement& element : added) {
    DYNMESH_RETURN_IF_ERROR(CheckVertices(element.type, element.vertices()));
  }
  absl::InlinedVector<FaceId, kTypicalFaces> faces;
  absl::InlinedVector<EdgeId, kMaxElementEdges> edges;
  for (EntityId id : removed) {
    if (id.kind == EntityKind::kCell) {
      for (OrientedFace oriented : Faces(CellId(id.slot))) faces.push_back(oriented.face());
      DestroyCell(CellId(id.slot));
    } else {
      ClearElementFlag(id);
      id.kind == EntityKind::kFace ? faces.push_back(FaceId(id.slot)) : edges.push_back(EdgeId(id.slot));
    }
  }
  absl::InlinedVector<CellId, kTypicalCells> cells;
  for (size_t i = 0; i < added.size(); ++i) {
    DYNMESH_ASSIGN_OR_RETURN(const EntityId id, AddChecked(added[i].type, added[i].vertices(), {}));
    if (id.kind == EntityKind::kCell) cells.push_back(CellId(id.slot));
    replaced(i, id);
  }
  for (CellId c : cells) SettleBoundary(c);
  ReleaseFaces(faces);
  ReleaseEdges(edges);
  return absl::OkStatus();
}

}  // namespace dynmesh
