// The nearest vertices of a point.
//
// The tree finds some vertices that are near; the farthest of these bounds the distance of the answer, and
// all within that distance are then ranked. So the answer is exact and its order is defined, whatever the
// tree's single precision makes of distances and wherever it stops among equal ones.

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/container/btree_set.h"
#include "core/mesh/error.h"
#include "core/spatial/spatial_search.h"

namespace dynmesh {
namespace {

/// Squared distance, with range and bits to spare, and id.
using Ranked = std::pair<long double, Slot>;

Ranked Rank(const Mesh& mesh, Slot slot, const Point& point) {
  const Point& position = mesh.Position(VertexId(slot));
  long double sum = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const long double off = static_cast<long double>(position[axis]) - point[axis];
    sum += off * off;
  }
  return {sum, slot};
}

/// A box round all points whose squared distance from `point` is `square` or less.
Box Surround(const Point& point, long double square) {
  constexpr double kMax = std::numeric_limits<double>::max();
  const double radius = std::nextafter(static_cast<double>(std::sqrt(square)), HUGE_VAL);
  Box box;
  for (int axis = 0; axis < 3; ++axis) {
    box.low[axis] = std::max(std::nextafter(point[axis] - radius, -HUGE_VAL), -kMax);
    box.high[axis] = std::min(std::nextafter(point[axis] + radius, HUGE_VAL), kMax);
  }
  return box;
}

std::vector<NearVertex> ToNearVertices(const absl::btree_set<Ranked>& ranked) {
  std::vector<NearVertex> vertices;
  vertices.reserve(ranked.size());
  for (const auto& [square, slot] : ranked) {
    vertices.push_back({VertexId(slot), static_cast<double>(std::sqrt(square))});
  }
  return vertices;
}

}  // namespace

/// At least `count` live vertices, or all, each once.
absl::StatusOr<std::vector<Slot>> SpatialSearch::SomeNear(const Point& point, size_t count) {
  // Where a vertex stood before lies an entry that is void, unless it came back: then two are as good.
  const auto accept = [this](const SpatialIndex::Entry& entry) {
    const VertexId v(entry.slot);
    return mesh_.IsLive(v) && Meet(entry.box, index_.frame().Round(BoundsOf(mesh_, v)));
  };
  std::vector<Slot> slots;
  for (size_t wanted = count;; wanted *= 2) {
    wanted = std::min(wanted, index_.num_entries());
    if (wanted == 0) return slots;
    DYNMESH_RETURN_IF_ERROR(
        index_.tree().FindNearest({index_.frame().Round(point), wanted, accept}, meter_, slots));
    std::sort(slots.begin(), slots.end());
    slots.erase(std::unique(slots.begin(), slots.end()), slots.end());
    if (slots.size() >= count || wanted == index_.num_entries()) return slots;
  }
}

absl::StatusOr<std::vector<NearVertex>> SpatialSearch::NearestVertices(const Point& point, size_t count) {
  if (count == 0) return std::vector<NearVertex>();
  DYNMESH_ASSIGN_OR_RETURN(const std::vector<Slot> some, SomeNear(point, count));
  DYNMESH_RETURN_IF_ERROR(meter_.ChargeBytes(std::min(some.size(), count) * sizeof(NearVertex)));
  absl::btree_set<Ranked> nearest;
  const auto offer = [&](Slot slot) {
    const Ranked ranked = Rank(mesh_, slot, point);
    if (nearest.size() == count && ranked > *nearest.rbegin()) return;
    nearest.insert(ranked);
    if (nearest.size() > count) nearest.erase(std::prev(nearest.end()));
  };
  for (Slot slot : some) offer(slot);
  if (nearest.size() == count) {
    const Box box = Surround(point, nearest.rbegin()->first);
    DYNMESH_RETURN_IF_ERROR(index_.ForEachNear(box, meter_, [&](const SpatialIndex::Entry& entry) {
      if (mesh_.IsLive(VertexId(entry.slot))) offer(entry.slot);
      return absl::OkStatus();
    }));
  }
  return ToNearVertices(nearest);
}

}  // namespace dynmesh
