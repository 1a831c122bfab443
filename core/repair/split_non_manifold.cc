#include "core/repair/split_non_manifold.h"

#include <algorithm>
#include <array>

#include "core/edit/star.h"
#include "core/mesh/error.h"
#include "core/repair/fans.h"

namespace dynmesh {
namespace {

/// Adds to `patch` that the elements of a fan have a copy of `v` in its place.
void MoveToCopy(const Mesh& mesh, VertexId v, absl::Span<const EntityId> fan, Patch& patch) {
  const VertexId copy = patch.AddVertex(mesh.Position(v), {{v}, {1.0}});
  for (EntityId id : fan) {
    NewElement moved(mesh.Type(id), mesh.VerticesOf(id));
    const auto vertices = moved.mutable_vertices();
    std::replace(vertices.begin(), vertices.end(), v, copy);
    patch.Remove(id);
    patch.Add(moved.type, moved.vertices());
  }
}

/// Vertices of the elements of split fans: what these touched there may have gone another way.
void MarkVertices(const Mesh& mesh, absl::Span<const EntityId> elements, BitSet& pending) {
  for (EntityId id : elements) {
    for (VertexId v : mesh.VerticesOf(id)) pending.Set(v.slot());
  }
}

absl::Status SplitVertex(RepairWork& work, VertexId v, BitSet& pending, RepairReport& report) {
  const Mesh& mesh = work.mesh();
  DYNMESH_RETURN_IF_ERROR(work.Charge(1 + WorkOfStar(mesh, v)));
  const Fans found = FansAt(mesh, v);
  DYNMESH_RETURN_IF_ERROR(work.Charge(found.work));
  if (found.fans.size() < 2) return absl::OkStatus();
  Patch patch;
  for (size_t i = 1; i < found.fans.size(); ++i) MoveToCopy(mesh, v, found.fans[i], patch);
  DYNMESH_RETURN_IF_ERROR(work.Apply(patch));
  report.Add(RepairFinding::kSplit, v);
  for (VertexId copy : work.applied().new_vertices) report.Add(RepairFinding::kAdded, copy);
  MarkVertices(mesh, work.applied().added, pending);
  return absl::OkStatus();
}

/// Whether more than two faces that are elements meet at an edge, or more than two that bound cells.
bool IsPinched(const Mesh& mesh, EdgeId e) {
  int elements = 0, bounds = 0;
  for (FaceId f : mesh.IncidentFaces(e)) {
    elements += mesh.IsElement(f);
    bounds += mesh.IncidentCells(f).size() == 1;
  }
  return elements > 2 || bounds > 2;
}

/// Notes what is left.
absl::Status FindRest(RepairWork& work, RepairReport& report) {
  const Mesh& mesh = work.mesh();
  const BitSet& edges = mesh.slots(EntityKind::kEdge).live();
  for (EdgeId e(edges.Next(0)); e.valid(); e = EdgeId(edges.Next(e.slot() + 1))) {
    DYNMESH_RETURN_IF_ERROR(work.Charge(1 + mesh.IncidentFaces(e).size()));
    if (IsPinched(mesh, e)) report.Add(RepairFinding::kStillNonManifold, e);
  }
  const BitSet& faces = mesh.slots(EntityKind::kFace).live();
  for (FaceId f(faces.Next(0)); f.valid(); f = FaceId(faces.Next(f.slot() + 1))) {
    DYNMESH_RETURN_IF_ERROR(work.Charge(1));
    if (mesh.IncidentCells(f).size() > 2) report.Add(RepairFinding::kStillNonManifold, f);
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<RepairReport> SplitNonManifold(RepairWork& work) {
  RepairReport report;
  BitSet pending = work.mesh().slots(EntityKind::kVertex).live();
  DYNMESH_RETURN_IF_ERROR(work.ChargeBytes(pending.memory_bytes()));
  for (Slot slot = pending.Next(0); slot != kNoSlot;) {
    pending.Clear(slot);
    DYNMESH_RETURN_IF_ERROR(SplitVertex(work, VertexId(slot), pending, report));
    const Slot next = pending.Next(slot);
    slot = next != kNoSlot ? next : pending.Next(0);
  }
  DYNMESH_RETURN_IF_ERROR(FindRest(work, report));
  return report;
}

}  // namespace dynmesh
