#ifndef DYNMESH_SERVER_SESSION_MESH_WARNINGS_H_
#define DYNMESH_SERVER_SESSION_MESH_WARNINGS_H_

#include <cstdint>
#include <vector>

#include "core/check/check.h"
#include "core/edit/transaction.h"
#include "core/mesh/ids.h"

namespace dynmesh {

inline constexpr size_t kMaxWarningIds = kMaxWarnedIds;

/// What is wrong with entities that were accepted all the same.
enum class WarningKind { kDegenerateElement, kDuplicateElement, kCheckFailed };

/// One kind of warning about entities of one dimension.
struct MeshWarning {
  WarningKind warning;
  EntityKind kind;
  std::vector<Slot> ids;  ///< the first kMaxWarningIds
  uint64_t count = 0;     ///< all

  // Of kCheckFailed.
  CheckKind check = CheckKind::kUnspecified;
  double threshold = 0;
  std::vector<double> values = {};  ///< at `ids`
};

/// Gathers warnings element by element.
class WarningCollector {
 public:
  void Add(WarningKind warning, EntityId id);
  /// In order of first appearance.
  const std::vector<MeshWarning>& warnings() const { return warnings_; }

 private:
  std::vector<MeshWarning> warnings_;
};

/// Of added elements, then of checks.
std::vector<MeshWarning> WarningsOf(const BatchResult& result);

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_MESH_WARNINGS_H_
