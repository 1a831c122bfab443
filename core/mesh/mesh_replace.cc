// Elements in place of others: what both use lives on.

#include <bit>

#include "absl/container/inlined_vector.h"
#include "core/mesh/cell_parts.h"
#include "core/mesh/mesh.h"
#include "core/mesh/nearby.h"

namespace dynmesh {
namespace {

constexpr size_t kTypicalCells = 32;  ///< in place of those round an edge or a vertex
constexpr size_t kTypicalFaces = 64;

/// Edges, faces and cells of elements, as if they shared none.
std::array<uint32_t, kNumEntityKinds> PartsOf(absl::Span<const NewElement> elements) {
  std::array<uint32_t, kNumEntityKinds> parts = {};
  for (const NewElement& element : elements) {
    const ElementTemplate& shape = TemplateOf(element.type);
    parts[1] += shape.num_edges;
    parts[2] += shape.num_faces;
    parts[3] += shape.kind == EntityKind::kCell;
  }
  return parts;
}

}  // namespace

absl::Status Mesh::ReplaceElements(absl::Span<const EntityId> removed, absl::Span<const NewElement> added,
                                   absl::FunctionRef<void(size_t, EntityId)> replaced) {
  for (EntityId id : removed) {
    if (!IsLive(id) || !IsElement(id)) return CheckRemovable(id);
  }
  for (const NewElement& element : added) {
    DYNMESH_RETURN_IF_ERROR(CheckVertices(element.type, element.vertices()));
  }
  const bool roomy = CheckRoom(PartsOf(added)).ok();
  Nearby nearby(*this);
  absl::InlinedVector<FaceId, kTypicalFaces> faces;
  absl::InlinedVector<EdgeId, kMaxElementEdges> edges;
  for (EntityId id : removed) {
    if (id.kind == EntityKind::kCell) {
      for (OrientedFace oriented : Faces(CellId(id.slot))) {
        if (nearby.Gather(oriented.face())) faces.push_back(oriented.face());
      }
      DestroyCell(CellId(id.slot));
    } else if (id.kind == EntityKind::kFace) {
      nearby.Gather(FaceId(id.slot));
      nearby.GatherEdges(FaceId(id.slot));
      faces.push_back(FaceId(id.slot));
      ClearElementFlag(id);
    } else {
      edges.push_back(EdgeId(id.slot));
      ClearElementFlag(id);
    }
  }
  absl::InlinedVector<CellId, kTypicalCells> cells;
  for (size_t i = 0; i < added.size(); ++i) {
    if (!roomy) DYNMESH_RETURN_IF_ERROR(CheckRoom(added[i].type));
    DYNMESH_ASSIGN_OR_RETURN(const EntityId id, AddNear(added[i], nearby));
    if (id.kind == EntityKind::kCell) cells.push_back(CellId(id.slot));
    replaced(i, id);
  }
  for (CellId c : cells) SettleBoundary(c);
  ReleaseFaces(faces);
  ReleaseEdges(edges);
  return absl::OkStatus();
}

absl::StatusOr<EntityId> Mesh::AddNear(const NewElement& element, Nearby& nearby) {
  switch (KindOf(element.type)) {
    case EntityKind::kEdge:
      return AddWireEdge(element.vertices());
    case EntityKind::kFace:
      return AddFaceNear(element.vertices(), nearby);
    default:
      return AddCellNear(element.type, element.vertices(), nearby);
  }
}

absl::StatusOr<EntityId> Mesh::AddFaceNear(VertexSpan vertices, Nearby& nearby) {
  const size_t n = vertices.size();
  FaceEdges edges;
  bool is_new = false;
  for (size_t k = 0; k < n; ++k) {
    const auto match = nearby.FindEdge(vertices[k], vertices[(k + 1) % n]);
    edges[k] = match.edge;
    is_new |= match.is_new;
  }
  const FaceEdges found = edges;
  FaceMatch match = nearby.FindFace(vertices);
  if (!match.face.valid() && !is_new)
    match = FindFaceAround(LeastUsed(absl::MakeConstSpan(edges.data(), n)), vertices);
  DYNMESH_ASSIGN_OR_RETURN(const EntityId id, AddFaceElement(vertices, edges, match));
  for (size_t k = 0; k < n; ++k) {
    if (!found[k].valid()) nearby.AddNew(edges[k]);
  }
  if (!match.face.valid()) nearby.AddNew(FaceId(id.slot));
  return id;
}

absl::StatusOr<EntityId> Mesh::AddCellNear(ElementType type, VertexSpan vertices, Nearby& nearby) {
  const ElementTemplate& shape = TemplateOf(type);
  CellParts parts;
  nearby.FindParts(shape, vertices, parts);
  uint32_t missing_edges = 0, missing_faces = 0;  // a bit for each
  for (int e = 0; e < shape.num_edges; ++e) missing_edges |= uint32_t{!parts.edges[e].valid()} << e;
  for (int i = 0; i < shape.num_faces; ++i) missing_faces |= uint32_t{!parts.faces[i].face.valid()} << i;
  DYNMESH_ASSIGN_OR_RETURN(const EntityId id, AddCell(type, vertices, parts));
  for (; missing_edges != 0; missing_edges &= missing_edges - 1) {
    nearby.AddNew(parts.edges[std::countr_zero(missing_edges)]);
  }
  for (; missing_faces != 0; missing_faces &= missing_faces - 1) {
    nearby.AddNew(parts.faces[std::countr_zero(missing_faces)].face);
  }
  return id;
}

}  // namespace dynmesh
