// CGAL's Triangulation_data_structure_3: tetrahedra and vertices, without ids of edges and faces.

#include "tests/bench/peers/cgal_tds3.h"

#include "tests/bench/operators.h"
#include "tests/bench/peers/peer.h"
#include "tests/bench/tasks.h"

namespace dynmesh::bench {
namespace {

using Tds = CgalTds3::Tds;

uint64_t SumCellEdgeEnds(const CgalTds3& peer) {
  uint64_t sum = 0;
  for (const auto& cell : peer.cells) {
    for (int i = 0; i < 3; ++i) {
      for (int j = i + 1; j < 4; ++j) sum += uint64_t{cell->vertex(i)->info()} + cell->vertex(j)->info();
    }
  }
  return sum;
}

template <typename Handles>
uint64_t SumInside(const Handles& handles) {
  uint64_t sum = 0;
  for (const auto& handle : handles) sum += handle->info() == kNoSlot ? 0 : handle->info();
  return sum;
}

uint64_t SumVertexVertices(const CgalTds3& peer) {
  std::vector<Tds::Vertex_handle> row;
  uint64_t sum = 0;
  for (const auto& v : peer.vertices) {
    row.clear();
    peer.tds.adjacent_vertices(v, std::back_inserter(row));
    sum += SumInside(row);
  }
  return sum;
}

uint64_t SumVertexCells(const CgalTds3& peer) {
  std::vector<Tds::Cell_handle> row;
  uint64_t sum = 0;
  for (const auto& v : peer.vertices) {
    row.clear();
    peer.tds.incident_cells(v, std::back_inserter(row));
    sum += SumInside(row);
  }
  return sum;
}

uint64_t SumEdgeCells(const CgalTds3& peer) {
  uint64_t sum = 0;
  for (auto e = peer.tds.edges_begin(); e != peer.tds.edges_end(); ++e) {
    if (e->first->vertex(e->second) == peer.outside || e->first->vertex(e->third) == peer.outside) continue;
    auto cell = peer.tds.incident_cells(*e);
    const auto first = cell;
    do {
      if (cell->info() != kNoSlot) sum += cell->info();
    } while (++cell != first);
  }
  return sum;
}

uint64_t SumCellCells(const CgalTds3& peer) {
  uint64_t sum = 0;
  for (const auto& cell : peer.cells) {
    for (int i = 0; i < 4; ++i) {
      const uint32_t neighbor = cell->neighbor(i)->info();
      sum += neighbor == kNoSlot ? 0 : neighbor;
    }
  }
  return sum;
}

uint64_t SumBoundaryVertices(const CgalTds3& peer) {
  std::vector<Tds::Vertex_handle> row;
  peer.tds.adjacent_vertices(peer.outside, std::back_inserter(row));
  return SumInside(row);
}

/// Places of edits: a cell, and one or two of its vertices.
struct EditedTds3 {
  struct Place {
    Tds::Cell_handle cell;
    int i, j;
  };
  std::unique_ptr<CgalTds3> peer;
  std::vector<Place> places;
};

/// The edges or faces of dynmesh's mesh, whose ids are those of the input.
std::unique_ptr<EditedTds3> ReadyToEdit(const Fixture& fixture, EntityKind kind,
                                        const std::vector<Slot>& places) {
  const Mesh& mesh = fixture.mesh;
  auto ready = std::make_unique<EditedTds3>();
  ready->peer = BuildCgalTds3(fixture.input);
  for (Slot place : places) {
    const bool edge = kind == EntityKind::kEdge;
    const FaceId f = edge ? mesh.IncidentFaces(EdgeId(place))[0] : FaceId(place);
    const CellId c = mesh.IncidentCells(f)[0];
    const auto cell = ready->peer->cells[c.slot()];
    const auto index = [&](VertexId v) { return cell->index(ready->peer->vertices[v.slot()]); };
    if (edge) {
      ready->places.push_back(
          {cell, index(mesh.Vertices(EdgeId(place))[0]), index(mesh.Vertices(EdgeId(place))[1])});
    } else {
      int across = 0 + 1 + 2 + 3;
      for (VertexId v : mesh.Vertices(f)) across -= index(v);
      ready->places.push_back({cell, across, 0});
    }
  }
  return ready;
}

size_t SplitEdges(EditedTds3& edited) {
  for (const auto& [cell, i, j] : edited.places) edited.peer->tds.insert_in_edge(cell, i, j);
  return edited.places.size();
}

size_t SwapFaces(EditedTds3& edited) {
  size_t done = 0;
  for (const auto& [cell, i, j] : edited.places) done += edited.peer->tds.flip(cell, i);
  return done;
}

void RegisterPeerEdits(const Fixture& fixture, const std::string& operator_name, size_t (*edit)(EditedTds3&)) {
  for (const Operator& op : OperatorsFor(fixture.input.type)) {
    if (op.name != operator_name) continue;
    const auto places = std::make_shared<const std::vector<Slot>>(PlacesFor(fixture.mesh, op, kPlaces));
    RegisterPeerEdit(
        "cgal_tds3/edit/" + op.name, places->size(),
        [&fixture, kind = op.kind, places] { return ReadyToEdit(fixture, kind, *places); }, edit);
  }
}

}  // namespace

void RegisterCgalTds3(const Fixture& fixture) {
  const MeshInput& input = fixture.input;
  const FlatMesh& flat = fixture.flat;
  if (input.type != ElementType::kTetrahedron) return;
  const std::shared_ptr<const CgalTds3> peer = BuildCgalTds3(input);
  RegisterPeerBuild("cgal_tds3/build", input.num_elements(), [&] { return BuildCgalTds3(input); });
  RegisterPeerBuild("cgal_tds3/build_by_hash", input.num_elements(),
                    [&] { return BuildCgalTds3ByHash(input); });
  RegisterPeerTask("cgal_tds3/paper_task", SumOfCellEdgeEnds(flat),
                   [peer] { return SumCellEdgeEnds(*peer); });
  RegisterPeerTask("cgal_tds3/relation/v_v", SumOf(flat, kVertexVertices),
                   [peer] { return SumVertexVertices(*peer); });
  RegisterPeerTask("cgal_tds3/relation/v_c", SumOf(flat, kVertexCells),
                   [peer] { return SumVertexCells(*peer); });
  RegisterPeerTask("cgal_tds3/relation/e_c", SumOf(flat, kEdgeCells), [peer] { return SumEdgeCells(*peer); });
  RegisterPeerTask("cgal_tds3/relation/c_c", SumOf(flat, kCellCells), [peer] { return SumCellCells(*peer); });
  RegisterPeerEdits(fixture, "split", SplitEdges);
  RegisterPeerEdits(fixture, "swap_face", SwapFaces);
  RegisterPeerTask("cgal_tds3/boundary/vertices", SumOf(fixture.mesh.Boundary(EntityKind::kVertex)),
                   [peer] { return SumBoundaryVertices(*peer); });
}

}  // namespace dynmesh::bench
