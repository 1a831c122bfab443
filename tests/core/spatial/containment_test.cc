#include "core/spatial/containment.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "core/spatial/ray.h"
#include "core/mesh/vector.h"
#include "tests/support/meshes.h"

namespace dynmesh::testing {
namespace {

/// How often the faces of a cell go round a point, from the solid angles of their triangles.
int WindingNumber(const Mesh& mesh, CellId c, const Point& p) {
  const ElementTemplate& shape = TemplateOf(mesh.Type(c));
  double angle = 0;
  for (int i = 0; i < shape.num_faces; ++i) {
    const auto v = mesh.Vertices(mesh.Faces(c)[i].face());
    const auto corner = [&](int k) {
      return mesh.Vertices(c)[shape.faces[i].vertices[k % shape.faces[i].size]];
    };
    int at = 0;
    while (corner(at) != v[0]) ++at;
    const double direction = corner(at + 1) == v[1] ? 1 : -1;
    for (size_t k = 2; k < v.size(); ++k) {
      const Point a = mesh.Position(v[0]) - p, b = mesh.Position(v[k - 1]) - p, d = mesh.Position(v[k]) - p;
      const double la = std::sqrt(Dot(a, a)), lb = std::sqrt(Dot(b, b)), ld = std::sqrt(Dot(d, d));
      const double base = la * lb * ld + Dot(a, b) * ld + Dot(b, d) * la + Dot(d, a) * lb;
      angle += direction * 2 * std::atan2(Dot(a, Cross(b, d)), base);
    }
  }
  return std::lround(angle / (4 * std::numbers::pi));
}

Point RandomPoint(std::mt19937& rng, double low, double high) {
  std::uniform_real_distribution<> uniform(low, high);
  return {uniform(rng), uniform(rng), uniform(rng)};
}

void Jitter(Mesh& mesh, const Box& box, std::mt19937& rng, double by) {
  std::uniform_real_distribution<> uniform(-by, by);
  mesh.slots(EntityKind::kVertex).live().ForEach([&](Slot slot) {
    Point position = mesh.Position(VertexId(slot));
    for (int axis = 0; axis < 3; ++axis) {
      const bool on_side = position[axis] == box.low[axis] || position[axis] == box.high[axis];
      if (!on_side) position[axis] += uniform(rng);
    }
    EXPECT_TRUE(mesh.MoveVertex(VertexId(slot), position).ok());
  });
  Commit(mesh);
}

/// Each cube of a grid as six pyramids from its centre, or as two prisms.
Mesh SplitCubes(int n, ElementType type) {
  const Mesh grid = HexGrid(n, n, n);
  Mesh mesh;
  grid.slots(EntityKind::kVertex).live().ForEach([&](Slot slot) {
    EXPECT_TRUE(mesh.AddVertex(grid.Position(VertexId(slot))).ok());
  });
  grid.slots(EntityKind::kCell).live().ForEach([&](Slot slot) {
    const auto v = grid.Vertices(CellId(slot));
    const auto at = [&](int k) { return v[k].slot(); };
    if (type == ElementType::kPrism) {
      Add(mesh, type, {at(0), at(1), at(2), at(4), at(5), at(6)});
      Add(mesh, type, {at(0), at(2), at(3), at(4), at(6), at(7)});
      return;
    }
    const Slot centre = mesh.AddVertex(0.5 * (grid.Position(v[0]) + grid.Position(v[6])))->slot();
    for (const LocalFace& face : TemplateOf(ElementType::kHexahedron).faces) {
      Add(mesh, ElementType::kPyramid,
          {at(face.vertices[0]), at(face.vertices[1]), at(face.vertices[2]), at(face.vertices[3]), centre});
    }
  });
  Commit(mesh);
  return mesh;
}

int CountCells(const Mesh& mesh, const Point& p) {
  int count = 0;
  mesh.slots(EntityKind::kCell).live().ForEach([&](Slot slot) {
    count += ContainsPoint(mesh, CellId(slot), p);
  });
  return count;
}

TEST(ContainmentTest, WarpedCellsFillTheirDomainOnce) {
  std::mt19937 rng(3);
  const Box box{{0, 0, 0}, {3, 3, 3}};
  Mesh meshes[] = {HexGrid(3, 3, 3), TetGrid(3, 3, 3), SplitCubes(3, ElementType::kPyramid),
                   SplitCubes(3, ElementType::kPrism)};
  for (Mesh& mesh : meshes) {
    Jitter(mesh, box, rng, 0.15);
    for (int i = 0; i < 400; ++i) {
      const Point inside = RandomPoint(rng, 0, 3);
      EXPECT_EQ(CountCells(mesh, inside), 1);
      Point outside = inside;
      outside[i % 3] += i % 2 == 0 ? 3.2 : -3.2;
      EXPECT_EQ(CountCells(mesh, outside), 0);
    }
    mesh.slots(EntityKind::kVertex).live().ForEach([&](Slot slot) {
      EXPECT_GE(CountCells(mesh, mesh.Position(VertexId(slot))), 1) << "a vertex belongs to its cells";
    });
  }
}

TEST(ContainmentTest, PointsOnSharedFacesAreInBothCells) {
  const Mesh mesh = HexGrid(2, 2, 2);
  EXPECT_EQ(CountCells(mesh, {1, 0.3, 0.7}), 2);
  EXPECT_EQ(CountCells(mesh, {1, 1, 0.7}), 4);
  EXPECT_EQ(CountCells(mesh, {1, 1, 1}), 8);
  EXPECT_EQ(CountCells(mesh, {2, 2, 2}), 1);
}

TEST(ContainmentTest, InsideIsWhereTheFacesGoRound) {
  std::mt19937 rng(4);
  int inside = 0;
  for (ElementType type :
       {ElementType::kTetrahedron, ElementType::kPyramid, ElementType::kPrism, ElementType::kHexahedron}) {
    for (int cell = 0; cell < 60; ++cell) {
      Mesh mesh;
      std::vector<VertexId> vertices;
      for (int k = 0; k < NumVertices(type); ++k)
        vertices.push_back(*mesh.AddVertex(RandomPoint(rng, -1, 1)));
      ASSERT_TRUE(mesh.AddElement(type, vertices).ok());
      Commit(mesh);
      for (int i = 0; i < 60; ++i) {
        const Point p = RandomPoint(rng, -1, 1);
        const bool enclosed = WindingNumber(mesh, CellId(0), p) != 0;
        EXPECT_EQ(ContainsPoint(mesh, CellId(0), p), enclosed) << ElementTypeName(type);
        inside += enclosed;
      }
    }
  }
  EXPECT_GT(inside, 300);
}

TEST(ContainmentTest, CellsWithoutVolumeHaveNoInside) {
  Mesh mesh;
  for (double x : {0, 1, 2, 3}) EXPECT_TRUE(mesh.AddVertex({x, x * x, 0}).ok());
  Add(mesh, ElementType::kTetrahedron, {0, 1, 2, 3});
  Add(mesh, ElementType::kTetrahedron, {0, 1, 1, 3});
  Add(mesh, ElementType::kHexahedron, {0, 0, 0, 0, 0, 0, 0, 0});
  Add(mesh, ElementType::kPyramid, {0, 1, 2, 3, 0});
  Commit(mesh);
  for (const Point& p : {Point{0, 0, 0}, Point{1, 1, 0}, Point{1, 1.5, 0}}) EXPECT_EQ(CountCells(mesh, p), 0);
}

TEST(ContainmentTest, DistanceIsThatOfTheNearestOfManyPoints) {
  std::mt19937 rng(5);
  std::uniform_real_distribution<> uniform(0, 1);
  for (int i = 0; i < 40; ++i) {
    Mesh mesh;
    for (int k = 0; k < 4; ++k) EXPECT_TRUE(mesh.AddVertex(RandomPoint(rng, -1, 1)).ok());
    i % 2 == 0 ? Add(mesh, ElementType::kQuad, {0, 1, 2, 3}) : Add(mesh, ElementType::kTriangle, {0, 1, 2});
    Commit(mesh);
    const Point p = RandomPoint(rng, -1, 1);
    const auto v = mesh.Vertices(FaceId(0));
    double nearest = 1e9;
    for (int sample = 0; sample < 4000; ++sample) {
      const size_t k = 2 + sample % (v.size() - 2);
      double s = uniform(rng), t = uniform(rng);
      if (s + t > 1) s = 1 - s, t = 1 - t;
      const Point a = mesh.Position(v[0]);
      const Point at = a + s * (mesh.Position(v[k - 1]) - a) + t * (mesh.Position(v[k]) - a);
      nearest = std::min(nearest, std::sqrt(Dot(p - at, p - at)));
    }
    const double distance = DistanceTo(mesh, FaceId(0), p);
    EXPECT_LE(distance, nearest + 1e-12);
    EXPECT_GE(distance, nearest - 0.1);
  }
}

TEST(ContainmentTest, DistancesToSidesCornersAndDegenerateFaces) {
  Mesh mesh;
  for (const Point& p : {Point{0, 0, 0}, Point{2, 0, 0}, Point{0, 2, 0}}) EXPECT_TRUE(mesh.AddVertex(p).ok());
  Add(mesh, ElementType::kTriangle, {0, 1, 2});
  const EntityId line = Add(mesh, ElementType::kTriangle, {0, 1, 1});
  Commit(mesh);
  const FaceId f(0);
  EXPECT_EQ(DistanceTo(mesh, f, {0.5, 0.5, 0}), 0);
  EXPECT_EQ(DistanceTo(mesh, f, {0.5, 0.5, -3}), 3);
  EXPECT_EQ(DistanceTo(mesh, f, {1, -2, 0}), 2);
  EXPECT_EQ(DistanceTo(mesh, f, {-3, -4, 0}), 5);
  EXPECT_DOUBLE_EQ(DistanceTo(mesh, f, {2, 2, 0}), std::sqrt(2));
  EXPECT_EQ(DistanceTo(mesh, FaceId(line.slot), {1, 0, 7}), 7);
}

/// Möller and Trumbore's way: another one than that of the code.
bool HitsOtherwise(const std::array<Point, 3>& t, const Ray& ray, double* at) {
  const Point e1 = t[1] - t[0], e2 = t[2] - t[0], h = Cross(ray.direction, e2), s = ray.origin - t[0];
  const double det = Dot(e1, h), u = Dot(s, h) / det;
  const Point q = Cross(s, e1);
  const double v = Dot(ray.direction, q) / det;
  *at = Dot(e2, q) / det;
  return u >= 0 && v >= 0 && u + v <= 1 && *at >= 0;
}

TEST(RayShearTest, HitsAreThoseOfAnotherMethod) {
  std::mt19937 rng(6);
  int hits = 0;
  for (int i = 0; i < 20'000; ++i) {
    const std::array<Point, 3> triangle = {RandomPoint(rng, -1, 1), RandomPoint(rng, -1, 1),
                                           RandomPoint(rng, -1, 1)};
    const Ray ray{RandomPoint(rng, -2, 2), RandomPoint(rng, -1, 1)};
    const RayShear shear(ray);
    const auto hit = shear.Hit(triangle);
    double expected;
    ASSERT_EQ(hit.has_value(), HitsOtherwise(triangle, ray, &expected));
    if (hit.has_value()) {
      EXPECT_NEAR(shear.ToRay(*hit), expected, 1e-9 * (1 + expected));
      ++hits;
    }
  }
  EXPECT_GT(hits, 100);
}

TEST(RayShearTest, NoRaySlipsBetweenTrianglesThatShareAnEdge) {
  std::mt19937 rng(7);
  std::uniform_real_distribution<> uniform(0, 1);
  for (int i = 0; i < 20'000; ++i) {
    // The ray goes through a point of the fan's spokes, as nearly as numbers can say.
    const Point hub = RandomPoint(rng, -0.1, 0.1);
    const double s = uniform(rng);
    Point rim[5];
    for (int k = 0; k < 5; ++k) {
      rim[k] = {std::cos(k * 1.25663706), std::sin(k * 1.25663706), 0.3 * uniform(rng)};
    }
    const Point target = hub + s * (rim[i % 5] - hub);
    const Point origin = {2 * uniform(rng) - 1, 2 * uniform(rng) - 1, 5};
    const RayShear shear({origin, target - origin});
    bool hit = false;
    for (int k = 0; k < 5; ++k) hit = hit || shear.Hit({hub, rim[k], rim[(k + 1) % 5]}).has_value();
    EXPECT_TRUE(hit || s > 1 - 1e-9);
  }
}

TEST(RayShearTest, ARayInTheTrianglesPlaneMissesIt) {
  const RayShear shear({{-1, 0.25, 0}, {1, 0, 0}});
  EXPECT_FALSE(shear.Hit({Point{0, 0, 0}, Point{1, 0, 0}, Point{0, 1, 0}}).has_value());
}

TEST(RayShearTest, ClippingKeepsWhatIsInside) {
  std::mt19937 rng(8);
  const Box box{{-1, -1, -1}, {1, 1, 1}};
  for (int i = 0; i < 5000; ++i) {
    Ray ray{RandomPoint(rng, -3, 3), RandomPoint(rng, -1, 1)};
    if (i % 4 == 0) ray.direction[i % 3] = 0;
    const RayShear shear(ray);
    const auto range = shear.Clip(box);
    for (double t = 0; t < 8; t += 0.05) {
      if (!Contains(box, ray.origin + t * ray.direction)) continue;
      ASSERT_TRUE(range.has_value());
      EXPECT_LE(shear.ToRay((*range)[0]), t);
      EXPECT_GE(shear.ToRay((*range)[1]), t);
    }
  }
}

}  // namespace
}  // namespace dynmesh::testing
