#ifndef DYNMESH_CORE_ADAPT_SURFACE_STAR_H_
#define DYNMESH_CORE_ADAPT_SURFACE_STAR_H_

#include <array>
#include <vector>

#include "absl/types/optional.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

/// The triangles round a vertex that belong to a surface, or to the boundary of cells, to judge how another
/// place for the vertex would change the form of that surface. Cost: to gather, linear in the vertex's star;
/// else linear in the triangles. Thread safety: that of std::vector.
class SurfaceStar {
 public:
  SurfaceStar(const Mesh& mesh, VertexId v);

  /// Whether no triangle would turn by more than the angle of that cosine if the vertex were at `place`, but
  /// for triangles of `collapsed`, which would vanish.
  bool TurnsAtMost(double cos_angle, const Point& place, VertexId collapsed = {}) const;

  /// The point of the triangles that lies over or under `place` along the mean normal; nullopt where none
  /// does. Flat parts stay flat so.
  absl::optional<Point> Project(const Point& place) const;

 private:
  struct Triangle {
    std::array<VertexId, 2> vertices;  ///< after `v`, in the order of the face
    std::array<Point, 2> points;
    Point normal;  ///< twice the area vector
  };

  void Gather(const Mesh& mesh, FaceId f, VertexId v);
  Point MeanNormal() const;

  Point at_;
  std::vector<Triangle> triangles_;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_ADAPT_SURFACE_STAR_H_
