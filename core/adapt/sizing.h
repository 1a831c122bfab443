#ifndef DYNMESH_CORE_ADAPT_SIZING_H_
#define DYNMESH_CORE_ADAPT_SIZING_H_

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/adapt/adapt.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

/// Edges longer than kLong of the target are split, shorter ones than kShort collapsed: halves of what is
/// split are not short, and what a collapse stretches is not long.
inline constexpr double kLong = 4.0 / 3;
inline constexpr double kShort = 4.0 / 5;

/// How long edges shall be: the same everywhere, or a vertex attribute, of which an edge takes the mean of
/// its ends. Thread safety: that of std::vector.
class Sizing {
 public:
  /// Errors: INVALID_ARGUMENT BAD_ARGUMENT unless there is just one of both, and it is positive everywhere
  /// (metadata kind, ids); NOT_FOUND UNKNOWN_ATTRIBUTE.
  static absl::StatusOr<Sizing> Make(const Mesh& mesh, const AdaptOptions& options);

  /// Length of an edge, or of one between two vertices, over what it shall be. 1 where a vertex has a target
  /// that is not positive, as vertices that others add meanwhile may: such edges are left alone.
  double RatioOf(const Mesh& mesh, EdgeId e) const;
  double RatioBetween(const Mesh& mesh, VertexId a, VertexId b) const;

 private:
  explicit Sizing(double length) : length_(length) {}

  double TargetAt(const Mesh& mesh, VertexId v) const;
  absl::Status CheckAttribute(const Mesh& mesh) const;

  double length_ = 0;
  int column_ = -1;  ///< of the attribute; -1: length_
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_ADAPT_SIZING_H_
