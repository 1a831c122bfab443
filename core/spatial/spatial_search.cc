#include "core/spatial/spatial_search.h"

#include <cmath>

#include "core/mesh/bit_set.h"
#include "core/mesh/error.h"
#include "core/spatial/containment.h"
#include "core/spatial/vector.h"

namespace dynmesh {
namespace {

constexpr double kRelativeTolerance = 1e-9;

double DiagonalOf(const Box& box) {
  const Point diagonal = box.high - box.low;
  return std::sqrt(Dot(diagonal, diagonal));
}

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
  DYNMESH_RETURN_IF_ERROR(index_.ForEachNear({point, point}, meter_, [&](const SpatialIndex::Entry& entry) {
    const CellId c(entry.slot);
    if (c < lowest && mesh_.IsLive(c) && Contains(BoundsOf(mesh_, c), point) &&
        ContainsPoint(mesh_, c, point)) {
      lowest = c;
    }
    return absl::OkStatus();
  }));
  return lowest;
}

absl::StatusOr<FaceId> SpatialSearch::FindFace(const Point& point, double tolerance) {
  FaceId lowest;
  if (!index_.bounds().has_value()) return lowest;
  const double reach = tolerance > 0 ? tolerance : kRelativeTolerance * DiagonalOf(*index_.bounds());
  const auto visit = [&](const SpatialIndex::Entry& entry) {
    const FaceId f(entry.slot);
    if (f < lowest && mesh_.IsLive(f)) {
      const double limit = tolerance > 0 ? tolerance : kRelativeTolerance * DiagonalOf(BoundsOf(mesh_, f));
      if (DistanceTo(mesh_, f, point) <= limit) lowest = f;
    }
    return absl::OkStatus();
  };
  DYNMESH_RETURN_IF_ERROR(index_.ForEachNear(Widen(point, reach), meter_, visit));
  return lowest;
}

}  // namespace dynmesh
