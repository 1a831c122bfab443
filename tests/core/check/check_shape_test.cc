#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "core/check/shape.h"
#include "core/edit/geometry.h"

namespace dynmesh {
namespace {

const double kInfinity = std::numeric_limits<double>::infinity();
const double kHigh = std::sqrt(0.75), kHeight = std::sqrt(2.0 / 3);

struct Shape {
  ElementType type;
  std::vector<Point> points;
};

const Shape kTriangle{ElementType::kTriangle, {{0, 0, 0}, {1, 0, 0}, {0.5, kHigh, 0}}};
const Shape kSquare{ElementType::kQuad, {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}};
const Shape kTetrahedron{ElementType::kTetrahedron,
                         {{0, 0, 0}, {1, 0, 0}, {0.5, kHigh, 0}, {0.5, kHigh / 3, kHeight}}};
const Shape kCornerOfCube{ElementType::kTetrahedron, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
const Shape kPyramid{ElementType::kPyramid,
                     {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.5, 0.5, std::sqrt(0.5)}}};
const Shape kPrism{ElementType::kPrism,
                   {{0, 0, 1}, {1, 0, 1}, {0.5, kHigh, 1}, {0, 0, 0}, {1, 0, 0}, {0.5, kHigh, 0}}};
const Shape kCube{ElementType::kHexahedron,
                  {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}}};

double Degrees(double radians) { return radians * 180 / std::acos(-1); }

void ExpectAngles(const AngleRange& angles, double smallest, double largest) {
  EXPECT_NEAR(angles.smallest, smallest, 1e-9);
  EXPECT_NEAR(angles.largest, largest, 1e-9);
}

TEST(ShapeTest, AnglesOfFacesAreThoseOfTheTextbook) {
  ExpectAngles(FaceAngles(kTriangle.type, kTriangle.points), 60, 60);
  ExpectAngles(FaceAngles(kSquare.type, kSquare.points), 90, 90);
  ExpectAngles(FaceAngles(ElementType::kTriangle, {{0, 0, 0}, {3, 0, 0}, {0, 3, 0}}), 45, 90);
  ExpectAngles(FaceAngles(ElementType::kQuad, {{0, 0, 5}, {2, 0, 5}, {3, 1, 5}, {1, 1, 5}}), 45, 135);
}

TEST(ShapeTest, AnArrowheadHasAnAngleOfMoreThan180) {
  const double wing = Degrees(std::atan2(1, 4)), tip = 2 * Degrees(std::atan2(1, 4));
  const AngleRange angles = FaceAngles(ElementType::kQuad, {{0, 0, 0}, {-1, -1, 0}, {3, 0, 0}, {-1, 1, 0}});
  EXPECT_NEAR(angles.largest, 270, 1e-9);
  EXPECT_NEAR(angles.smallest, std::min(tip, Degrees(std::atan2(1, 1)) - wing), 1e-9);
}

TEST(ShapeTest, DihedralAnglesAreThoseOfTheTextbook) {
  const double regular = Degrees(std::acos(1.0 / 3));  // 70.53
  ExpectAngles(DihedralAngles(kTetrahedron.type, kTetrahedron.points), regular, regular);
  ExpectAngles(DihedralAngles(kCornerOfCube.type, kCornerOfCube.points),
               Degrees(std::acos(std::sqrt(1.0 / 3))), 90);
  ExpectAngles(DihedralAngles(kCube.type, kCube.points), 90, 90);
  ExpectAngles(DihedralAngles(kPrism.type, kPrism.points), 60, 90);
  ExpectAngles(DihedralAngles(kPyramid.type, kPyramid.points), Degrees(std::acos(std::sqrt(1.0 / 3))),
               Degrees(std::acos(-1.0 / 3)));
}

TEST(ShapeTest, MirroringTurnsNoAngleInsideOut) {
  for (const Shape& shape : {kTetrahedron, kCornerOfCube, kPyramid, kPrism, kCube}) {
    std::vector<Point> mirrored = shape.points;
    for (Point& p : mirrored) p[0] = -p[0];
    const AngleRange angles = DihedralAngles(shape.type, shape.points);
    ExpectAngles(DihedralAngles(shape.type, mirrored), angles.smallest, angles.largest);
  }
}

TEST(ShapeTest, AHexahedronWithADentHasADihedralAngleOfMoreThan180) {
  std::vector<Point> dented = kCube.points;
  for (int v : {1, 2}) dented[v] = {0.2, dented[v][1], 0.6};  // the edge 1-2 goes through the middle
  EXPECT_GT(DihedralAngles(kCube.type, dented).largest, 180);
}

TEST(ShapeTest, TheSmallestDihedralAngleIsThatOfGeometry) {
  std::mt19937 rng(7);
  std::uniform_real_distribution<double> coordinate(-1, 1);
  for (int round = 0; round < 300; ++round) {
    std::vector<Point> points(4);
    for (Point& p : points) p = {coordinate(rng), coordinate(rng), coordinate(rng)};
    EXPECT_NEAR(DihedralAngles(ElementType::kTetrahedron, points).smallest,
                Degrees(SmallestDihedralAngle(points)), 1e-7);
  }
}

TEST(ShapeTest, RegularShapesOfAnySizeAreWorthOne) {
  for (const Shape& shape : {kTriangle, kSquare, kTetrahedron, kPyramid, kPrism, kCube}) {
    for (double scale : {1.0, -1e-3}) {
      std::vector<Point> points = shape.points;
      for (Point& p : points) p = {scale * p[0], scale * p[1], scale * p[2]};
      EXPECT_NEAR(AspectRatio(shape.type, points), 1, 1e-12) << ElementTypeName(shape.type);
      EXPECT_NEAR(ConditionNumber(shape.type, points), 1, 1e-12) << ElementTypeName(shape.type);
    }
  }
}

TEST(ShapeTest, StretchedShapesAreWorthWhatIsKnownOfThem) {
  std::vector<Point> brick = kCube.points;
  for (Point& p : brick) p[0] *= 4;
  EXPECT_NEAR(AspectRatio(kCube.type, brick), 4, 1e-12);
  // sqrt(16 + 1 + 1) * sqrt(1 / 16 + 1 + 1) / 3
  EXPECT_NEAR(ConditionNumber(kCube.type, brick), std::sqrt(18 * 33.0 / 16) / 3, 1e-12);
  EXPECT_NEAR(RelativeMeasure(kCube.type, brick), 4.0 / 64, 1e-12);
  // Longest edge sqrt(2), inscribed radius (3 - sqrt(3)) / 6.
  EXPECT_NEAR(AspectRatio(kCornerOfCube.type, kCornerOfCube.points),
              std::sqrt(2.0) / (2 * std::sqrt(6.0) * (3 - std::sqrt(3.0)) / 6), 1e-12);
}

TEST(ShapeTest, TheConditionOfATriangleIsTheInverseOfItsMeanRatio) {
  std::mt19937 rng(11);
  std::uniform_real_distribution<double> coordinate(-1, 1);
  for (int round = 0; round < 100; ++round) {
    std::vector<Point> points(3);
    for (Point& p : points) p = {coordinate(rng), coordinate(rng), coordinate(rng)};
    EXPECT_NEAR(ConditionNumber(ElementType::kTriangle, points) * Quality(ElementType::kTriangle, points), 1,
                1e-9);
  }
}

TEST(ShapeTest, FlatAndCollapsedShapesAreWorthNothing) {
  for (const Shape& shape : {kTriangle, kTetrahedron, kPyramid, kPrism, kCube}) {
    std::vector<Point> flat = shape.points, collapsed(shape.points.size(), Point{1, 2, 3});
    for (Point& p : flat) p[shape.type == ElementType::kTriangle ? 1 : 2] = 0;
    EXPECT_EQ(RelativeMeasure(shape.type, flat), 0) << ElementTypeName(shape.type);
    EXPECT_EQ(ConditionNumber(shape.type, flat), kInfinity) << ElementTypeName(shape.type);
    EXPECT_EQ(RelativeMeasure(shape.type, collapsed), 0) << ElementTypeName(shape.type);
    EXPECT_EQ(AspectRatio(shape.type, collapsed), kInfinity) << ElementTypeName(shape.type);
    EXPECT_EQ(ConditionNumber(shape.type, collapsed), kInfinity) << ElementTypeName(shape.type);
  }
  EXPECT_EQ(DihedralAngles(kTetrahedron.type, std::vector<Point>(4, Point{1, 2, 3})).smallest, 0);
  EXPECT_EQ(FaceAngles(kSquare.type, std::vector<Point>(4, Point{1, 2, 3})).smallest, 0);
}

TEST(ShapeTest, OneCornerOfATwistedHexahedronLiesTheOtherWay) {
  EXPECT_NEAR(SmallestScaledJacobian(kCube.type, kCube.points), 1, 1e-12);
  std::vector<Point> twisted = kCube.points;
  twisted[6] = {0.1, 0.1, 0.1};
  EXPECT_LT(SmallestScaledJacobian(kCube.type, twisted), 0);
  EXPECT_GT(Measure(kCube.type, twisted), 0);
}

}  // namespace
}  // namespace dynmesh
