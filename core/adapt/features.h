#ifndef DYNMESH_CORE_ADAPT_FEATURES_H_
#define DYNMESH_CORE_ADAPT_FEATURES_H_

#include <vector>

#include "core/mesh/bit_set.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

/// What a vertex lies on; the value is its dimension. It may move, or be collapsed, only within that.
enum class Stratum { kCorner = 0, kLine = 1, kSurface = 2, kVolume = 3 };

/// The edges that give a mesh its form, which an adaptation keeps: of a surface the boundary, non-manifold
/// edges, and creases; of the boundary of a volume the same.
///
///     crease: two faces that deviate from one plane by more than the feature angle
///     corner: a vertex where not just two feature edges meet, or these turn by more than that angle
///
/// Found once and then carried along through splits and collapses, so that no crease is lost bit by bit.
/// Thread safety: that of std::vector.
class Features {
 public:
  /// Cost: edges. `angle`: radians.
  Features(const Mesh& mesh, double angle);

  bool Has(EdgeId e) const { return marks_.Test(e.slot()); }
  /// Cost: the vertex's edges.
  Stratum StratumOf(const Mesh& mesh, VertexId v) const;

  /// What stands beside `v` on the line, apart from `other`; invalid when `v` is a corner.
  VertexId NextOnLine(const Mesh& mesh, VertexId v, VertexId other) const;

  /// Looks for features again, after others have edited the mesh; edges that were there at revision `since`
  /// and are features stay so.
  void Refresh(const Mesh& mesh, int64_t since);

  /// An edge was split: its halves are at `middle`. `e` is gone.
  void Split(const Mesh& mesh, EdgeId e, const std::array<VertexId, 2>& ends, VertexId middle);

  /// Forgets the feature edges of a vertex that is about to be collapsed; returns their other ends. What
  /// follows is Mark() for the vertex into which it was, or, if it was not, for the same again.
  std::vector<VertexId> TakeFrom(const Mesh& mesh, VertexId v);
  /// Marks the edges between a vertex and others, where there are such.
  void Mark(const Mesh& mesh, VertexId v, const std::vector<VertexId>& others);

 private:
  bool IsFeature(const Mesh& mesh, EdgeId e) const;

  double cos_angle_;
  BitSet marks_;  ///< edges
};

/// Whether a face belongs to the surface that a mesh is, or to the boundary of its cells.
inline bool IsOfSurface(const Mesh& mesh, FaceId f) {
  return mesh.IncidentCells(f).empty() || mesh.IsOnBoundary(f);
}

}  // namespace dynmesh

#endif  // DYNMESH_CORE_ADAPT_FEATURES_H_
