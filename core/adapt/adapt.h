#ifndef DYNMESH_CORE_ADAPT_ADAPT_H_
#define DYNMESH_CORE_ADAPT_ADAPT_H_

#include <cstdint>
#include <map>
#include <string>

#include "absl/strings/string_view.h"

/// What an adaptation is asked for, and what it tells. See adapter.h.
namespace dynmesh {

struct AdaptOptions {
  /// The length that edges shall have, in units of the positions; or, where that is 0, the vertex attribute
  /// (one floating-point number) that holds it.
  double target_length = 0;
  std::string size_attribute = {};
  /// Elements of less goodness (shape.h) are worked on until they have it; 0 to 1.
  double min_quality = 0.3;
  /// An edge of the boundary, or of a surface, whose two faces deviate from one plane by more is a feature;
  /// radians, 0 to pi.
  double feature_angle = 0.6981317007977318;  // 40 degrees
  int max_passes = 10;
  uint64_t max_elements = 200'000'000;  ///< beyond: no more splits
  uint64_t max_attempts = 20'000;       ///< operations that one step tries
};

enum class AdaptPhase { kCollapse, kSplit, kSwap, kSmooth, kImprove, kDone };

/// "collapse", "split", "swap", "smooth", "improve" or "done".
absl::string_view AdaptPhaseName(AdaptPhase phase);

/// Why an adaptation did not carry out an operation, besides the reasons that operators have (error.h): an
/// edge would get too long; a feature, or the form of the surface, would not be kept.
namespace reason {
inline constexpr char kEdgeTooLong[] = "EDGE_TOO_LONG";
inline constexpr char kWouldChangeForm[] = "WOULD_CHANGE_FORM";
}  // namespace reason

/// Why an adaptation ended.
enum class AdaptEnd {
  kConverged,    ///< the last pass split and collapsed fewer than one edge in 500
  kMaxPasses,    ///< the last pass still split and collapsed more
  kMaxElements,  ///< splits are missing
};

/// How good a mesh is.
struct MeshShape {
  uint64_t num_edges = 0;
  double min_length = 0, mean_length = 0, max_length = 0;
  /// Of the edges: those with 0.7 to 1.4 of the target length; 1 without edges.
  double share_in_band = 1;
  uint64_t num_elements = 0;
  /// Of all elements: SmallestAngle in radians, and Quality.
  double smallest_angle = 0;
  double least_quality = 0;
};

struct OperationCounts {
  uint64_t splits = 0, collapses = 0, swaps = 0, moves = 0;

  uint64_t all() const { return splits + collapses + swaps + moves; }
};

struct AdaptProgress {
  int pass = 0;  ///< from 1; that of the last pass while shapes are improved at the end
  AdaptPhase phase = AdaptPhase::kCollapse;
  uint64_t done = 0, total = 0;  ///< items of the phase; total may grow
  uint64_t num_elements = 0;
  double smallest_angle = 0;  ///< as measured after the last pass that ended
};

struct AdaptResult {
  AdaptEnd end = AdaptEnd::kConverged;
  int passes = 0;
  OperationCounts counts;
  /// Operations that were tried and not carried out, by reason. Moves that find no better place do not count.
  std::map<std::string, uint64_t> refusals;
  MeshShape before, after;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_ADAPT_ADAPT_H_
