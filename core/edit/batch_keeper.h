#ifndef DYNMESH_CORE_EDIT_BATCH_KEEPER_H_
#define DYNMESH_CORE_EDIT_BATCH_KEEPER_H_

#include "absl/status/status.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

/// Keeps what batches do, e.g. in a log, and has the last word on whether they are committed.
class BatchKeeper {
 public:
  virtual ~BatchKeeper() = default;

  /// Called in the open batch when nothing else refuses it any more; it becomes revision mesh.revision() + 1
  /// next, but that there are no more revisions. An error rolls it back. Not called for dry runs.
  virtual absl::Status Keep(const Mesh& mesh) = 0;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_EDIT_BATCH_KEEPER_H_
