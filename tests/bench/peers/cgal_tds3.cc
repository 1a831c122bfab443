// CGAL's Triangulation_data_structure_3: tetrahedra and vertices, without ids of edges and faces.

#include "tests/bench/peers/cgal_tds3.h"

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
  RegisterPeerTask("cgal_tds3/boundary/vertices", SumOf(fixture.mesh.Boundary(EntityKind::kVertex)),
                   [peer] { return SumBoundaryVertices(*peer); });
}

}  // namespace dynmesh::bench
