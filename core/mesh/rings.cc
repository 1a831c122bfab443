#include "core/mesh/rings.h"

#include <algorithm>

#include "core/mesh/error.h"

namespace dynmesh {
namespace {

// Rows of more are listed from the bit set instead of being sorted.
constexpr size_t kSortedRow = 4096;

}  // namespace

absl::Status RingWalk::Walk(Slot start, uint32_t rings, std::vector<Slot>& row) {
  row.assign(1, start);
  reached_.Set(start);
  size_t begin = 0;
  for (uint32_t ring = 0; ring < rings && begin < row.size(); ++ring) {
    const size_t end = row.size();
    for (; begin < end; ++begin) DYNMESH_RETURN_IF_ERROR(Expand(row[begin], row));
  }
  return Finish(start, row);
}

// Appends to `row` what is adjacent to `slot` and was not reached before.
absl::Status RingWalk::Expand(Slot slot, std::vector<Slot>& row) {
  DYNMESH_RETURN_IF_ERROR(meter_.ChargeSteps(1));
  switch (kind_) {
    case EntityKind::kVertex:
      return ExpandVertex(VertexId(slot), row);
    case EntityKind::kEdge:
      for (VertexId v : mesh_.Vertices(EdgeId(slot))) {
        if (CrossFirst(v.slot())) DYNMESH_RETURN_IF_ERROR(Reach(mesh_.IncidentEdges(v), row));
      }
      return absl::OkStatus();
    case EntityKind::kFace:
      for (EdgeId e : mesh_.Edges(FaceId(slot))) {
        if (CrossFirst(e.slot())) DYNMESH_RETURN_IF_ERROR(Reach(mesh_.IncidentFaces(e), row));
      }
      return absl::OkStatus();
    case EntityKind::kCell:
      for (OrientedFace oriented : mesh_.Faces(CellId(slot))) {
        const FaceId f = oriented.face();
        if (CrossFirst(f.slot())) DYNMESH_RETURN_IF_ERROR(Reach(mesh_.IncidentCells(f), row));
      }
      return absl::OkStatus();
  }
  return absl::OkStatus();
}

// An edge is met from both its ends, so nothing is gained by remembering which were crossed.
absl::Status RingWalk::ExpandVertex(VertexId v, std::vector<Slot>& row) {
  auto edges = mesh_.IncidentEdges(v);
  while (!edges.empty()) {
    const auto piece = edges.subspan(0, WorkMeter::kMaxCharge);
    DYNMESH_RETURN_IF_ERROR(meter_.ChargeSteps(piece.size()));
    for (EdgeId e : piece) {
      for (VertexId end : mesh_.Vertices(e)) {
        if (reached_.Test(end.slot())) continue;
        reached_.Set(end.slot());
        row.push_back(end.slot());
      }
    }
    edges.remove_prefix(piece.size());
  }
  return absl::OkStatus();
}

bool RingWalk::CrossFirst(Slot connector) {
  if (crossed_.Test(connector)) return false;
  crossed_.Set(connector);
  connectors_.push_back(connector);
  return true;
}

template <typename Id>
absl::Status RingWalk::Reach(absl::Span<const Id> ids, std::vector<Slot>& row) {
  while (!ids.empty()) {
    const auto piece = ids.subspan(0, WorkMeter::kMaxCharge);
    DYNMESH_RETURN_IF_ERROR(meter_.ChargeSteps(piece.size()));
    for (Id id : piece) {
      if (reached_.Test(id.slot())) continue;
      reached_.Set(id.slot());
      row.push_back(id.slot());
    }
    ids.remove_prefix(piece.size());
  }
  return absl::OkStatus();
}

absl::Status RingWalk::Finish(Slot start, std::vector<Slot>& row) {
  reached_.Clear(start);
  row.erase(row.begin());
  if (row.size() <= kSortedRow) {
    std::sort(row.begin(), row.end());
  } else {
    DYNMESH_RETURN_IF_ERROR(meter_.ChargeSteps(mesh_.slots(kind_).limit() / 4096));
    reached_.ListMembers(row);
  }
  for (Slot slot : row) reached_.Clear(slot);
  for (Slot connector : connectors_) crossed_.Clear(connector);
  connectors_.clear();
  return absl::OkStatus();
}

}  // namespace dynmesh
