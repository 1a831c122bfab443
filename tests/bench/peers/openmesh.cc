// OpenMesh: halfedges, triangles only here.

#include <OpenMesh/Core/Mesh/DefaultTriMesh.hh>
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>

#include "tests/bench/operators.h"
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

struct EditedSurface {
  std::unique_ptr<Surface> surface;
  std::vector<Surface::HalfedgeHandle> places;
};

std::unique_ptr<EditedSurface> ReadyToEdit(const Fixture& fixture, const std::vector<Slot>& places) {
  auto ready = std::make_unique<EditedSurface>();
  ready->surface = Build(fixture.input);
  ready->surface->request_face_status();
  ready->surface->request_edge_status();
  ready->surface->request_vertex_status();
  for (Slot place : places) {
    const auto ends = fixture.mesh.Vertices(EdgeId(place));
    // A collapse removes the vertex that its halfedge comes from.
    ready->places.push_back(ready->surface->find_halfedge(Surface::VertexHandle(ends[1].slot()),
                                                          Surface::VertexHandle(ends[0].slot())));
  }
  return ready;
}

size_t Split(EditedSurface& edited) {
  Surface& surface = *edited.surface;
  for (const auto halfedge : edited.places) {
    const auto middle = (surface.point(surface.from_vertex_handle(halfedge)) +
                         surface.point(surface.to_vertex_handle(halfedge))) /
                        2;
    surface.split(surface.edge_handle(halfedge), middle);
  }
  return edited.places.size();
}

size_t Flip(EditedSurface& edited) {
  size_t done = 0;
  for (const auto halfedge : edited.places) {
    const auto edge = edited.surface->edge_handle(halfedge);
    if (!edited.surface->is_flip_ok(edge)) continue;
    edited.surface->flip(edge);
    ++done;
  }
  return done;
}

size_t Collapse(EditedSurface& edited) {
  size_t done = 0;
  for (const auto halfedge : edited.places) {
    if (!edited.surface->is_collapse_ok(halfedge)) continue;
    edited.surface->collapse(halfedge);
    ++done;
  }
  return done;
}

void RegisterPeerEdits(const Fixture& fixture) {
  const std::pair<const char*, size_t (*)(EditedSurface&)> edits[] = {
      {"split", Split}, {"swap_edge", Flip}, {"collapse", Collapse}};
  for (const Operator& op : OperatorsFor(fixture.input.type)) {
    for (const auto& [name, edit] : edits) {
      if (op.name != name) continue;
      const auto places = std::make_shared<const std::vector<Slot>>(PlacesFor(fixture.mesh, op, kPlaces));
      RegisterPeerEdit(
          "openmesh/edit/" + op.name, places->size(),
          [&fixture, places] { return ReadyToEdit(fixture, *places); }, edit);
    }
  }
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
  RegisterPeerEdits(fixture);
  RegisterPeerTask("openmesh/boundary/vertices", SumOf(fixture.mesh.Boundary(EntityKind::kVertex)),
                   [peer] { return SumBoundaryVertices(*peer); });
}

}  // namespace dynmesh::bench
