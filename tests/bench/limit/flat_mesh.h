#ifndef DYNMESH_TESTS_BENCH_LIMIT_FLAT_MESH_H_
#define DYNMESH_TESTS_BENCH_LIMIT_FLAT_MESH_H_

#include <array>
#include <vector>

#include "core/mesh/relation.h"
#include "tests/bench/limit/flat_rows.h"
#include "tests/bench/mesh_source.h"

namespace dynmesh::bench {

/// A mesh of one element type as read-only flat arrays: what a program would build that never edits. The
/// yardstick of the benchmarks; it shares nothing with Mesh but the element templates.
struct FlatMesh {
  ElementType type = ElementType::kUnspecified;
  std::vector<Point> points;
  std::array<std::array<FlatRows, kNumEntityKinds>, kNumEntityKinds> rows;  ///< rows[from][to]
  std::vector<uint8_t> face_codes;                                          ///< parallel to cell->faces

  FlatRows& of(Relation relation) { return rows[Dimension(relation.from)][Dimension(relation.to)]; }
  const FlatRows& of(Relation relation) const {
    return rows[Dimension(relation.from)][Dimension(relation.to)];
  }
  bool has_cells() const { return KindOf(type) == EntityKind::kCell; }
  size_t num_vertices() const { return points.size(); }
  size_t num_edges() const { return rows[1][0].size(); }
  size_t num_faces() const { return rows[2][0].size(); }
  size_t memory_bytes() const;
};

/// The relations that a Mesh stores by default, by counting sorts over lowest vertices in the order of the
/// input: cell->vertices, cell->faces with codes, face->vertices, face->edges, edge->vertices, vertex->edges,
/// edge->faces, face->cells. REQUIRES: no degenerate and no duplicate elements.
FlatMesh BuildFlatDefault(const MeshInput& input);

/// The six storable relations on top: fourteen in all (of a mesh of triangles: seven).
void AddFlatStorable(FlatMesh& mesh);

/// The other two, edge->edges and face->faces, which no one should store: for comparison only.
void AddFlatAdjacent(FlatMesh& mesh);

}  // namespace dynmesh::bench

#endif  // DYNMESH_TESTS_BENCH_LIMIT_FLAT_MESH_H_
