#ifndef DYNMESH_CORE_SPATIAL_SPATIAL_INDEX_H_
#define DYNMESH_CORE_SPATIAL_SPATIAL_INDEX_H_

#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "absl/types/optional.h"
#include "core/mesh/box.h"
#include "core/mesh/mesh.h"
#include "core/mesh/work_meter.h"
#include "core/spatial/box_tree.h"
#include "core/spatial/frame.h"

namespace dynmesh {

/// Where the entities of one kind are: an R-tree of their bounding boxes that follows a mesh's edits.
///
///     SpatialIndex cells(EntityKind::kCell);
///     cells.CatchUp(mesh, WorkMeter::Unlimited());      // builds it
///     mesh.MoveVertex(...); mesh.Commit();
///     cells.CatchUp(mesh, WorkMeter::Unlimited());      // enters what changed
///     SpatialSearch(mesh, cells, WorkMeter::Unlimited()).InBox(box);
///
/// What changed is read off the mesh's stamps: slots born since the last time, and what is incident to
/// vertices that moved. These are entered once more, and what stood there before stays as a void entry: the
/// tree only suggests, and SpatialSearch asks the mesh itself. When many entities changed, half of the
/// entries are void, or the mesh is much more than it was or reaches much farther, the tree is packed anew,
/// so an edit costs O(log n) amortised. Boxes of faces are entered wider than they are (face_tolerance.h).
/// Memory: about 35 bytes an entry that was packed, up to some 220 one that was entered since; twice as much
/// again while it is packed. Cost of packing: O(n log n).
/// Thread safety: that of std::vector.
class SpatialIndex {
 public:
  using Entry = BoxTree::Entry;

  /// Bytes that an entry takes, for estimates before building.
  static constexpr size_t kTypicalEntryBytes = 36;

  explicit SpatialIndex(EntityKind kind) : kind_(kind) {}

  EntityKind kind() const { return kind_; }
  /// That of the mesh when this caught up with it; -1: it holds nothing.
  int64_t revision() const { return revision_; }
  size_t num_entries() const { return tree_.size(); }
  /// How often it was packed.
  uint64_t num_packings() const { return num_packings_; }
  size_t memory_bytes() const { return tree_.memory_bytes(); }

  /// Makes this an index of `mesh` at its revision. Each entity or incidence looked at is a step; packing is
  /// not interrupted. Errors: the meter's; this is as good as before then, and CatchUp may be tried again.
  /// REQUIRES: the mesh has no edit since its last commit, and is the one of before.
  absl::Status CatchUp(const Mesh& mesh, WorkMeter& meter);

  /// Calls visit for a superset of the live entities whose bounding box meets `box`: void entries come too,
  /// and some entities more than once. Errors: those of `visit` and the meter.
  absl::Status ForEachNear(const Box& box, WorkMeter& meter,
                           absl::FunctionRef<absl::Status(const Entry&)> visit) const {
    return tree_.ForEachMeeting(frame_.Round(box), meter, visit);
  }

  const Frame& frame() const { return frame_; }
  const BoxTree& tree() const { return tree_; }
  /// A box round all live entities; nullopt without any. It may be too large after edits.
  const absl::optional<Box>& bounds() const { return bounds_; }

 private:
  absl::Status Rebuild(const Mesh& mesh, WorkMeter& meter);
  absl::Status Enter(const Mesh& mesh, const std::vector<Slot>& slots, WorkMeter& meter);
  Entry EntryOf(const Frame& frame, const Box& box, Slot slot) const;
  bool Outgrows(const Mesh& mesh, const std::vector<Slot>& slots) const;

  EntityKind kind_;
  int64_t revision_ = -1;
  Frame frame_;
  absl::optional<Box> bounds_;
  absl::optional<Box> packed_bounds_;  ///< when the tree was packed
  size_t num_packed_ = 0;              ///< live entities then
  uint64_t num_packings_ = 0;
  BoxTree tree_;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_SPATIAL_SPATIAL_INDEX_H_
