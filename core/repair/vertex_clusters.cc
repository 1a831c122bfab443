#include "core/repair/vertex_clusters.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "absl/container/flat_hash_map.h"
#include "core/mesh/error.h"

namespace dynmesh {
namespace {

double Distance(const Point& a, const Point& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);  // without overflow or underflow
}

/// The largest coordinate, without its sign.
double Extent(const Mesh& mesh) {
  double extent = 0;
  mesh.slots(EntityKind::kVertex).live().ForEach([&](Slot v) {
    for (double x : mesh.Position(VertexId(v))) extent = std::max(extent, std::abs(x));
  });
  return extent;
}

/// The vertices that stay, by cubes of a grid. A cube is no smaller than the tolerance, so that those within
/// it lie in the cube or beside it; nor so small that its number would not be exact.
class VertexGrid {
 public:
  /// What a vertex takes here.
  static constexpr uint64_t kBytesOfVertex = 64;

  VertexGrid(RepairWork& work, double tolerance)
      : work_(work),
        mesh_(work.mesh()),
        tolerance_(tolerance),
        side_(std::max({tolerance, std::ldexp(Extent(mesh_), -40), std::numeric_limits<double>::min()})),
        next_(mesh_.slots(EntityKind::kVertex).limit()) {}

  /// The nearest within the tolerance; an invalid id if there is none.
  absl::StatusOr<VertexId> FindNear(VertexId v) {
    const Cube center = CubeOf(v);
    Nearest nearest;
    for (int64_t x = -1; x <= 1; ++x) {
      for (int64_t y = -1; y <= 1; ++y) {
        for (int64_t z = -1; z <= 1; ++z) {
          DYNMESH_RETURN_IF_ERROR(LookInto({center[0] + x, center[1] + y, center[2] + z}, v, nearest));
        }
      }
    }
    return nearest.vertex;
  }

  void Add(VertexId v) {
    VertexId& first = cubes_[CubeOf(v)];
    next_[v.slot()] = first;
    first = v;
  }

 private:
  using Cube = std::array<int64_t, 3>;

  struct Nearest {
    VertexId vertex;
    double distance = std::numeric_limits<double>::infinity();
  };

  Cube CubeOf(VertexId v) const {
    Cube cube;
    for (int axis = 0; axis < 3; ++axis) {
      cube[axis] = static_cast<int64_t>(std::floor(mesh_.Position(v)[axis] / side_));
    }
    return cube;
  }

  absl::Status LookInto(const Cube& cube, VertexId v, Nearest& nearest) {
    DYNMESH_RETURN_IF_ERROR(work_.Charge(1));
    const auto it = cubes_.find(cube);
    if (it == cubes_.end()) return absl::OkStatus();
    for (VertexId other = it->second; other.valid(); other = next_[other.slot()]) {
      DYNMESH_RETURN_IF_ERROR(work_.Charge(1));
      const double distance = Distance(mesh_.Position(v), mesh_.Position(other));
      const bool nearer =
          distance < nearest.distance || (distance == nearest.distance && other < nearest.vertex);
      if (distance <= tolerance_ && nearer) nearest = {other, distance};
    }
    return absl::OkStatus();
  }

  RepairWork& work_;
  const Mesh& mesh_;
  const double tolerance_;
  const double side_;
  absl::flat_hash_map<Cube, VertexId> cubes_;  ///< the latest vertex of each
  std::vector<VertexId> next_;                 ///< by slot: another vertex of the same cube
};

}  // namespace

absl::StatusOr<std::vector<VertexId>> ClusterVertices(RepairWork& work, double tolerance) {
  const Mesh& mesh = work.mesh();
  const Slot limit = mesh.slots(EntityKind::kVertex).limit();
  DYNMESH_RETURN_IF_ERROR(work.ChargeBytes(limit * VertexGrid::kBytesOfVertex));
  VertexGrid grid(work, tolerance);
  std::vector<VertexId> becomes(limit);
  for (Slot slot = 0; slot < limit; ++slot) {
    if (!mesh.IsLive(VertexId(slot))) continue;
    const VertexId v(slot);
    DYNMESH_ASSIGN_OR_RETURN(const VertexId near, grid.FindNear(v));
    becomes[slot] = near.valid() ? near : v;
    if (!near.valid()) grid.Add(v);
  }
  return becomes;
}

}  // namespace dynmesh
