#include "core/edit/run_batch.h"

#include <new>
#include <stdexcept>

#include "core/mesh/validate.h"

namespace dynmesh {
namespace {

/// Memory that runs out in the middle is a refusal like others, if the mesh can be put back.
absl::Status Try(absl::FunctionRef<absl::Status()> fn, bool& ran_out) try {
  return fn();
} catch (const std::bad_alloc&) {
  ran_out = true;
  return MakeError(absl::StatusCode::kResourceExhausted, reason::kLimitExceeded, "memory ran out",
                   {{"limit", "memory"}});
}

}  // namespace

absl::Status RunInBatch(Mesh& mesh, absl::FunctionRef<absl::Status()> fn) {
  mesh.BeginBatch();
  bool ran_out = false;
  const absl::Status status = Try(fn, ran_out);
  if (status.ok()) return status;
  mesh.Rollback();
  // Where an allocation failed, an entity may have been left half made, which no journal knows: then all of
  // the mesh is looked at, and one that is damaged is not kept in service.
  if (ran_out && !Validate(mesh, {.max_violations = 1}).empty()) {
    throw std::runtime_error("memory ran out in the middle of an edit");
  }
  return status;
}

absl::Status EndBatch(Mesh& mesh, BatchEnding ending, BatchKeeper* keeper) {
  bool ran_out = false;
  const absl::Status ended = Try(
      [&]() -> absl::Status {
        if (ending == BatchEnding::kRollBack) return absl::OkStatus();
        if (keeper != nullptr) DYNMESH_RETURN_IF_ERROR(keeper->Keep(mesh));
        return mesh.Commit();
      },
      ran_out);
  if (ending == BatchEnding::kRollBack || !ended.ok()) mesh.Rollback();
  return ended;
}

void PutBackTo(Mesh& mesh, Mesh::Savepoint savepoint) try {
  mesh.RollbackTo(savepoint);
} catch (const std::bad_alloc&) {
  throw std::runtime_error("memory ran out while an edit was rolled back");
}

}  // namespace dynmesh
