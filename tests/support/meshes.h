#ifndef DYNMESH_TESTS_SUPPORT_MESHES_H_
#define DYNMESH_TESTS_SUPPORT_MESHES_H_

#include <initializer_list>
#include <vector>

#include "core/mesh/mesh.h"

/// Small meshes that tests share. All are committed, so they are at revision 1.
namespace dynmesh::testing {

/// Adds `n` vertices at distinct, generic places.
std::vector<VertexId> AddVertices(Mesh& mesh, int n);

/// Adds an element over `slots`; fails the test when refused.
EntityId Add(Mesh& mesh, ElementType type, std::initializer_list<Slot> slots);

/// Commits; fails the test when refused.
void Commit(Mesh& mesh);

Mesh OneTet();
/// `n` tetrahedra round the edge 0-1, closed: n faces on that edge.
Mesh TetWheel(int n);
/// Two hexahedra that share a face.
Mesh TwoHexes();
/// Hexahedron + pyramid on top + prism at a side + tetrahedron on the pyramid: all four cell kinds, conforming.
Mesh HybridOfFour();
/// `n` triangles on the edge 0-1.
Mesh Book(int n);
/// A strip of `n` quads, closed with a half turn.
Mesh MoebiusStrip(int n);
/// Two triangle fans that share only vertex 0.
Mesh BowTie();
/// The closed surface of an octahedron: 8 triangles.
Mesh Octahedron();
/// An open disk: `n` triangles round vertex 0.
Mesh Disk(int n);
/// A tetrahedron, a dangling triangle on its edge 0-1, a wire edge at vertex 0, and an isolated vertex.
Mesh TetWithDanglers();
/// nx * ny * nz hexahedra, or six tetrahedra in place of each.
Mesh HexGrid(int nx, int ny, int nz);
Mesh TetGrid(int nx, int ny, int nz);

struct NamedMesh {
  const char* name;
  Mesh mesh;
};
/// All of the above.
std::vector<NamedMesh> AllMeshes();

}  // namespace dynmesh::testing

#endif  // DYNMESH_TESTS_SUPPORT_MESHES_H_
