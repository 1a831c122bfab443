#ifndef DYNMESH_CORE_MESH_VALIDATE_H_
#define DYNMESH_CORE_MESH_VALIDATE_H_

#include <string>
#include <vector>

#include "absl/functional/function_ref.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

struct ValidateOptions {
  size_t max_violations = 100;
  /// Asked between groups of invariants; false ends the check.
  absl::FunctionRef<bool()> goes_on = AlwaysGoesOn;

  static bool AlwaysGoesOn() { return true; }
};

/// Every invariant of `mesh` that does not hold, as a sentence naming the entities; at most
/// `options.max_violations`.
///
/// Checks liveness of everything referred to, both directions of every stored relation, orientation codes,
/// uniqueness of primaries, the indices of hubs and duplicates, element flags and counts, boundary bits and
/// counters, slots, stamps, and both checksums. Not: the rooms of the pools, which only AddressSanitizer
/// sees. Cost: linear in the mesh but for sorting the duplicates of a vertex's faces; about a microsecond a
/// tetrahedron, and 50 bytes meanwhile. For tests and worried operators.
std::vector<std::string> Validate(const Mesh& mesh, const ValidateOptions& options = {});

}  // namespace dynmesh

#endif  // DYNMESH_CORE_MESH_VALIDATE_H_
