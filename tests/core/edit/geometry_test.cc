#include "core/edit/geometry.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace dynmesh {
namespace {

const double kHeight = std::sqrt(2.0 / 3);  // of a regular tetrahedron of edge length 1

struct Regular {
  ElementType type;
  double measure;
  std::vector<Point> points;
};

/// The regular shapes of edge length 1.
std::vector<Regular> RegularShapes() {
  const double h = std::sqrt(3.0) / 2;
  return {
      {ElementType::kWireEdge, 1, {{0, 0, 0}, {0, 0, 1}}},
      {ElementType::kTriangle, h / 2, {{0, 0, 0}, {1, 0, 0}, {0.5, h, 0}}},
      {ElementType::kQuad, 1, {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}},
      {ElementType::kTetrahedron,
       h / 6 * kHeight,
       {{0, 0, 0}, {1, 0, 0}, {0.5, h, 0}, {0.5, h / 3, kHeight}}},
      {ElementType::kPyramid,
       std::sqrt(0.5) / 3,
       {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.5, 0.5, std::sqrt(0.5)}}},
      // VTK's wedge: the first triangle looks outwards.
      {ElementType::kPrism, h / 2, {{0, 0, 1}, {1, 0, 1}, {0.5, h, 1}, {0, 0, 0}, {1, 0, 0}, {0.5, h, 0}}},
      {ElementType::kHexahedron,
       1,
       {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}}},
  };
}

TEST(GeometryTest, RegularShapesAreAsGoodAsCanBeWhateverTheirSizeAndSide) {
  for (const auto& [type, measure, points] : RegularShapes()) {
    for (double scale : {1.0, 1e-3, -2.0}) {  // a negative one mirrors
      std::vector<Point> scaled = points;
      for (Point& p : scaled) {
        for (double& x : p) x *= scale;
      }
      const bool solid = KindOf(type) == EntityKind::kCell;
      const double size = std::pow(std::abs(scale), Dimension(KindOf(type)));
      EXPECT_NEAR(Quality(type, scaled), 1, 1e-12) << ElementTypeName(type) << " times " << scale;
      EXPECT_NEAR(Measure(type, scaled), (solid && scale < 0 ? -1 : 1) * size * measure, 1e-12 * size)
          << ElementTypeName(type) << " times " << scale;
      EXPECT_EQ(Orientation(type, scaled), !solid ? 0 : scale > 0 ? 1 : -1) << ElementTypeName(type);
    }
  }
}

TEST(GeometryTest, FlatFoldedAndCollapsedShapesHaveNoQuality) {
  for (auto [type, measure, points] : RegularShapes()) {
    if (type == ElementType::kWireEdge) continue;
    std::vector<Point> flat = points, folded = points;
    for (Point& p : flat) p = {p[0], 0, 0};
    EXPECT_EQ(Quality(type, flat), 0) << ElementTypeName(type);
    EXPECT_EQ(Orientation(type, flat), 0) << ElementTypeName(type);
    EXPECT_EQ(Quality(type, std::vector<Point>(points.size(), Point{1, 2, 3})), 0) << ElementTypeName(type);
    if (points.size() < 5) continue;
    std::swap(folded[0], folded[1]);
    EXPECT_EQ(Orientation(type, folded), 0) << ElementTypeName(type);
    EXPECT_EQ(Quality(type, folded), 0) << ElementTypeName(type);
  }
}

TEST(GeometryTest, TheDihedralAngleOfARegularTetrahedronIsTheArcCosineOfOneThird) {
  const auto regular = RegularShapes()[3].points;
  EXPECT_NEAR(SmallestDihedralAngle(regular), std::acos(1.0 / 3), 1e-12);
  const std::vector<Point> corner = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  EXPECT_NEAR(SmallestDihedralAngle(corner), std::acos(std::sqrt(1.0 / 3)), 1e-12);
  const std::vector<Point> mirrored = {{0, 0, 0}, {0, 1, 0}, {1, 0, 0}, {0, 0, 1}};
  EXPECT_NEAR(SmallestDihedralAngle(mirrored), std::acos(std::sqrt(1.0 / 3)), 1e-12);
}

}  // namespace
}  // namespace dynmesh
