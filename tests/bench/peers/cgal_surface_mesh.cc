// CGAL's Surface_mesh: halfedges, triangles only here.

#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>

#include "tests/bench/peers/peer.h"
#include "tests/bench/tasks.h"

namespace dynmesh::bench {
namespace {

using Surface = CGAL::Surface_mesh<CGAL::Simple_cartesian<double>::Point_3>;

std::unique_ptr<Surface> Build(const MeshInput& input) {
  auto surface = std::make_unique<Surface>();
  surface->reserve(input.points.size(), input.num_elements() * 3 / 2, input.num_elements());
  for (const Point& p : input.points) surface->add_vertex({p[0], p[1], p[2]});
  const auto vertex = [&](size_t i) { return Surface::Vertex_index(input.elements[i].slot()); };
  for (size_t i = 0; i < input.elements.size(); i += 3)
    surface->add_face(vertex(i), vertex(i + 1), vertex(i + 2));
  return surface;
}

uint64_t SumVertexVertices(const Surface& surface) {
  uint64_t sum = 0;
  for (auto v : surface.vertices()) {
    for (auto w : CGAL::vertices_around_target(v, surface)) sum += w.idx();
  }
  return sum;
}

uint64_t SumVertexFaces(const Surface& surface) {
  uint64_t sum = 0;
  for (auto v : surface.vertices()) {
    for (auto f : CGAL::faces_around_target(surface.halfedge(v), surface))
      sum += f == surface.null_face() ? 0 : f.idx();
  }
  return sum;
}

uint64_t SumBoundaryVertices(const Surface& surface) {
  uint64_t sum = 0;
  for (auto v : surface.vertices()) sum += surface.is_border(v) ? v.idx() : 0;
  return sum;
}

}  // namespace

void RegisterCgalSurfaceMesh(const Fixture& fixture) {
  const MeshInput& input = fixture.input;
  if (input.type != ElementType::kTriangle) return;
  const std::shared_ptr<const Surface> peer = Build(input);
  RegisterPeerBuild("cgal_surface_mesh/build", input.num_elements(), [&] { return Build(input); });
  RegisterPeerTask("cgal_surface_mesh/relation/v_v", SumOf(fixture.flat, kVertexVertices),
                   [peer] { return SumVertexVertices(*peer); });
  RegisterPeerTask("cgal_surface_mesh/relation/v_f", SumOf(fixture.flat, kVertexFaces),
                   [peer] { return SumVertexFaces(*peer); });
  RegisterPeerTask("cgal_surface_mesh/boundary/vertices", SumOf(fixture.mesh.Boundary(EntityKind::kVertex)),
                   [peer] { return SumBoundaryVertices(*peer); });
}

}  // namespace dynmesh::bench
