// OpenMesh: halfedges, triangles only here.

#include <OpenMesh/Core/Mesh/DefaultTriMesh.hh>
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>

#include "tests/bench/peers/peer.h"
#include "tests/bench/tasks.h"

namespace dynmesh::bench {
namespace {

using Surface = OpenMesh::TriMesh_ArrayKernelT<OpenMesh::DefaultTraitsDouble>;

std::unique_ptr<Surface> Build(const MeshInput& input) {
  auto surface = std::make_unique<Surface>();
  surface->reserve(input.points.size(), input.num_elements() * 3 / 2, input.num_elements());
  for (const Point& p : input.points) surface->add_vertex({p[0], p[1], p[2]});
  const auto vertex = [&](size_t i) { return Surface::VertexHandle(input.elements[i].slot()); };
  for (size_t i = 0; i < input.elements.size(); i += 3)
    surface->add_face(vertex(i), vertex(i + 1), vertex(i + 2));
  return surface;
}

uint64_t SumVertexVertices(const Surface& surface) {
  uint64_t sum = 0;
  for (auto v : surface.vertices()) {
    for (auto w : surface.vv_range(v)) sum += w.idx();
  }
  return sum;
}

uint64_t SumVertexFaces(const Surface& surface) {
  uint64_t sum = 0;
  for (auto v : surface.vertices()) {
    for (auto f : surface.vf_range(v)) sum += f.idx();
  }
  return sum;
}

uint64_t SumBoundaryVertices(const Surface& surface) {
  uint64_t sum = 0;
  for (auto v : surface.vertices()) sum += surface.is_boundary(v) ? v.idx() : 0;
  return sum;
}

}  // namespace

void RegisterOpenMesh(const Fixture& fixture) {
  const MeshInput& input = fixture.input;
  if (input.type != ElementType::kTriangle) return;
  const std::shared_ptr<const Surface> peer = Build(input);
  RegisterPeerBuild("openmesh/build", input.num_elements(), [&] { return Build(input); });
  RegisterPeerTask("openmesh/relation/v_v", SumOf(fixture.flat, kVertexVertices),
                   [peer] { return SumVertexVertices(*peer); });
  RegisterPeerTask("openmesh/relation/v_f", SumOf(fixture.flat, kVertexFaces),
                   [peer] { return SumVertexFaces(*peer); });
  RegisterPeerTask("openmesh/boundary/vertices", SumOf(fixture.mesh.Boundary(EntityKind::kVertex)),
                   [peer] { return SumBoundaryVertices(*peer); });
}

}  // namespace dynmesh::bench
