#ifndef DYNMESH_CORE_MESH_VALIDATE_H_
#define DYNMESH_CORE_MESH_VALIDATE_H_

#include <string>
#include <vector>

#include "core/mesh/mesh.h"

namespace dynmesh {

/// Every invariant of `mesh` that does not hold, as a sentence naming the entities; at most `max_violations`.
///
/// Checks liveness of everything referred to, both directions of every stored relation, orientation codes,
/// uniqueness of primaries, the indices of hubs and duplicates, element flags and counts, boundary bits and
/// counters, slots, stamps, and both checksums. Not: the rooms of the pools, which only AddressSanitizer sees.
/// Cost: linear in the mesh, with hash tables of its edges and faces. For tests and worried operators.
std::vector<std::string> Validate(const Mesh& mesh, size_t max_violations = 100);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_MESH_VALIDATE_H_
