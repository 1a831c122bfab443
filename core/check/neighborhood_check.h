#ifndef DYNMESH_CORE_CHECK_NEIGHBORHOOD_CHECK_H_
#define DYNMESH_CORE_CHECK_NEIGHBORHOOD_CHECK_H_

#include <vector>

#include "core/check/check.h"
#include "core/edit/batch_checker.h"

namespace dynmesh {

/// Makes the local checks of some settings on what a batch has touched (Mesh::Touched), and nowhere else:
/// what was bad elsewhere never refuses a batch. What the batch touches and leaves bad does, even where it
/// was as bad before. Checks of the whole mesh are passed over.
///
///     NeighborhoodCheck checker(settings);
///     ApplyBatch(mesh, edits, {.checker = &checker});
///
/// Errors: FAILED_PRECONDITION CHECK_FAILED for the first check of severity kReject that fails, with metadata
/// check (its name), kind, ids (up to 16), count, value (at the first of them) and threshold. Ids of what the
/// batch has made are those that it would have got.
class NeighborhoodCheck final : public BatchChecker {
 public:
  /// REQUIRES: `settings` outlive this.
  explicit NeighborhoodCheck(const CheckSettings& settings) : settings_(settings) {}

  absl::Status Check(const Mesh& mesh, WorkMeter& meter, std::vector<BatchWarning>& warnings) override;

 private:
  const CheckSettings& settings_;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_CHECK_NEIGHBORHOOD_CHECK_H_
