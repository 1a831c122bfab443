#include "server/session/session_info.h"

#include <algorithm>

namespace dynmesh {
namespace {

ElementTypeCounts CountElementTypes(const Mesh& mesh) {
  ElementTypeCounts counts = {};
  for (EntityKind kind : {EntityKind::kEdge, EntityKind::kFace, EntityKind::kCell}) {
    if (mesh.NumElements(kind) == 0) continue;
    mesh.slots(kind).live().ForEach([&](Slot slot) {
      const EntityId id(kind, slot);
      if (mesh.IsElement(id)) ++counts[static_cast<int>(mesh.Type(id))];
    });
  }
  return counts;
}

MeshSummary Summarize(const Mesh& mesh) {
  MeshSummary summary;
  summary.bounds = BoundsOf(mesh);
  summary.estimated_counts = EstimateCounts(mesh.NumLive(EntityKind::kVertex), CountElementTypes(mesh));
  return summary;
}

}  // namespace

absl::optional<Box> BoundsOf(const Mesh& mesh) {
  const BitSet& live = mesh.slots(EntityKind::kVertex).live();
  if (live.empty()) return absl::nullopt;
  const Point& first = mesh.Position(VertexId(live.Next(0)));
  Box box{first, first};
  live.ForEach([&](Slot slot) {
    const Point& position = mesh.Position(VertexId(slot));
    for (int axis = 0; axis < 3; ++axis) {
      box.low[axis] = std::min(box.low[axis], position[axis]);
      box.high[axis] = std::max(box.high[axis], position[axis]);
    }
  });
  return box;
}

MeshSummary SummaryCache::Of(const Mesh& mesh) {
  MutexLock lock(&mu_);
  if (revision_ != mesh.revision()) {
    summary_ = Summarize(mesh);
    revision_ = mesh.revision();
  }
  return summary_;
}

SessionInfo DescribeMesh(const Mesh& mesh, const MeshSummary& summary) {
  SessionInfo info;
  info.revision = mesh.revision();
  for (EntityKind kind : kEntityKinds) {
    info.counts[Dimension(kind)] = mesh.NumLive(kind);
    info.boundary_counts[Dimension(kind)] = mesh.Boundary(kind).size();
    info.element_counts[Dimension(kind)] = mesh.NumElements(kind);
    info.euler_characteristic += (Dimension(kind) % 2 == 0 ? 1 : -1) * int64_t{mesh.NumLive(kind)};
  }
  info.estimated_counts = summary.estimated_counts;
  info.bounds = summary.bounds;
  info.checksum = mesh.checksum();
  info.memory_bytes = mesh.memory_bytes();
  for (const AttributeColumn& column : mesh.attributes()) info.attributes.push_back(column.spec());
  return info;
}

}  // namespace dynmesh
