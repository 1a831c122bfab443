#ifndef DYNMESH_CORE_EDIT_MOVING_STAR_H_
#define DYNMESH_CORE_EDIT_MOVING_STAR_H_

#include <array>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/types/span.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

/// How good a shape is, from its points in template order; not negative.
using ShapeMeasure = absl::FunctionRef<double(ElementType, absl::Span<const Point>)>;

/// The elements at a vertex, gathered once, to judge many places for the vertex without changing the mesh.
///
///     MovingStar star(mesh, v);
///     const double now = star.LeastAt(mesh.Position(v), Quality);
///     if (star.LeastAt(better, Quality) > now) ...
///
/// Cost: to gather, linear in the star; to judge, a measure for each element. Thread safety: that of
/// std::vector.
class MovingStar {
 public:
  static constexpr double kTurnedOver = -1;

  MovingStar(const Mesh& mesh, VertexId v);

  /// The least measure of the elements if the vertex were at `position`, or some number below `enough` as
  /// soon as one is; kTurnedOver when an element that is not flat now would be flat or turned over.
  /// 1 without elements.
  double LeastAt(const Point& position, ShapeMeasure measure, double enough = kTurnedOver) const;

  /// Faces and cells at the vertex.
  size_t size() const { return shapes_.size(); }

 private:
  struct Shape {
    ElementType type;
    int corner;  ///< that moves
    std::array<Point, kMaxElementVertices> points;
    int orientation;  ///< of a cell as it is now
    Point normal;     ///< of a face as it is now; zero when it is flat
  };

  void Gather(const Mesh& mesh, EntityId element, VertexId v);
  static bool TurnsOver(const Shape& before, absl::Span<const Point> after);

  std::vector<Shape> shapes_;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_EDIT_MOVING_STAR_H_
