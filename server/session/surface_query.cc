// The boundary as triangles: what QuerySurface encodes.

#include <algorithm>
#include <utility>

#include "server/session/queries.h"

namespace dynmesh {
namespace {

constexpr size_t kTriangleBytes = 3 * sizeof(uint32_t) + (sizeof(Point) + sizeof(VertexId)) / 2;

bool IsOnSurface(const Mesh& mesh, FaceId f) {
  return mesh.IsOnBoundary(f) || (mesh.IsElement(f) && !mesh.IsDuplicate(f));
}

void AppendTriangles(absl::Span<const VertexId> face, std::vector<std::array<uint32_t, 3>>& triangles) {
  for (size_t k = 2; k < face.size(); ++k) {
    triangles.push_back({face[0].slot(), face[k - 1].slot(), face[k].slot()});
  }
}

/// Replaces vertex slots in `triangles` by indices into the table of those that occur.
void MakeVertexTable(const Mesh& mesh, TriangleSurface& surface) {
  auto& slots = surface.vertex_slots;
  for (const auto& triangle : surface.triangles) {
    for (uint32_t slot : triangle) slots.push_back(VertexId(slot));
  }
  std::sort(slots.begin(), slots.end());
  slots.erase(std::unique(slots.begin(), slots.end()), slots.end());
  for (VertexId v : slots) surface.positions.push_back(mesh.Position(v));
  for (auto& triangle : surface.triangles) {
    for (uint32_t& corner : triangle) {
      corner = std::lower_bound(slots.begin(), slots.end(), VertexId(corner)) - slots.begin();
    }
  }
}

absl::Status GatherSurface(const Mesh& mesh, QueryBudget budget, TriangleSurface& surface) {
  const BitSet& live = mesh.slots(EntityKind::kFace).live();
  for (Slot slot = live.Next(0); slot != kNoSlot; slot = live.Next(slot + 1)) {
    const FaceId f(slot);
    DYNMESH_RETURN_IF_ERROR(budget.ChargeSteps(1));
    if (!IsOnSurface(mesh, f)) continue;
    DYNMESH_RETURN_IF_ERROR(budget.ChargeBytes(2 * kTriangleBytes));
    AppendTriangles(mesh.Vertices(f), surface.triangles);
  }
  DYNMESH_RETURN_IF_ERROR(budget.ChargeSteps(3 * surface.triangles.size()));
  MakeVertexTable(mesh, surface);
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<SurfaceAnswer> QuerySurface(const Session& session, const QueryTerms& terms) {
  SurfaceAnswer answer;
  DYNMESH_RETURN_IF_ERROR(session.Read([&](const SessionView& view) {
    answer.revision = view.mesh.revision();
    return GatherSurface(view.mesh, QueryBudget(session.limits(), terms), answer.surface);
  }));
  return answer;
}

}  // namespace dynmesh
