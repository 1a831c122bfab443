#ifndef DYNMESH_TESTS_SUPPORT_SHAPED_MESHES_H_
#define DYNMESH_TESTS_SUPPORT_SHAPED_MESHES_H_

#include <cstdint>

#include "core/mesh/mesh.h"

/// Meshes whose form matters. All are committed, so they are at revision 1.
namespace dynmesh::testing {

/// The unit cube by 6 n^3 tetrahedra, which are finer towards one corner.
Mesh GradedCube(int n);
/// Moves every inner vertex by up to `share` of its shortest edge along each axis, as long as no element
/// turns over. Commits.
void Shake(Mesh& mesh, double share, uint32_t seed);
/// The unit sphere by 8 * 4^levels triangles.
Mesh Sphere(int levels);
/// A cube of edge length 2 without a cube of edge length 1 at one of its corners, by 42 n^3 tetrahedra.
Mesh LBlock(int n);

}  // namespace dynmesh::testing

#endif  // DYNMESH_TESTS_SUPPORT_SHAPED_MESHES_H_
