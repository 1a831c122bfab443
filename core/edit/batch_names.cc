#include "core/edit/batch_names.h"

#include "absl/strings/str_cat.h"

namespace dynmesh {

absl::StatusOr<VertexId> BatchNames::Vertex(Slot slot) const {
  if (slot & kNewVertex) return NewVertex(slot);
  DYNMESH_RETURN_IF_ERROR(mesh_.CheckLive(VertexId(slot), as_of_));
  return VertexId(slot);
}

absl::StatusOr<VertexId> BatchNames::NewVertex(Slot slot) const {
  const Slot k = slot & ~kNewVertex;
  if (k >= new_vertices_.size()) {
    return InvalidArgument(reason::kUnknownEntity,
                           absl::StrCat("the batch has added ", new_vertices_.size(),
                                        " vertices so far, there is no new vertex ", k),
                           {{"kind", "vertex"}, {"ids", absl::StrCat(slot)}});
  }
  if (new_vertices_[k].valid()) return new_vertices_[k];
  return MakeError(absl::StatusCode::kNotFound, reason::kUnknownEntity,
                   absl::StrCat("new vertex ", k, " was not made: its item was refused"),
                   {{"kind", "vertex"}, {"ids", absl::StrCat(slot)}});
}

absl::StatusOr<VertexId> BatchNames::LiveVertex(Slot slot) const {
  DYNMESH_ASSIGN_OR_RETURN(const VertexId v, Vertex(slot));
  DYNMESH_RETURN_IF_ERROR(mesh_.CheckLive(v));
  return v;
}

absl::StatusOr<FaceId> BatchNames::Face(Slot slot) const {
  DYNMESH_RETURN_IF_ERROR(mesh_.CheckLive(FaceId(slot), as_of_));
  return FaceId(slot);
}

absl::StatusOr<EntityId> BatchNames::Entity(EntityKind kind, Slot slot) const {
  if (kind == EntityKind::kVertex) {
    DYNMESH_ASSIGN_OR_RETURN(const VertexId v, Vertex(slot));
    return EntityId(v);
  }
  DYNMESH_RETURN_IF_ERROR(mesh_.CheckLive({kind, slot}, as_of_));
  return EntityId(kind, slot);
}

absl::StatusOr<EdgeId> BatchNames::Edge(const EdgeNames& edges, size_t i) const {
  if (!edges.ids.empty()) {
    DYNMESH_RETURN_IF_ERROR(mesh_.CheckLive(EdgeId(edges.ids[i]), as_of_));
    return EdgeId(edges.ids[i]);
  }
  DYNMESH_ASSIGN_OR_RETURN(const VertexId a, Vertex(edges.ends[2 * i]));
  DYNMESH_ASSIGN_OR_RETURN(const VertexId b, Vertex(edges.ends[2 * i + 1]));
  const EdgeId e = mesh_.FindEdge(a, b);
  if (e.valid()) return e;
  return MakeError(absl::StatusCode::kNotFound, reason::kUnknownEntity,
                   absl::StrCat("no edge joins vertices ", a.slot(), " and ", b.slot()),
                   {{"kind", "vertex"}, {"ids", JoinSlots({a.slot(), b.slot()})}});
}

VertexId BatchNames::OriginOf(const EdgeNames& edges, size_t i) const {
  return edges.ends.empty() ? VertexId() : *Vertex(edges.ends[2 * i]);
}

absl::Status BatchNames::CheckElement(EntityId id) const {
  if (id.kind == EntityKind::kVertex) return absl::OkStatus();  // RemoveElement refuses it
  DYNMESH_RETURN_IF_ERROR(mesh_.CheckLive(id, as_of_));
  const bool same = !mesh_.IsElement(id) || mesh_.changed(id.kind).At(id.slot) <= as_of_;
  return same ? absl::OkStatus() : EntityNotFound(reason::kEntityRemoved, id);
}

}  // namespace dynmesh
