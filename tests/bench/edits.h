#ifndef DYNMESH_TESTS_BENCH_EDITS_H_
#define DYNMESH_TESTS_BENCH_EDITS_H_

#include <vector>

#include "core/edit/transaction.h"
#include "tests/bench/fixture.h"

namespace dynmesh::bench {

/// Elements of a mesh, and what it takes to add them again.
struct Patch {
  RemoveElementsEdit remove;
  AddElementsEdit add;
  size_t size() const { return remove.elements.size(); }
};

/// The patch of these elements of the input. REQUIRES: the mesh was built from it in the caller's order.
Patch PatchOf(const MeshInput& input, std::vector<Slot> elements);

/// All elements of the input along a Hilbert curve through their centers: neighbours in space are neighbours
/// here.
std::vector<Slot> ElementsAlongCurve(const MeshInput& input);

/// `share` of all elements: drawn at random, or from one region of space.
Patch RandomElements(const MeshInput& input, double share);
Patch NeighbouringElements(const MeshInput& input, double share);

/// Removes `share` of all elements in small patches and adds them again, each patch in a batch of its own.
void ReplaceInPatches(const MeshInput& input, double share, Mesh& mesh);

void Apply(Mesh& mesh, const Edit& edit);

}  // namespace dynmesh::bench

#endif  // DYNMESH_TESTS_BENCH_EDITS_H_
