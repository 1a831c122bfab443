#include "core/spatial/spatial_search.h"

#include <cmath>

#include "core/mesh/bit_set.h"
#include "core/mesh/error.h"
#include "core/spatial/containment.h"
#include "core/spatial/face_tolerance.h"

namespace dynmesh {
namespace {

Box Widen(const Point& point, double by) {
  Box box;
  for (int axis = 0; axis < 3; ++axis) {
    box.low[axis] = std::nextafter(point[axis] - by, -HUGE_VAL);
    box.high[axis] = std::nextafter(point[axis] + by, HUGE_VAL);
  }
  return box;
}

}  // namespace

absl::StatusOr<std::vector<Slot>> SpatialSearch::InBox(const Box& box) {
  const EntityKind kind = index_.kind();
  BitSet found;
  DYNMESH_RETURN_IF_ERROR(index_.ForEachNear(box, meter_, [&](const SpatialIndex::Entry& entry) {
    const EntityId id(kind, entry.slot);
    if (found.Test(id.slot) || !mesh_.IsLive(id) || !Meet(BoundsOf(mesh_, id), box)) return absl::OkStatus();
    found.Set(id.slot);
    return meter_.ChargeBytes(sizeof(Slot));
  }));
  DYNMESH_RETURN_IF_ERROR(meter_.ChargeSteps(mesh_.slots(kind).limit() / 4096));
  std::vector<Slot> slots;
  found.ListMembers(slots);
  return slots;
}

absl::StatusOr<CellId> SpatialSearch::FindCell(const Point& point) {
  CellId lowest;  // an invalid id is higher than all
  const auto visit = [&](const SpatialIndex::Entry& entry) {
    const CellId c(entry.slot);
    if (!(c < lowest) || !mesh_.IsLive(c) || !Contains(BoundsOf(mesh_, c), point)) return absl::OkStatus();
    DYNMESH_RETURN_IF_ERROR(meter_.ChargeSteps(StepsToContain(mesh_.Type(c))));
    if (ContainsPoint(mesh_, c, point)) lowest = c;
    return absl::OkStatus();
  };
  DYNMESH_RETURN_IF_ERROR(index_.ForEachNear({point, point}, meter_, visit));
  return lowest;
}

absl::StatusOr<FaceId> SpatialSearch::FindFace(const Point& point, double tolerance) {
  FaceId lowest;
  const auto visit = [&](const SpatialIndex::Entry& entry) {
    const FaceId f(entry.slot);
    if (!(f < lowest) || !mesh_.IsLive(f)) return absl::OkStatus();
    DYNMESH_RETURN_IF_ERROR(meter_.ChargeSteps(kStepsToMeasure));
    const double limit = tolerance > 0 ? tolerance : FaceTolerance(BoundsOf(mesh_, f));
    if (DistanceTo(mesh_, f, point) <= limit) lowest = f;
    return absl::OkStatus();
  };
  // Without a tolerance the boxes in the index are as wide as they have to be.
  const Box near = tolerance > 0 ? Widen(point, tolerance) : Box{point, point};
  DYNMESH_RETURN_IF_ERROR(index_.ForEachNear(near, meter_, visit));
  return lowest;
}

}  // namespace dynmesh
