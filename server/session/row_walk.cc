#include "server/session/row_walk.h"

#include "core/mesh/error.h"

namespace dynmesh {

absl::Status RowWalk::Walk(Slot slot, std::vector<Slot>& row) {
  const uint64_t steps = CountSteps(slot);
  if (steps >= long_row_ && relation_.to >= relation_.from) {
    row.clear();
    return WalkLong(slot, row);
  }
  DYNMESH_RETURN_IF_ERROR(budget_.ChargeSteps(steps));
  GetNeighbors(mesh_, relation_, slot, block_, row);
  // Of the last lists on the way only the entries are known, at most a dozen times each.
  return budget_.ChargeSteps(row.size());
}

// Steps without those of the last lists, which the row itself pays for; not much beyond long_row_.
uint64_t RowWalk::CountSteps(Slot slot) const {
  constexpr uint64_t kOwnParts = 12;  // no element has more vertices, edges or faces
  const EntityKind to = relation_.to;
  if (to < relation_.from) return kOwnParts;
  switch (relation_.from) {
    case EntityKind::kVertex:
      return to < EntityKind::kFace ? mesh_.IncidentEdges(VertexId(slot)).size() : CountFaces(VertexId(slot));
    case EntityKind::kEdge: {
      if (to != EntityKind::kEdge) return 1 + mesh_.IncidentFaces(EdgeId(slot)).size();
      const auto ends = mesh_.Vertices(EdgeId(slot));
      return mesh_.IncidentEdges(ends[0]).size() + mesh_.IncidentEdges(ends[1]).size();
    }
    case EntityKind::kFace: {
      if (to == EntityKind::kCell) return 1 + mesh_.IncidentCells(FaceId(slot)).size();
      uint64_t steps = 1;
      for (EdgeId e : mesh_.Edges(FaceId(slot))) steps += mesh_.IncidentFaces(e).size();
      return steps;
    }
    case EntityKind::kCell:
      return CountCells(CellId(slot));
  }
  return kOwnParts;
}

uint64_t RowWalk::CountFaces(VertexId v) const {
  const auto edges = mesh_.IncidentEdges(v);
  uint64_t steps = 1 + edges.size();
  for (size_t i = 0; i < edges.size() && steps < long_row_; ++i)
    steps += mesh_.IncidentFaces(edges[i]).size();
  return steps;
}

uint64_t RowWalk::CountCells(CellId c) const {
  uint64_t steps = 1;
  for (OrientedFace oriented : mesh_.Faces(c)) steps += mesh_.IncidentCells(oriented.face()).size();
  return steps;
}

absl::Status RowWalk::WalkLong(Slot slot, std::vector<Slot>& row) {
  absl::Status status;
  switch (relation_.from) {
    case EntityKind::kVertex:
      status = MarkAround(VertexId(slot));
      break;
    case EntityKind::kEdge:
      status = MarkAround(EdgeId(slot));
      break;
    case EntityKind::kFace:
      status = MarkAround(FaceId(slot));
      break;
    case EntityKind::kCell:
      status = MarkAround(CellId(slot));
      break;
  }
  DYNMESH_RETURN_IF_ERROR(status);  // the query is over then, and the marks with it
  if (relation_.to == relation_.from) marked_.Clear(slot);
  // Listing the marks looks at a word for each 4096 slots, and at the marks.
  DYNMESH_RETURN_IF_ERROR(budget_.ChargeSteps(mesh_.slots(relation_.to).limit() / 4096 + marked_.size()));
  row.reserve(marked_.size());
  marked_.ForEach([&row](Slot marked) { row.push_back(marked); });
  for (Slot marked : row) marked_.Clear(marked);
  return absl::OkStatus();
}

absl::Status RowWalk::MarkAround(VertexId v) {
  const auto edges = mesh_.IncidentEdges(v);
  if (relation_.to == EntityKind::kEdge) return Mark(edges);
  for (EdgeId e : edges) {
    DYNMESH_RETURN_IF_ERROR(budget_.ChargeSteps(1));
    DYNMESH_RETURN_IF_ERROR(MarkAround(e));
  }
  return absl::OkStatus();
}

// Of an edge, or of a vertex through one of its edges.
absl::Status RowWalk::MarkAround(EdgeId e) {
  switch (relation_.to) {
    case EntityKind::kVertex:
      return Mark(mesh_.Vertices(e));
    case EntityKind::kEdge:
      for (VertexId v : mesh_.Vertices(e)) DYNMESH_RETURN_IF_ERROR(Mark(mesh_.IncidentEdges(v)));
      return absl::OkStatus();
    case EntityKind::kFace:
      return Mark(mesh_.IncidentFaces(e));
    case EntityKind::kCell:
      break;
  }
  for (FaceId f : mesh_.IncidentFaces(e)) {
    DYNMESH_RETURN_IF_ERROR(budget_.ChargeSteps(1));
    DYNMESH_RETURN_IF_ERROR(Mark(mesh_.IncidentCells(f)));
  }
  return absl::OkStatus();
}

absl::Status RowWalk::MarkAround(FaceId f) {
  if (relation_.to == EntityKind::kCell) return Mark(mesh_.IncidentCells(f));
  for (EdgeId e : mesh_.Edges(f)) DYNMESH_RETURN_IF_ERROR(Mark(mesh_.IncidentFaces(e)));
  return absl::OkStatus();
}

absl::Status RowWalk::MarkAround(CellId c) {
  for (OrientedFace oriented : mesh_.Faces(c)) {
    DYNMESH_RETURN_IF_ERROR(Mark(mesh_.IncidentCells(oriented.face())));
  }
  return absl::OkStatus();
}

template <typename Id>
absl::Status RowWalk::Mark(absl::Span<const Id> ids) {
  while (!ids.empty()) {
    const auto piece = ids.subspan(0, QueryBudget::kStepsPerCheck);
    DYNMESH_RETURN_IF_ERROR(budget_.ChargeSteps(piece.size()));
    for (Id id : piece) marked_.Set(id.slot());
    ids.remove_prefix(piece.size());
  }
  return absl::OkStatus();
}

}  // namespace dynmesh
