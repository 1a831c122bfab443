#ifndef DYNMESH_CORE_EDIT_SMOOTH_H_
#define DYNMESH_CORE_EDIT_SMOOTH_H_

#include <cstdint>

#include "absl/status/status.h"
#include "absl/types/optional.h"
#include "core/edit/check_patch.h"
#include "core/edit/moving_star.h"
#include "core/edit/patch.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

enum class SmoothMethod : uint8_t {
  kLaplacian,  ///< towards the mean of the adjacent vertices, as far as the limits permit
  kGuarded,    ///< the same, unless the least quality of an element at the vertex would get worse
  kOptimizing  ///< uphill in that least quality, step by step
};

/// How a vertex is moved.
struct SmoothRule {
  SmoothMethod method = SmoothMethod::kGuarded;
  /// Of the way to the mean that is tried first; from 0 to 1. Of kOptimizing: of the first step, which is a
  /// quarter of the mean length of the vertex's edges.
  double factor = 1;
  /// Whether vertices on the boundary move too: towards the mean of their neighbours along the boundary.
  bool move_boundary = false;
  /// Whether vertices of surfaces and of the boundary stay in the plane across their mean normal, and those
  /// of the boundary of a surface on the line between their neighbours; those at sharp edges and corners,
  /// where a face leans away from the mean normal by more than 40 degrees, stay. So flat parts stay flat,
  /// straight ones straight, and others do not shrink.
  bool tangential = false;
};

/// Moves a vertex as `rule` says. A move that `limits` or the method do not permit is halved, at most
/// kMaxHalvings times; then the vertex stays, and the patch is empty. Attributes stay.
/// Errors: FAILED_PRECONDITION TOO_MANY_ELEMENTS. REQUIRES: `v` is live. Cost: linear in the vertex's star,
/// for each place that is tried: up to 5, up to 150 by kOptimizing.
absl::Status PlanSmoothVertex(const Mesh& mesh, VertexId v, const SmoothRule& rule, const PatchLimits& limits,
                              Patch& patch);
inline constexpr int kMaxHalvings = 4;

/// A star of more work (star.h) is not gathered to judge places for its vertex: that would take too much
/// memory.
inline constexpr uint64_t kMaxStarWork = 100'000;

/// The mean of the vertices that edges join to `v`; only by edges on the boundary when `v` lies on it.
/// nullopt without such edges. Cost: the vertex's edges.
absl::optional<Point> MeanOfNeighbours(const Mesh& mesh, VertexId v);

/// The mean length of a vertex's edges; 0 without any.
double MeanLengthOfEdges(const Mesh& mesh, VertexId v);

/// The directions in which a vertex may move: all, or those along a surface, or along its boundary, or none.
class Freedom {
 public:
  /// Everything.
  Freedom() = default;
  /// Along the surface, or the boundary of a volume, that `v` is a vertex of; else everything. On the
  /// boundary of a surface: along it. At a sharp edge or corner: nothing.
  static Freedom Along(const Mesh& mesh, VertexId v);

  /// The part of a step that is permitted.
  Point Restrict(const Point& step) const;

 private:
  enum class Kind { kAll, kPlane, kLine, kNone };

  Freedom(Kind kind, const Point& unit) : kind_(kind), unit_(unit) {}

  Kind kind_ = Kind::kAll;
  Point unit_ = {0, 0, 0};  ///< normal of the plane, direction of the line
};

/// Climbs from `from` in steps that raise the least measure of the star, from `step` on, which is halved
/// when none does, until less than a sixteenth of it is left. Returns where it came to.
Point Climb(const MovingStar& star, const Point& from, double step, const Freedom& freedom,
            ShapeMeasure measure);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_EDIT_SMOOTH_H_
