#ifndef DYNMESH_CORE_EDIT_BATCH_CHECKER_H_
#define DYNMESH_CORE_EDIT_BATCH_CHECKER_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

/// So many entities are named in a warning of a batch.
inline constexpr size_t kMaxWarnedIds = 1024;

/// What a batch left that deserves a look, of one kind.
struct BatchWarning {
  uint32_t check = 0;  ///< a number of the checker's
  std::string name;    ///< the same in words
  EntityKind kind = EntityKind::kVertex;
  double threshold = 0;
  std::vector<Slot> ids;       ///< the first kMaxWarnedIds, ascending
  std::vector<double> values;  ///< what was measured there
  uint64_t count = 0;          ///< all
};

/// What looks at a batch before it is committed (BatchOptions::checker), so that batches need not know what
/// there is to check; core/check has one.
class BatchChecker {
 public:
  virtual ~BatchChecker() = default;

  /// Looks at what the open batch of `mesh` has touched, and appends what deserves a look. An error refuses
  /// the batch. REQUIRES: a batch is open.
  virtual absl::Status Check(const Mesh& mesh, WorkMeter& meter, std::vector<BatchWarning>& warnings) = 0;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_EDIT_BATCH_CHECKER_H_
