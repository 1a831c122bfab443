#include "core/mesh/relations.h"

#include <algorithm>

namespace dynmesh {
namespace {

using Slots = std::vector<Slot>;

template <typename Ids>
void AppendAll(const Ids& ids, Slots& out) {
  for (auto id : ids) out.push_back(id.slot());
}

/// Sorts out[begin..], drops repeats, and drops `self`.
void Canonicalize(Slots& out, size_t begin, Slot self = kNoSlot) {
  std::sort(out.begin() + begin, out.end());
  out.erase(std::unique(out.begin() + begin, out.end()), out.end());
  const auto it = std::lower_bound(out.begin() + begin, out.end(), self);
  if (it != out.end() && *it == self) out.erase(it);
}

// ---- Towards lower dimensions: template order ----

void CellEdges(const Mesh& mesh, CellId c, Slots& out) {
  const int num_edges = TemplateOf(mesh.Type(c)).num_edges;
  for (int e = 0; e < num_edges; ++e) out.push_back(mesh.Edge(c, e).slot());
}

void CellFaces(const Mesh& mesh, CellId c, Slots& out) {
  for (OrientedFace oriented : mesh.Faces(c)) out.push_back(oriented.face().slot());
}

// ---- Towards higher dimensions and sideways: gathered, then made canonical ----

void EdgeCells(const Mesh& mesh, EdgeId e, Slots& out) {
  for (FaceId f : mesh.IncidentFaces(e)) AppendAll(mesh.IncidentCells(f), out);
}

void VertexNeighbors(const Mesh& mesh, VertexId v, EntityKind to, Slots& out) {
  for (EdgeId e : mesh.IncidentEdges(v)) {
    switch (to) {
      case EntityKind::kVertex:
        AppendAll(mesh.Vertices(e), out);
        break;
      case EntityKind::kEdge:
        out.push_back(e.slot());
        break;
      case EntityKind::kFace:
        AppendAll(mesh.IncidentFaces(e), out);
        break;
      case EntityKind::kCell:
        EdgeCells(mesh, e, out);
        break;
    }
  }
}

void EdgeNeighbors(const Mesh& mesh, EdgeId e, EntityKind to, Slots& out) {
  switch (to) {
    case EntityKind::kVertex:
      return AppendAll(mesh.Vertices(e), out);
    case EntityKind::kEdge:
      for (VertexId v : mesh.Vertices(e)) AppendAll(mesh.IncidentEdges(v), out);
      return;
    case EntityKind::kFace:
      return AppendAll(mesh.IncidentFaces(e), out);
    case EntityKind::kCell:
      return EdgeCells(mesh, e, out);
  }
}

void FaceNeighbors(const Mesh& mesh, FaceId f, EntityKind to, Slots& out) {
  switch (to) {
    case EntityKind::kVertex:
      return AppendAll(mesh.Vertices(f), out);
    case EntityKind::kEdge:
      return AppendAll(mesh.Edges(f), out);
    case EntityKind::kFace:
      for (EdgeId e : mesh.Edges(f)) AppendAll(mesh.IncidentFaces(e), out);
      return;
    case EntityKind::kCell:
      return AppendAll(mesh.IncidentCells(f), out);
  }
}

void CellNeighbors(const Mesh& mesh, CellId c, EntityKind to, Slots& out) {
  switch (to) {
    case EntityKind::kVertex:
      return AppendAll(mesh.Vertices(c), out);
    case EntityKind::kEdge:
      return CellEdges(mesh, c, out);
    case EntityKind::kFace:
      return CellFaces(mesh, c, out);
    case EntityKind::kCell:
      for (OrientedFace oriented : mesh.Faces(c)) AppendAll(mesh.IncidentCells(oriented.face()), out);
      return;
  }
}

}  // namespace

void AppendNeighbors(const Mesh& mesh, Relation relation, Slot slot, std::vector<Slot>& out) {
  const size_t begin = out.size();
  switch (relation.from) {
    case EntityKind::kVertex:
      VertexNeighbors(mesh, VertexId(slot), relation.to, out);
      break;
    case EntityKind::kEdge:
      EdgeNeighbors(mesh, EdgeId(slot), relation.to, out);
      break;
    case EntityKind::kFace:
      FaceNeighbors(mesh, FaceId(slot), relation.to, out);
      break;
    case EntityKind::kCell:
      CellNeighbors(mesh, CellId(slot), relation.to, out);
      break;
  }
  if (relation.to == relation.from) {
    Canonicalize(out, begin, slot);
  } else if (relation.to > relation.from) {
    Canonicalize(out, begin);
  }
}

CsrTable Neighbors(const Mesh& mesh, Relation relation, absl::Span<const Slot> slots) {
  CsrTable table;
  table.offsets.reserve(slots.size() + 1);
  for (Slot slot : slots) {
    AppendNeighbors(mesh, relation, slot, table.ids);
    table.offsets.push_back(table.ids.size());
  }
  return table;
}

}  // namespace dynmesh
