#ifndef DYNMESH_TESTS_BENCH_FIXTURE_H_
#define DYNMESH_TESTS_BENCH_FIXTURE_H_

#include <cstdlib>
#include <iostream>
#include <string>

#include "core/mesh/bulk_build.h"
#include "core/mesh/mesh.h"
#include "tests/bench/limit/flat_mesh.h"
#include "tests/bench/mesh_source.h"

namespace dynmesh::bench {

/// The value, or the end of the program with the message: a benchmark of a failure is none.
template <typename T>
T Must(absl::StatusOr<T> result) {
  if (result.ok()) return *std::move(result);
  std::cerr << result.status() << '\n';
  std::exit(1);
}
inline void Must(const absl::Status& status) {
  if (status.ok()) return;
  std::cerr << status << '\n';
  std::exit(1);
}

/// "c_e" for cell->edges.
std::string NameOf(Relation relation);

/// A mesh of the input's elements at revision 1.
Mesh BuildMesh(const MeshInput& input, SlotOrder order = SlotOrder::kCaller);

/// What the benchmarks of one mesh in one order share. `mesh` has the default relations, `stored` all.
struct Fixture {
  MeshInput input;
  Mesh mesh;
  Mesh stored;
  /// All relations in plain arrays, with the ids of `mesh`.
  FlatMesh flat;

  /// Ends the program if the flat arrays are not those of the mesh, row by row.
  explicit Fixture(MeshInput mesh_input);
};

}  // namespace dynmesh::bench

#endif  // DYNMESH_TESTS_BENCH_FIXTURE_H_
