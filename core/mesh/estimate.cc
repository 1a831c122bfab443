#include "core/mesh/estimate.h"

#include <algorithm>
#include <cmath>

namespace dynmesh {
namespace {

uint64_t CountOf(const ElementTypeCounts& elements, ElementType type) {
  return elements[static_cast<int>(type)];
}

/// Faces of all cells, each cell for itself.
uint64_t CellFaceUses(const ElementTypeCounts& elements) {
  uint64_t uses = 0;
  for (ElementType type : kElementTypes) {
    if (KindOf(type) == EntityKind::kCell) uses += CountOf(elements, type) * TemplateOf(type).num_faces;
  }
  return uses;
}

uint64_t ToCount(double value) { return static_cast<uint64_t>(std::max(0.0, std::round(value))); }

/// Faces that belong to one cell only. Tetrahedra: what makes F = V + 2C. Other cells: the hull of a block.
double EstimateHull(double num_vertices, double tet_share) {
  const double of_block = 6.0 * std::cbrt(num_vertices) * std::cbrt(num_vertices);
  return tet_share * 2.0 * num_vertices + (1.0 - tet_share) * of_block;
}

}  // namespace

std::array<uint64_t, kNumEntityKinds> EstimateCounts(uint64_t num_vertices, const ElementTypeCounts& elements) {
  const uint64_t tets = CountOf(elements, ElementType::kTetrahedron);
  const uint64_t cells = tets + CountOf(elements, ElementType::kPyramid) + CountOf(elements, ElementType::kPrism) +
                         CountOf(elements, ElementType::kHexahedron);
  const uint64_t surface_faces =
      CountOf(elements, ElementType::kTriangle) + CountOf(elements, ElementType::kQuad);
  const uint64_t wires = CountOf(elements, ElementType::kWireEdge);
  const double v = num_vertices;
  double faces = surface_faces;
  double edges = wires;
  if (cells > 0) {
    const double uses = CellFaceUses(elements);
    faces = (uses + std::min(EstimateHull(v, double(tets) / cells), uses)) / 2;
    edges = v + faces - cells - 1;
    faces = std::max<double>(faces, surface_faces);  // surface elements of a solid are mostly its own faces
  } else if (surface_faces > 0) {
    edges = surface_faces + v - 2;
  }
  return {num_vertices, std::max(ToCount(edges), wires), ToCount(faces), cells};
}

}  // namespace dynmesh
