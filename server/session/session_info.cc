#include "server/session/session_info.h"

#include <algorithm>

#include "core/mesh/error.h"
#include "server/session/catch_exceptions.h"
#include "server/session/mesh_meter.h"

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

bool Contains(absl::Span<const Relation> relations, Relation relation) {
  return std::find(relations.begin(), relations.end(), relation) != relations.end();
}

/// Switches on what is wanted and not stored, and tells what that was.
absl::Status SwitchOn(Mesh& mesh, absl::Span<const Relation> wanted, MeshMeter& meter,
                      std::vector<Relation>& switched) {
  for (Relation relation : wanted) {
    if (mesh.stored().Has(relation)) continue;
    DYNMESH_RETURN_IF_ERROR(mesh.StoreRelation(relation, true, meter));
    switched.push_back(relation);
  }
  return absl::OkStatus();
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

std::vector<Relation> StoredRelationsOf(const Mesh& mesh) {
  std::vector<Relation> stored;
  for (Relation relation : kStorableRelations) {
    if (mesh.stored().Has(relation)) stored.push_back(relation);
  }
  return stored;
}

absl::Status StoreJust(Mesh& mesh, absl::Span<const Relation> wanted, uint64_t max_bytes,
                       const StopSignal& stop) {
  std::vector<Relation> switched;
  MeshMeter meter({mesh.memory_bytes(), max_bytes}, stop);
  const absl::Status status = CatchExceptions([&] { return SwitchOn(mesh, wanted, meter, switched); });
  for (Relation relation : status.ok() ? StoredRelationsOf(mesh) : switched) {
    // Switching off cannot fail.
    if (!status.ok() || !Contains(wanted, relation)) mesh.StoreRelation(relation, false).IgnoreError();
  }
  return status;
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
  info.settings.stored_relations = StoredRelationsOf(mesh);
  for (Relation relation : info.settings.stored_relations) {
    info.stored_relations.push_back({relation, mesh.stored().memory_bytes(relation)});
  }
  return info;
}

}  // namespace dynmesh
