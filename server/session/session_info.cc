#include "server/session/session_info.h"

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
