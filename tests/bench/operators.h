#ifndef DYNMESH_TESTS_BENCH_OPERATORS_H_
#define DYNMESH_TESTS_BENCH_OPERATORS_H_

#include <array>
#include <string>
#include <vector>

#include "core/edit/edits.h"
#include "core/edit/patch.h"
#include "tests/bench/fixture.h"

namespace dynmesh::bench {

/// An operator that benchmarks run, with the defaults of a caller who names only the place.
struct Operator {
  std::string name;  ///< "split", "collapse", "swap_edge", "swap_face"
  EntityKind kind;
  absl::Status (*plan)(const Mesh& mesh, Slot slot, dynmesh::Patch& patch);
  Edit (*edit)(const std::vector<Slot>& places);  ///< the same at many places, for a batch
};

/// Those that make sense for a mesh of elements of this type.
std::vector<Operator> OperatorsFor(ElementType type);

/// Random places, at most `count`, where the operator is accepted, so far apart that it is at each of them
/// whatever it has done at others.
std::vector<Slot> PlacesFor(const Mesh& mesh, const Operator& op, size_t count);

/// As many as are timed.
inline constexpr size_t kPlaces = 1000;

}  // namespace dynmesh::bench

#endif  // DYNMESH_TESTS_BENCH_OPERATORS_H_
