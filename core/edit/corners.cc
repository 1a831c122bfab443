#include "core/edit/corners.h"

namespace dynmesh {
namespace {

constexpr Corner kTetrahedronCorners[] = {{0, {1, 2, 3}}, {1, {2, 0, 3}}, {2, {0, 1, 3}}, {3, {0, 2, 1}}};
constexpr Corner kPyramidCorners[] = {{0, {1, 3, 4}}, {1, {2, 0, 4}}, {2, {3, 1, 4}}, {3, {0, 2, 4}}};
constexpr Corner kPrismCorners[] = {{0, {2, 1, 3}}, {1, {0, 2, 4}}, {2, {1, 0, 5}},
                                    {3, {4, 5, 0}}, {4, {5, 3, 1}}, {5, {3, 4, 2}}};
constexpr Corner kHexahedronCorners[] = {{0, {1, 3, 4}}, {1, {2, 0, 5}}, {2, {3, 1, 6}}, {3, {0, 2, 7}},
                                         {4, {7, 5, 0}}, {5, {4, 6, 1}}, {6, {5, 7, 2}}, {7, {6, 4, 3}}};

}  // namespace

absl::Span<const Corner> CornersOf(ElementType type) {
  switch (type) {
    case ElementType::kTetrahedron:
      return kTetrahedronCorners;
    case ElementType::kPyramid:
      return kPyramidCorners;
    case ElementType::kPrism:
      return kPrismCorners;
    case ElementType::kHexahedron:
      return kHexahedronCorners;
    default:
      return {};
  }
}

}  // namespace dynmesh
