#ifndef DYNMESH_TESTS_BENCH_MESH_SOURCE_H_
#define DYNMESH_TESTS_BENCH_MESH_SOURCE_H_

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/mesh/checksum.h"
#include "core/mesh/element_type.h"
#include "core/mesh/ids.h"

namespace dynmesh::bench {

/// What a benchmark runs on: elements of one type, as a file would give them.
struct MeshInput {
  ElementType type = ElementType::kUnspecified;
  std::vector<Point> points;
  std::vector<VertexId> elements;  ///< NumVertices(type) for each

  EntityKind kind() const { return KindOf(type); }
  size_t stride() const { return NumVertices(type); }
  size_t num_elements() const { return elements.size() / stride(); }
};

/// `source` is "tetrahedra:N", "hexahedra:N" or "triangles:N" for a generated mesh of about N elements, or a
/// folder of little-endian arrays: points.f64 (xyz) and one of tetra.u32, hexahedron.u32, triangle.u32 (VTK
/// node order), as to_arrays.py writes it. Errors: INVALID_ARGUMENT, NOT_FOUND, DATA_LOSS (sizes that do not
/// fit, ids or coordinates that cannot be).
absl::StatusOr<MeshInput> ReadMeshInput(const std::string& source);

/// A cube of tetrahedra (six to a grid cell) or hexahedra, a wavy sheet of triangles; points a little
/// displaced. In the order of the grid.
MeshInput GenerateMesh(ElementType type, size_t about);

/// The same mesh with vertices along a Hilbert curve and elements by their first vertex on it: the order that
/// SlotOrder::kHilbert gives.
MeshInput HilbertSorted(const MeshInput& input);

/// The same mesh in an order without any locality.
MeshInput Shuffled(const MeshInput& input);

}  // namespace dynmesh::bench

#endif  // DYNMESH_TESTS_BENCH_MESH_SOURCE_H_
