#include "core/check/incidence.h"

#include <algorithm>

#include "core/check/pieces.h"

namespace dynmesh {
namespace {

int PlaceOf(const Mesh& mesh, FaceId f, EdgeId e) {
  const auto edges = mesh.Edges(f);
  return std::find(edges.begin(), edges.end(), e) - edges.begin();
}

/// Whether a face lies in a cell as the cell's template has it, or the other way round.
bool IsFlipped(const Mesh& mesh, CellId c, FaceId f) {
  const auto faces = mesh.Faces(c);
  const auto found =
      std::find_if(faces.begin(), faces.end(), [f](OrientedFace oriented) { return oriented.face() == f; });
  return found->code().flipped();
}

/// Adds the cells at each face of an edge as one group.
absl::Status AddCells(const Mesh& mesh, EdgeId e, WorkMeter& meter, GroupedSlots& cells) {
  for (FaceId f : mesh.IncidentFaces(e)) {
    const auto incident = mesh.IncidentCells(f);
    DYNMESH_RETURN_IF_ERROR(meter.ChargeManySteps(1 + incident.size()));
    cells.BeginGroup();
    for (CellId c : incident) cells.Add(c.slot());
  }
  return absl::OkStatus();
}

}  // namespace

bool RunsForward(const Mesh& mesh, FaceId f, int k) {
  return mesh.Vertices(mesh.Edges(f)[k])[0] == mesh.Vertices(f)[k];
}

absl::StatusOr<uint64_t> CountSurfaceFaces(const Mesh& mesh, EdgeId e, WorkMeter& meter) {
  const auto faces = mesh.IncidentFaces(e);
  DYNMESH_RETURN_IF_ERROR(meter.ChargeManySteps(faces.size()));
  return std::count_if(faces.begin(), faces.end(), [&](FaceId f) { return IsSurfaceFace(mesh, f); });
}

absl::StatusOr<uint64_t> CountCellFans(const Mesh& mesh, EdgeId e, WorkMeter& meter) {
  GroupedSlots cells;
  DYNMESH_RETURN_IF_ERROR(AddCells(mesh, e, meter, cells));
  return cells.CountPieces();
}

absl::StatusOr<VertexFans> CountFans(const Mesh& mesh, VertexId v, WorkMeter& meter) {
  GroupedSlots cells, faces;
  for (EdgeId e : mesh.IncidentEdges(v)) {
    DYNMESH_RETURN_IF_ERROR(meter.ChargeSteps(1));
    DYNMESH_RETURN_IF_ERROR(AddCells(mesh, e, meter, cells));
    faces.BeginGroup();
    for (FaceId f : mesh.IncidentFaces(e)) {
      if (IsSurfaceFace(mesh, f)) faces.Add(f.slot());
    }
  }
  return VertexFans{cells.CountPieces(), faces.CountPieces()};
}

absl::StatusOr<Agreement> AgreementAt(const Mesh& mesh, EdgeId e, WorkMeter& meter) {
  const auto faces = mesh.IncidentFaces(e);
  DYNMESH_RETURN_IF_ERROR(meter.ChargeManySteps(faces.size()));
  int forward = 0, backward = 0;
  for (FaceId f : faces) {
    if (!IsSurfaceFace(mesh, f)) continue;
    ++(RunsForward(mesh, f, PlaceOf(mesh, f, e)) ? forward : backward);
  }
  if (forward + backward != 2) return Agreement::kNone;
  return forward == 1 ? Agreement::kAgree : Agreement::kDisagree;
}

Agreement AgreementAt(const Mesh& mesh, FaceId f) {
  const auto cells = mesh.IncidentCells(f);
  if (cells.size() != 2 || cells[0] == cells[1]) return Agreement::kNone;
  const bool same = IsFlipped(mesh, cells[0], f) == IsFlipped(mesh, cells[1], f);
  return same ? Agreement::kDisagree : Agreement::kAgree;
}

}  // namespace dynmesh
