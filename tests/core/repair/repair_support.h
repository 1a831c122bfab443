#ifndef DYNMESH_TESTS_CORE_REPAIR_REPAIR_SUPPORT_H_
#define DYNMESH_TESTS_CORE_REPAIR_REPAIR_SUPPORT_H_

#include <functional>
#include <initializer_list>
#include <random>

#include "core/repair/repair.h"
#include "tests/support/measures.h"
#include "tests/support/meshes.h"

namespace dynmesh::testing {

/// Takes a step on a mesh that is committed, and commits it. Fails the test unless a roll-back puts
/// everything back, the mesh equals the oracle afterwards, and the same step then finds nothing to change.
RepairReport Repair(Mesh& mesh, const RepairStep& step);

/// The entities of a finding.
std::vector<EntityId> Found(const RepairReport& report, RepairFinding finding);

/// Pairs of faces that turn differently across an edge that just these two have, and of cells across a face.
int CountTurns(const Mesh& mesh);

/// A mesh of triangles at the given points.
Mesh Triangles(std::initializer_list<Point> points, std::initializer_list<std::array<Slot, 3>> triangles);

/// The boundary of a cube as 12 triangles that face outwards.
Mesh CubeSurface();

/// Every element with vertices of its own, at the same places; in a random order.
Mesh Separated(const Mesh& mesh, std::mt19937& rng);

/// The same elements, each with a chance of one half the other way round. Cells too.
Mesh RandomlyReversed(const Mesh& mesh, std::mt19937& rng);

}  // namespace dynmesh::testing

#endif  // DYNMESH_TESTS_CORE_REPAIR_REPAIR_SUPPORT_H_
