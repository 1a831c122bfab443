#include "core/check/summary.h"

#include <algorithm>

#include "core/check/incidence.h"
#include "core/check/pieces.h"

namespace dynmesh {
namespace {

absl::Status ForEachLive(const Mesh& mesh, EntityKind kind, WorkMeter& meter,
                         absl::FunctionRef<void(Slot)> fn) {
  const BitSet& live = mesh.slots(kind).live();
  for (Slot slot = live.Next(0); slot != kNoSlot; slot = live.Next(slot + 1)) {
    DYNMESH_RETURN_IF_ERROR(meter.ChargeSteps(1));
    fn(slot);
  }
  return absl::OkStatus();
}

absl::Status CountComponents(const Mesh& mesh, WorkMeter& meter, MeshTopology& topology) {
  const Slots& vertices = mesh.slots(EntityKind::kVertex);
  Pieces pieces(vertices.limit());
  DYNMESH_RETURN_IF_ERROR(ForEachLive(mesh, EntityKind::kEdge, meter, [&](Slot e) {
    const auto ends = mesh.Vertices(EdgeId(e));
    pieces.Join(ends[0].slot(), ends[1].slot());
  }));
  return ForEachLive(mesh, EntityKind::kVertex, meter, [&](Slot v) {
    const bool isolated = mesh.IncidentEdges(VertexId(v)).empty();
    topology.isolated_vertices += isolated;
    topology.components += !isolated && pieces.Find(v) == v;
  });
}

absl::Status CountBodies(const Mesh& mesh, WorkMeter& meter, MeshTopology& topology) {
  const Slot limit = mesh.slots(EntityKind::kCell).limit();
  Pieces cells(limit);
  std::vector<uint32_t> twisted;
  DYNMESH_RETURN_IF_ERROR(ForEachLive(mesh, EntityKind::kFace, meter, [&](Slot f) {
    const Agreement agreement = AgreementAt(mesh, FaceId(f));
    if (agreement == Agreement::kNone) return;
    const auto pair = mesh.IncidentCells(FaceId(f));
    const auto turn = agreement == Agreement::kAgree ? Pieces::Turn::kSame : Pieces::Turn::kOpposite;
    if (!cells.Join(pair[0].slot(), pair[1].slot(), turn)) twisted.push_back(pair[0].slot());
  }));
  for (uint32_t& cell : twisted) cell = cells.Find(cell);
  std::sort(twisted.begin(), twisted.end());
  topology.non_orientable_bodies = std::unique(twisted.begin(), twisted.end()) - twisted.begin();
  return ForEachLive(mesh, EntityKind::kCell, meter, [&](Slot c) { topology.bodies += cells.Find(c) == c; });
}

}  // namespace

absl::StatusOr<MeshTopology> SummarizeTopology(const Mesh& mesh, WorkMeter& meter) {
  MeshTopology topology;
  for (EntityKind kind : kEntityKinds) {
    topology.euler_characteristic += (Dimension(kind) % 2 == 0 ? 1 : -1) * int64_t{mesh.NumLive(kind)};
  }
  DYNMESH_RETURN_IF_ERROR(CountComponents(mesh, meter, topology));
  DYNMESH_RETURN_IF_ERROR(CountBodies(mesh, meter, topology));
  DYNMESH_ASSIGN_OR_RETURN(topology.surface,
                           SummarizeSurface(
                               mesh, [&](FaceId f) { return IsSurfaceFace(mesh, f); }, meter));
  const auto is_skin = [&](FaceId f) { return mesh.IncidentCells(f).size() == 1 && !mesh.IsDegenerate(f); };
  DYNMESH_ASSIGN_OR_RETURN(topology.shells, SummarizeSurface(mesh, is_skin, meter));
  return topology;
}

double ValueOf(CheckKind check, const MeshTopology& topology) {
  switch (check) {
    case CheckKind::kHoles:
      return topology.surface.holes;
    case CheckKind::kNonOrientable:
      return topology.surface.non_orientable + topology.non_orientable_bodies;
    case CheckKind::kShells:
      return topology.shells.pieces;
    case CheckKind::kComponents:
      return topology.components;
    default:
      return topology.surface.genus + topology.shells.genus;
  }
}

}  // namespace dynmesh
