#ifndef DYNMESH_SERVER_SESSION_MESH_WARNINGS_H_
#define DYNMESH_SERVER_SESSION_MESH_WARNINGS_H_

#include <cstdint>
#include <vector>

#include "core/edit/transaction.h"
#include "core/mesh/ids.h"

namespace dynmesh {

inline constexpr size_t kMaxWarningIds = 1024;

/// What is wrong with elements that were accepted all the same.
enum class WarningKind { kDegenerateElement, kDuplicateElement };

/// One kind of warning about elements of one dimension.
struct MeshWarning {
  WarningKind warning;
  EntityKind kind;
  std::vector<Slot> ids;  ///< the first kMaxWarningIds
  uint64_t count = 0;     ///< all
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

std::vector<MeshWarning> WarningsOf(const BatchResult& result);

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_MESH_WARNINGS_H_
