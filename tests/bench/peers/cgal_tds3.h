#ifndef DYNMESH_TESTS_BENCH_PEERS_CGAL_TDS3_H_
#define DYNMESH_TESTS_BENCH_PEERS_CGAL_TDS3_H_

#include <CGAL/Simple_cartesian.h>
#include <CGAL/Triangulation_cell_base_with_info_3.h>
#include <CGAL/Triangulation_data_structure_3.h>
#include <CGAL/Triangulation_vertex_base_with_info_3.h>

#include <memory>
#include <vector>

#include "tests/bench/mesh_source.h"

namespace dynmesh::bench {

/// CGAL's triangulation data structure with indices of the input as info. The vertex and the cells outside
/// the mesh have kNoSlot.
struct CgalTds3 {
  using Kernel = CGAL::Simple_cartesian<double>;
  using Tds =
      CGAL::Triangulation_data_structure_3<CGAL::Triangulation_vertex_base_with_info_3<uint32_t, Kernel>,
                                           CGAL::Triangulation_cell_base_with_info_3<uint32_t, Kernel>>;

  Tds tds;
  Tds::Vertex_handle outside;
  std::vector<Tds::Vertex_handle> vertices;
  std::vector<Tds::Cell_handle> cells;
};

/// By sorting facets into buckets, as dynmesh does: kinder than CGAL's own builder (tet_soup_to_c3t3.h),
/// which has a hash map of facets. REQUIRES: tetrahedra, a manifold boundary.
std::unique_ptr<CgalTds3> BuildCgalTds3(const MeshInput& input);

/// With a hash map of facets, as CGAL's own builder.
std::unique_ptr<CgalTds3> BuildCgalTds3ByHash(const MeshInput& input);

}  // namespace dynmesh::bench

#endif  // DYNMESH_TESTS_BENCH_PEERS_CGAL_TDS3_H_
