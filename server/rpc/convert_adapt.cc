#include "server/rpc/convert_adapt.h"

#include <algorithm>
#include <numbers>
#include <string>

#include "server/session/session_errors.h"

namespace dynmesh {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr uint32_t kMaxPasses = 1000;

v1::AdaptEnd FromAdaptEnd(AdaptEnd end) {
  switch (end) {
    case AdaptEnd::kMaxPasses:
      return v1::ADAPT_END_MAX_PASSES;
    case AdaptEnd::kMaxElements:
      return v1::ADAPT_END_MAX_ELEMENTS;
    default:
      return v1::ADAPT_END_CONVERGED;
  }
}

void FromMeshShape(const MeshShape& shape, v1::MeshShape* message) {
  message->set_edges(shape.num_edges);
  message->set_elements(shape.num_elements);
  message->set_min_length(shape.min_length);
  message->set_mean_length(shape.mean_length);
  message->set_max_length(shape.max_length);
  message->set_share_in_band(shape.share_in_band);
  message->set_smallest_angle(shape.smallest_angle / kDegree);
  message->set_least_quality(shape.least_quality);
}

}  // namespace

absl::StatusOr<AdaptOptions> ToAdaptOptions(const v1::AdaptSessionRequest& request, const Limits& limits) {
  AdaptOptions options;
  options.target_length = request.target_length();
  options.size_attribute = request.size_attribute();
  if (request.has_min_quality()) options.min_quality = request.min_quality();
  if (request.has_feature_angle()) {
    const double degrees = request.feature_angle();
    if (!(degrees >= 0 && degrees <= 180))
      return BadField("feature_angle", "an angle is from 0 to 180 degrees");
    options.feature_angle = std::min(degrees * kDegree, std::numbers::pi);
  }
  if (request.max_passes() > kMaxPasses) return BadField("max_passes", "there are at most 1000 passes");
  if (request.max_passes() != 0) options.max_passes = static_cast<int>(request.max_passes());
  options.max_elements = std::min<uint64_t>(options.max_elements, limits.max_cells);
  if (request.max_elements() != 0) {
    options.max_elements = std::min<uint64_t>(options.max_elements, request.max_elements());
  }
  return options;
}

void FromAdaptProgress(const AdaptProgress& progress, int64_t revision, v1::AdaptProgress* message) {
  message->set_revision(revision);
  message->set_pass(progress.pass);
  message->set_phase(std::string(AdaptPhaseName(progress.phase)));
  message->set_done(progress.done);
  message->set_total(progress.total);
  message->set_elements(progress.num_elements);
  message->set_smallest_angle(progress.smallest_angle / kDegree);
}

void FromAdaptResult(const AdaptResult& result, int64_t revision, v1::AdaptResult* message) {
  message->set_revision(revision);
  message->set_end(FromAdaptEnd(result.end));
  message->set_passes(result.passes);
  message->set_splits(result.counts.splits);
  message->set_collapses(result.counts.collapses);
  message->set_swaps(result.counts.swaps);
  message->set_moves(result.counts.moves);
  for (const auto& [reason, count] : result.refusals) (*message->mutable_refusals())[reason] = count;
  FromMeshShape(result.before, message->mutable_before());
  FromMeshShape(result.after, message->mutable_after());
}

}  // namespace dynmesh
