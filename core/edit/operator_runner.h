#ifndef DYNMESH_CORE_EDIT_OPERATOR_RUNNER_H_
#define DYNMESH_CORE_EDIT_OPERATOR_RUNNER_H_

#include <cstdint>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "core/edit/apply_patch.h"
#include "core/edit/batch_names.h"
#include "core/edit/conflicts.h"
#include "core/edit/edits.h"
#include "core/edit/patch.h"
#include "core/edit/transaction.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

/// Runs the operators of one batch: each item is planned, checked and carried out before the next one is
/// looked at; refused ones are passed over where the options say so.
///
/// What it does goes into the last of the result's EditResults. Errors: those of planning, checking and
/// applying a patch, with metadata "index"; RESOURCE_EXHAUSTED for the limits of BatchOptions.
/// REQUIRES: a batch is open; all that it refers to outlives it.
class OperatorRunner {
 public:
  OperatorRunner(Mesh& mesh, const BatchOptions& options, BatchNames& names, BatchResult& result)
      : mesh_(mesh),
        options_(options),
        conflicts_(mesh, options.conflict_policy, options.as_of_revision),
        names_(names),
        result_(result) {}

  absl::Status Run(const SplitEdgesEdit& edit);
  absl::Status Run(const CollapseEdgesEdit& edit);
  absl::Status Run(const SwapEdgesEdit& edit);
  absl::Status Run(const SwapFacesEdit& edit);
  absl::Status Run(const SplitElementsEdit& edit);
  absl::Status Run(const MergeVerticesEdit& edit);
  absl::Status Run(const DissolveVerticesEdit& edit);
  absl::Status Run(const SmoothVerticesEdit& edit);

 private:
  /// Items of an operator, and the vertices that each is known to add, which later edits can name.
  struct Items {
    size_t count;
    size_t new_vertices;
  };
  using Plan = absl::FunctionRef<absl::Status(size_t)>;  ///< fills patch_ for an item

  /// Asks memory for what an item will need (Mesh::PrefetchStar), some items before it is planned.
  using Prefetch = absl::FunctionRef<void(size_t item, int stage)>;

  absl::Status RunAll(const Items& items, const PatchLimits& limits, Plan plan);
  absl::Status RunAll(const Items& items, const PatchLimits& limits, Plan plan, Prefetch prefetch);
  void PrefetchEnd(EdgeId e, int stage) const;
  absl::Status RunOne(size_t item, const PatchLimits& limits, Plan plan);
  absl::Status ApplyPlanned(uint64_t max_attribute_bytes);
  absl::Status ChargePlanned();
  void Skip(const Items& items, uint32_t index, absl::Status status);
  absl::Status Report(const Items& items);
  double DefaultParameter(EdgeId e, VertexId origin) const;

  Mesh& mesh_;
  const BatchOptions& options_;
  ConflictCheck conflicts_;
  BatchNames& names_;
  BatchResult& result_;
  size_t num_lineage_ = 0;
  size_t num_refusals_ = 0;
  uint64_t work_ = 0;
  uint64_t attribute_bytes_ = 0;
  Patch patch_;
  AppliedPatch applied_;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_EDIT_OPERATOR_RUNNER_H_
