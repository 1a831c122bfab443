#ifndef DYNMESH_CORE_SPATIAL_SPATIAL_SEARCH_H_
#define DYNMESH_CORE_SPATIAL_SPATIAL_SEARCH_H_

#include <cstddef>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/mesh/box.h"
#include "core/mesh/mesh.h"
#include "core/mesh/work_meter.h"
#include "core/spatial/ray.h"
#include "core/spatial/spatial_index.h"

namespace dynmesh {

struct NearVertex {
  VertexId vertex;
  double distance = 0;
};

struct RayHit {
  FaceId face;
  double t = 0;
};

/// Which faces a ray is stopped by. kSurface: faces with exactly one cell, and elements that are not
/// duplicates; as in a boundary surface. kAnyFace: all of them.
enum class RayTargets { kSurface, kAnyFace };
enum class RayHits { kFirst, kAll };

struct RayOptions {
  RayTargets targets = RayTargets::kSurface;
  RayHits hits = RayHits::kFirst;
};

/// Answers to questions about places, by way of an index, exactly: the index suggests, the mesh decides.
///
/// Everything that is looked at is charged as steps, geometric tests as some more, results as bytes; so among
/// a million boxes on one spot a search still ends when it is told to. Errors: the meter's. Arguments must be
/// finite. REQUIRES: the index has caught up with the mesh's revision. Thread safety: that of std::vector;
/// many may search with one index.
class SpatialSearch {
 public:
  SpatialSearch(const Mesh& mesh, const SpatialIndex& index, WorkMeter& meter)
      : mesh_(mesh), index_(index), meter_(meter) {}

  /// Live entities of the index's kind whose bounding box meets `box`, ascending: for vertices, those inside.
  absl::StatusOr<std::vector<Slot>> InBox(const Box& box);

  /// The `count` live vertices nearest to a point, or all if there are fewer, by ascending distance; equal
  /// distances by id. REQUIRES: an index of vertices.
  absl::StatusOr<std::vector<NearVertex>> NearestVertices(const Point& point, size_t count);

  /// The lowest id of the cells that contain a point (containment.h); invalid if none does. REQUIRES: an
  /// index of cells.
  absl::StatusOr<CellId> FindCell(const Point& point);

  /// The lowest id of the faces no farther than `tolerance` from a point; invalid if there is none.
  /// A tolerance of 0 means a billionth of the diagonal of each face's bounding box. REQUIRES: an index of
  /// faces, tolerance >= 0.
  absl::StatusOr<FaceId> FindFace(const Point& point, double tolerance);

  /// Where a ray hits faces, by ascending t, then by id. Quads are two triangles, cut along the diagonal of
  /// their first vertex; one that is warped may be hit twice. A ray through an edge or a vertex hits all
  /// faces there; faces that it lies in are not hit. Where coordinates, or differences between them, are
  /// above 1e140 or below 1e-140 in absolute value, but not 0, hits may go unseen. REQUIRES: an index of
  /// faces, a direction other than zero.
  absl::StatusOr<std::vector<RayHit>> CastRay(const Ray& ray, const RayOptions& options);

 private:
  absl::StatusOr<std::vector<Slot>> SomeNear(const Point& point, size_t count);

  const Mesh& mesh_;
  const SpatialIndex& index_;
  WorkMeter& meter_;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_SPATIAL_SPATIAL_SEARCH_H_
