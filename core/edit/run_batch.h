#ifndef DYNMESH_CORE_EDIT_RUN_BATCH_H_
#define DYNMESH_CORE_EDIT_RUN_BATCH_H_

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "core/edit/batch_keeper.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

/// Begins a batch and calls fn(), which edits `mesh`. The batch is open after success; after an error, also
/// RESOURCE_EXHAUSTED when memory ran out in fn(), the mesh is as it was.
/// Throws std::runtime_error when memory ran out and the mesh could not be put back: it is damaged then.
/// REQUIRES: no batch is open.
absl::Status RunInBatch(Mesh& mesh, absl::FunctionRef<absl::Status()> fn);

/// What becomes of a batch.
enum class BatchEnding { kCommit, kRollBack };

/// Ends the open batch; one that cannot be kept or committed is rolled back. A null `keeper` keeps nothing.
/// Errors: those of Keep(), also RESOURCE_EXHAUSTED when memory ran out in it, and of Mesh::Commit.
absl::Status EndBatch(Mesh& mesh, BatchEnding ending, BatchKeeper* keeper = nullptr);

/// Mesh::RollbackTo within fn() of RunInBatch. Memory that runs out here leaves a mesh that nobody can put
/// back: no refusal, but std::runtime_error.
void PutBackTo(Mesh& mesh, Mesh::Savepoint savepoint);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_EDIT_RUN_BATCH_H_
