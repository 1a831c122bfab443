#include "tests/core/spatial/places.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/spatial/containment.h"

namespace dynmesh::testing {
namespace {

std::string Print(const Point& p) {
  std::ostringstream out;
  out.precision(17);
  out << "(" << p[0] << ", " << p[1] << ", " << p[2] << ")";
  return out.str();
}

std::vector<Point> TrianglesOf(const Mesh& mesh, FaceId f) {
  std::vector<Point> corners;
  const auto v = mesh.Vertices(f);
  for (size_t k = 2; k < v.size(); ++k) {
    for (VertexId corner : {v[0], v[k - 1], v[k]}) corners.push_back(mesh.Position(corner));
  }
  return corners;
}

/// Compares t with room for what depends on which triangle of a quad gave it.
void ExpectHits(const std::vector<RayHit>& hits, const std::vector<RayHit>& expected) {
  ASSERT_EQ(hits.size(), expected.size());
  for (size_t i = 0; i < hits.size(); ++i) {
    EXPECT_EQ(hits[i].face, expected[i].face);
    EXPECT_EQ(hits[i].t, expected[i].t);
  }
}

}  // namespace

std::vector<Slot> BruteInBox(const Mesh& mesh, EntityKind kind, const Box& box) {
  std::vector<Slot> found;
  mesh.slots(kind).live().ForEach([&](Slot slot) {
    std::vector<VertexId> vertices = {VertexId(slot)};
    if (kind != EntityKind::kVertex) {
      const auto span = mesh.VerticesOf({kind, slot});
      vertices.assign(span.begin(), span.end());
    }
    for (int axis = 0; axis < 3; ++axis) {
      const auto outside = [&](auto beyond) {
        return std::all_of(vertices.begin(), vertices.end(),
                           [&](VertexId v) { return beyond(mesh.Position(v)[axis]); });
      };
      if (outside([&](double x) { return x < box.low[axis]; }) ||
          outside([&](double x) { return x > box.high[axis]; })) {
        return;
      }
    }
    found.push_back(slot);
  });
  return found;
}

std::vector<NearVertex> BruteNearest(const Mesh& mesh, const Point& point, size_t count) {
  std::vector<std::pair<long double, Slot>> all;
  mesh.slots(EntityKind::kVertex).live().ForEach([&](Slot slot) {
    long double square = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const long double off = static_cast<long double>(mesh.Position(VertexId(slot))[axis]) - point[axis];
      square += off * off;
    }
    all.emplace_back(square, slot);
  });
  std::sort(all.begin(), all.end());
  all.resize(std::min(all.size(), count));
  std::vector<NearVertex> nearest;
  for (const auto& [square, slot] : all) {
    nearest.push_back({VertexId(slot), static_cast<double>(std::sqrt(square))});
  }
  return nearest;
}

CellId BruteFindCell(const Mesh& mesh, const Point& point) {
  CellId found;
  mesh.slots(EntityKind::kCell).live().ForEach([&](Slot slot) {
    if (!found.valid() && Contains(BoundsOf(mesh, CellId(slot)), point) &&
        ContainsPoint(mesh, CellId(slot), point)) {
      found = CellId(slot);
    }
  });
  return found;
}

FaceId BruteFindFace(const Mesh& mesh, const Point& point, double tolerance) {
  FaceId found;
  mesh.slots(EntityKind::kFace).live().ForEach([&](Slot slot) {
    const Box box = BoundsOf(mesh, FaceId(slot));
    const double diagonal =
        std::hypot(box.high[0] - box.low[0], box.high[1] - box.low[1], box.high[2] - box.low[2]);
    const double reach = tolerance > 0 ? tolerance : 1e-9 * diagonal;
    if (!found.valid() && DistanceTo(mesh, FaceId(slot), point) <= reach) found = FaceId(slot);
  });
  return found;
}

std::vector<RayHit> BruteHits(const Mesh& mesh, const Ray& ray, RayTargets targets) {
  std::vector<RayHit> hits;
  const RayShear shear(ray);
  mesh.slots(EntityKind::kFace).live().ForEach([&](Slot slot) {
    const FaceId f(slot);
    const bool surface =
        mesh.Boundary(EntityKind::kFace).Test(slot) || (mesh.IsElement(f) && !mesh.IsDuplicate(f));
    if (targets == RayTargets::kSurface && !surface) return;
    const std::vector<Point> corners = TrianglesOf(mesh, f);
    double before = -1;
    for (size_t i = 0; i < corners.size(); i += 3) {
      const auto t = shear.Hit({corners[i], corners[i + 1], corners[i + 2]});
      if (!t.has_value() || (before >= 0 && std::abs(*t - before) <= 1e-12 * std::max(*t, before))) continue;
      hits.push_back({f, *t});
      before = *t;
    }
  });
  for (RayHit& hit : hits) hit.t = shear.ToRay(hit.t);
  std::sort(hits.begin(), hits.end(),
            [](const RayHit& a, const RayHit& b) { return std::pair(a.t, a.face) < std::pair(b.t, b.face); });
  return hits;
}

RandomPlaces::RandomPlaces(const Mesh& mesh, uint32_t seed) : rng_(seed), box_{{-1, -1, -1}, {1, 1, 1}} {
  mesh.slots(EntityKind::kVertex).live().ForEach([&](Slot slot) {
    vertices_.push_back(mesh.Position(VertexId(slot)));
  });
  if (const auto bounds = BoundsOf(mesh)) box_ = *bounds;
}

Point RandomPlaces::AnyPoint() {
  Point point;
  const int manner = Uniform(4);
  for (int axis = 0; axis < 3; ++axis) {
    if (manner > 1 && !vertices_.empty()) {
      point[axis] = vertices_[Uniform(vertices_.size())][axis];
    } else {
      const double side = box_.high[axis] - box_.low[axis];
      point[axis] =
          std::uniform_real_distribution<>(box_.low[axis] - side / 8, box_.high[axis] + side / 8)(rng_);
    }
  }
  return manner == 3 && !vertices_.empty() ? vertices_[Uniform(vertices_.size())] : point;
}

Box RandomPlaces::AnyBox() {
  const Point point = AnyPoint();
  Box box{point, point};
  Include(AnyPoint(), box);
  return box;
}

Ray RandomPlaces::AnyRay() {
  constexpr double kAxes[][3] = {{1, 0, 0}, {0, -1, 0}, {0, 0, 1}, {1, 1, 0}, {-1, 1, 1}};
  const Point origin = AnyPoint();
  Point direction;
  if (Uniform(3) == 0) {
    const auto& axis = kAxes[Uniform(5)];
    direction = {axis[0], axis[1], axis[2]};
  } else {
    const Point to = AnyPoint();
    direction = {to[0] - origin[0], to[1] - origin[1], to[2] - origin[2]};
  }
  if (direction == Point{}) direction = {0, 0, -1};
  return {origin, direction};
}

void ExpectSameAnswers(const Mesh& mesh, const std::vector<SpatialIndex>& indices, uint32_t seed, int n) {
  RandomPlaces places(mesh, seed);
  WorkMeter& meter = WorkMeter::Unlimited();
  for (int i = 0; i < n; ++i) {
    const Box box = places.AnyBox();
    for (EntityKind kind : kEntityKinds) {
      EXPECT_EQ(*SpatialSearch(mesh, indices[Dimension(kind)], meter).InBox(box), BruteInBox(mesh, kind, box))
          << EntityKindName(kind) << " in " << Print(box.low) << " to " << Print(box.high);
    }
    const Point point = places.AnyPoint();
    SCOPED_TRACE(Print(point));
    const size_t count = 1 + i % 9;
    const auto nearest = *SpatialSearch(mesh, indices[0], meter).NearestVertices(point, count);
    const auto expected = BruteNearest(mesh, point, count);
    ASSERT_EQ(nearest.size(), expected.size());
    for (size_t k = 0; k < nearest.size(); ++k) {
      EXPECT_EQ(nearest[k].vertex, expected[k].vertex);
      EXPECT_EQ(nearest[k].distance, expected[k].distance);
    }
    EXPECT_EQ(*SpatialSearch(mesh, indices[3], meter).FindCell(point), BruteFindCell(mesh, point));
    for (double tolerance : {0.0, 0.05}) {
      EXPECT_EQ(*SpatialSearch(mesh, indices[2], meter).FindFace(point, tolerance),
                BruteFindFace(mesh, point, tolerance));
    }
    const Ray ray = places.AnyRay();
    SCOPED_TRACE("ray from " + Print(ray.origin) + " along " + Print(ray.direction));
    SpatialSearch faces(mesh, indices[2], meter);
    for (RayTargets targets : {RayTargets::kSurface, RayTargets::kAnyFace}) {
      auto hits = BruteHits(mesh, ray, targets);
      ExpectHits(*faces.CastRay(ray, {targets, RayHits::kAll}), hits);
      if (hits.size() > 1) hits.resize(1);
      ExpectHits(*faces.CastRay(ray, {targets, RayHits::kFirst}), hits);
    }
  }
}

std::vector<SpatialIndex> NewIndices() {
  std::vector<SpatialIndex> indices;
  for (EntityKind kind : kEntityKinds) indices.emplace_back(kind);
  return indices;
}

void CatchUpAll(const Mesh& mesh, std::vector<SpatialIndex>& indices) {
  for (SpatialIndex& index : indices) {
    const absl::Status caught_up = index.CatchUp(mesh, WorkMeter::Unlimited());
    EXPECT_TRUE(caught_up.ok()) << caught_up;
    EXPECT_EQ(index.revision(), mesh.revision());
  }
}

}  // namespace dynmesh::testing
