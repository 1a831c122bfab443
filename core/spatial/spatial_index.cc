#include "core/spatial/spatial_index.h"

#include <algorithm>
#include <utility>

#include "core/mesh/error.h"
#include "core/spatial/face_tolerance.h"

namespace dynmesh {
namespace {

// Packing an entity takes about an eighth of the time that entering it does.
constexpr size_t kPackedPerEntered = 8;
constexpr size_t kFewEntries = 1024;
// A tree that was packed for so much less is packed anew.
constexpr size_t kMaxGrowth = 2;
constexpr double kMaxStretch = 4;
constexpr Slot kFrameSample = 1024;

/// Which live entities of a kind may lie elsewhere than at a revision before.
class ChangeScan {
 public:
  ChangeScan(const Mesh& mesh, EntityKind kind, WorkMeter& meter) : mesh_(mesh), kind_(kind), meter_(meter) {}

  /// Puts them into `slots`, ascending; nullopt when they are more than `max_slots`, or might be.
  /// Cost: pages of stamps; changes and their incidences, up to about `max_slots`.
  absl::StatusOr<absl::optional<std::vector<Slot>>> Run(Stamp since, size_t max_slots) {
    max_slots_ = max_slots;
    const StampColumn& moved = mesh_.changed(EntityKind::kVertex);
    const StampColumn& births = mesh_.slots(kind_).births();
    DYNMESH_RETURN_IF_ERROR(ChargeScan(births, since));
    DYNMESH_RETURN_IF_ERROR(ChargeScan(moved, since));
    if (births.CountSince(since, 0, births.size()) > max_slots_ ||
        moved.CountSince(since, 0, moved.size()) > max_slots_) {
      return absl::optional<std::vector<Slot>>();
    }
    births.ForEachSince(since, 0, births.size(), [this](Slot slot) { Mark(slot); });
    DYNMESH_RETURN_IF_ERROR(MarkMoved(since));
    if (marked_.size() > max_slots_) return absl::optional<std::vector<Slot>>();
    std::vector<Slot> slots;
    marked_.ListMembers(slots);
    return absl::make_optional(std::move(slots));
  }

 private:
  absl::Status ChargeScan(const StampColumn& stamps, Stamp since) {
    return meter_.ChargeSteps(stamps.size() / StampColumn::kPageSlots + stamps.BoundSince(since));
  }

  absl::Status MarkMoved(Stamp since) {
    const StampColumn& moved = mesh_.changed(EntityKind::kVertex);
    std::vector<VertexId> vertices;
    moved.ForEachSince(since, 0, moved.size(), [&](Slot slot) {
      if (mesh_.IsLive(VertexId(slot))) vertices.emplace_back(slot);
    });
    for (VertexId v : vertices) {
      if (marked_.size() > max_slots_) break;
      DYNMESH_RETURN_IF_ERROR(MarkIncident(v));
    }
    return absl::OkStatus();
  }

  absl::Status MarkIncident(VertexId v) {
    if (kind_ == EntityKind::kVertex) {
      Mark(v.slot());
      return absl::OkStatus();
    }
    for (EdgeId e : mesh_.IncidentEdges(v)) {
      if (marked_.size() > max_slots_) break;
      DYNMESH_RETURN_IF_ERROR(MarkIncident(e));
    }
    return absl::OkStatus();
  }

  absl::Status MarkIncident(EdgeId e) {
    DYNMESH_RETURN_IF_ERROR(meter_.ChargeSteps(1));
    if (kind_ == EntityKind::kEdge) {
      Mark(e.slot());
      return absl::OkStatus();
    }
    for (FaceId f : mesh_.IncidentFaces(e)) {
      if (marked_.size() > max_slots_) break;
      DYNMESH_RETURN_IF_ERROR(meter_.ChargeSteps(1));
      if (kind_ == EntityKind::kFace) {
        Mark(f.slot());
      } else {
        DYNMESH_RETURN_IF_ERROR(MarkCells(f));
      }
    }
    return absl::OkStatus();
  }

  absl::Status MarkCells(FaceId f) {
    for (CellId c : mesh_.IncidentCells(f)) {
      DYNMESH_RETURN_IF_ERROR(meter_.ChargeSteps(1));
      Mark(c.slot());
    }
    return absl::OkStatus();
  }

  void Mark(Slot slot) {
    if (mesh_.IsLive({kind_, slot})) marked_.Set(slot);
  }

  const Mesh& mesh_;
  const EntityKind kind_;
  WorkMeter& meter_;
  size_t max_slots_ = 0;
  BitSet marked_;
};

/// Calls fn(slot) for each live entity, a step each.
template <typename Fn>
absl::Status ForEachLive(const BitSet& live, WorkMeter& meter, Fn fn) {
  std::array<Slot, 1024> part;
  for (Slot next = 0;;) {
    const size_t count = live.Collect(next, part.data(), part.size());
    if (count == 0) return absl::OkStatus();
    DYNMESH_RETURN_IF_ERROR(meter.ChargeSteps(count));
    for (size_t i = 0; i < count; ++i) fn(part[i]);
    next = part[count - 1] + 1;
  }
}

double LongestSide(const Box& box) {
  double longest = 0;
  for (int axis = 0; axis < 3; ++axis) longest = std::max(longest, box.high[axis] - box.low[axis]);
  return longest;
}

/// A frame in which most boxes keep many bits: one for the middle half of a sample, which a few entities that
/// lie far away do not sway. REQUIRES: there are live entities, and `bounds` is round them.
Frame FrameOf(const Mesh& mesh, EntityKind kind, const Box& bounds) {
  const BitSet& live = mesh.slots(kind).live();
  std::array<std::vector<double>, 3> places;
  const Slot stride = static_cast<Slot>(mesh.slots(kind).limit() / kFrameSample + 1);
  for (Slot next = 0, found; live.Collect(next, &found, 1) > 0;
       next = std::max(found, next + stride - 1) + 1) {
    const Box box = BoundsOf(mesh, {kind, found});
    for (int axis = 0; axis < 3; ++axis) places[axis].push_back(box.low[axis] / 2 + box.high[axis] / 2);
  }
  Box middle;
  for (int axis = 0; axis < 3; ++axis) {
    std::sort(places[axis].begin(), places[axis].end());
    middle.low[axis] = places[axis][places[axis].size() / 4];
    middle.high[axis] = places[axis][places[axis].size() * 3 / 4];
  }
  return Frame(middle, bounds);
}

void Include(const Box& box, absl::optional<Box>& bounds) {
  if (!bounds.has_value()) bounds = box;
  Include(box.low, *bounds);
  Include(box.high, *bounds);
}

}  // namespace

absl::Status SpatialIndex::CatchUp(const Mesh& mesh, WorkMeter& meter) {
  if (revision_ == mesh.revision()) return absl::OkStatus();
  if (revision_ < 0) return Rebuild(mesh, meter);
  const size_t num_live = mesh.NumLive(kind_);
  const size_t many = kFewEntries + num_live / kPackedPerEntered;
  DYNMESH_ASSIGN_OR_RETURN(const auto changes,
                           ChangeScan(mesh, kind_, meter).Run(static_cast<Stamp>(revision_), many));
  const bool worn = !changes.has_value() || tree_.size() + changes->size() > 2 * (num_live + kFewEntries);
  if (worn || Outgrows(mesh, *changes)) return Rebuild(mesh, meter);
  const int64_t before = std::exchange(revision_, -1);  // a tree that ran out of memory half way is void
  const absl::Status entered = Enter(mesh, *changes, meter);
  revision_ = entered.ok() ? mesh.revision() : before;
  return entered;
}

absl::Status SpatialIndex::Enter(const Mesh& mesh, const std::vector<Slot>& slots, WorkMeter& meter) {
  for (Slot slot : slots) {
    DYNMESH_RETURN_IF_ERROR(meter.ChargeSteps(1));
    const Box box = BoundsOf(mesh, {kind_, slot});
    Include(box, bounds_);
    tree_.Insert(EntryOf(frame_, box, slot));
  }
  return absl::OkStatus();
}

SpatialIndex::Entry SpatialIndex::EntryOf(const Frame& frame, const Box& box, Slot slot) const {
  return {frame.Round(kind_ == EntityKind::kFace ? WidenByTolerance(box) : box), slot};
}

/// Whether the mesh with `slots` is much more than when the tree was packed, or reaches much farther. As the
/// bounds never shrink between packings, that cannot be had again and again by moving to and fro.
bool SpatialIndex::Outgrows(const Mesh& mesh, const std::vector<Slot>& slots) const {
  if (mesh.NumLive(kind_) > kMaxGrowth * num_packed_) return true;
  absl::optional<Box> bounds = bounds_;
  for (Slot slot : slots) Include(BoundsOf(mesh, {kind_, slot}), bounds);
  return bounds.has_value() && packed_bounds_.has_value() &&
         LongestSide(*bounds) / kMaxStretch > LongestSide(*packed_bounds_);
}

absl::Status SpatialIndex::Rebuild(const Mesh& mesh, WorkMeter& meter) {
  const BitSet& live = mesh.slots(kind_).live();
  absl::optional<Box> bounds;
  DYNMESH_RETURN_IF_ERROR(ForEachLive(live, meter, [&](Slot slot) {
    Include(BoundsOf(mesh, {kind_, slot}), bounds);
  }));
  const Frame frame = bounds.has_value() ? FrameOf(mesh, kind_, *bounds) : Frame();
  std::vector<Entry> entries;
  entries.reserve(live.size());
  DYNMESH_RETURN_IF_ERROR(ForEachLive(live, meter, [&](Slot slot) {
    entries.push_back(EntryOf(frame, BoundsOf(mesh, {kind_, slot}), slot));
  }));
  revision_ = -1;  // until the tree is there: memory may run out
  tree_.Build(entries);
  frame_ = frame;
  bounds_ = packed_bounds_ = bounds;
  num_packed_ = mesh.NumLive(kind_);
  ++num_packings_;
  revision_ = mesh.revision();
  return absl::OkStatus();
}

}  // namespace dynmesh
