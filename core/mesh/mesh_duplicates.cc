// Duplicate edges and faces: elements that stand where an equal entity stood. One entity of each vertex pair or
// cycle, the primary, serves faces and cells; the others are used by nobody. When the primary ends, the duplicate
// of the lowest slot becomes primary.

#include "core/mesh/mesh.h"

namespace dynmesh {

void Mesh::CountDuplicate(EntityId id, int change) {
  auto& duplicates = duplicates_[Dimension(id.kind)];
  const CycleKey key = CanonicalCycle(VerticesOf(id));
  if (change > 0) {
    duplicates[key].insert(id.slot);
    return;
  }
  const auto it = duplicates.find(key);
  it->second.erase(id.slot);
  if (it->second.empty()) duplicates.erase(it);
}

void Mesh::SetDuplicateFlag(EntityId id, bool duplicate) {
  Record({duplicate ? JournalOp::kSetDuplicate : JournalOp::kClearDuplicate, id.kind, id.slot, 0, 0});
  flags(id) = duplicate ? flags(id) | kDuplicateFlag : flags(id) & ~kDuplicateFlag;
  CountDuplicate(id, duplicate ? +1 : -1);
  if (id.kind == EntityKind::kEdge) {
    duplicate ? ForgetHubEdge(EdgeId(id.slot)) : IndexHubEdge(EdgeId(id.slot));
  } else {
    duplicate ? ForgetHubFace(FaceId(id.slot)) : IndexHubFace(FaceId(id.slot));
  }
}

void Mesh::PassOnPrimary(EntityId ended) {
  const auto& duplicates = duplicates_[Dimension(ended.kind)];
  if (duplicates.empty() || IsDuplicate(ended)) return;
  const auto it = duplicates.find(CanonicalCycle(VerticesOf(ended)));
  if (it != duplicates.end()) SetDuplicateFlag({ended.kind, *it->second.begin()}, false);
}

}  // namespace dynmesh
