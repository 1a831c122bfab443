#include "server/session/mesh_warnings.h"

#include <algorithm>

namespace dynmesh {

void WarningCollector::Add(WarningKind warning, EntityId id) {
  auto found = std::find_if(warnings_.begin(), warnings_.end(), [&](const MeshWarning& entry) {
    return entry.warning == warning && entry.kind == id.kind;
  });
  if (found == warnings_.end()) {
    warnings_.push_back({.warning = warning, .kind = id.kind, .ids = {}});
    found = warnings_.end() - 1;
  }
  ++found->count;
  if (found->ids.size() < kMaxWarningIds) found->ids.push_back(id.slot);
}

std::vector<MeshWarning> WarningsOf(const BatchResult& result) {
  WarningCollector collector;
  for (EntityId id : result.degenerate) collector.Add(WarningKind::kDegenerateElement, id);
  for (EntityId id : result.duplicate) collector.Add(WarningKind::kDuplicateElement, id);
  std::vector<MeshWarning> warnings = collector.warnings();
  for (const BatchWarning& found : result.warnings) {
    warnings.push_back({.warning = WarningKind::kCheckFailed,
                        .kind = found.kind,
                        .ids = found.ids,
                        .count = found.count,
                        .check = static_cast<CheckKind>(found.check),
                        .threshold = found.threshold,
                        .values = found.values});
  }
  return warnings;
}

}  // namespace dynmesh
