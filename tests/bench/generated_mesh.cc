#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>

#include "tests/bench/mesh_source.h"

namespace dynmesh::bench {
namespace {

/// In [-0.1, 0.1), from a number.
double Displacement(uint64_t n) {
  return static_cast<double>(Checksum::Mix(n) >> 40) / (1 << 24) * 0.2 - 0.1;
}

class Grid {
 public:
  Grid(MeshInput& input, size_t nx, size_t ny, size_t nz) : input_(input), nx_(nx), ny_(ny), nz_(nz) {}

  void AddPoints() {
    for (size_t z = 0; z <= nz_; ++z) {
      for (size_t y = 0; y <= ny_; ++y) {
        for (size_t x = 0; x <= nx_; ++x) AddPoint(x, y, z);
      }
    }
  }

  template <typename Fn>
  void ForEachCell(Fn fn) const {
    for (size_t z = 0; z < std::max<size_t>(nz_, 1); ++z) {
      for (size_t y = 0; y < ny_; ++y) {
        for (size_t x = 0; x < nx_; ++x) fn(CornersOf(x, y, z));
      }
    }
  }

 private:
  using Corners = std::array<VertexId, 8>;

  void AddPoint(size_t x, size_t y, size_t z) {
    const uint64_t n = 3 * input_.points.size();
    const double wave = nz_ == 0 ? 8 * std::sin(0.05 * x) * std::cos(0.05 * y) : z;
    input_.points.push_back({x + Displacement(n), y + Displacement(n + 1), wave + Displacement(n + 2)});
  }

  /// In VTK's order of a hexahedron; of a sheet the first four count.
  Corners CornersOf(size_t x, size_t y, size_t z) const {
    const auto at = [&](size_t i, size_t j, size_t k) {
      return VertexId(((z + k) * (ny_ + 1) + y + j) * (nx_ + 1) + x + i);
    };
    return {at(0, 0, 0), at(1, 0, 0), at(1, 1, 0), at(0, 1, 0),
            at(0, 0, 1), at(1, 0, 1), at(1, 1, 1), at(0, 1, 1)};
  }

  MeshInput& input_;
  const size_t nx_, ny_, nz_;
};

/// The six positively oriented tetrahedra of a cell round its diagonal from corner 0 to corner 6.
template <typename Corners, typename Add>
void AddPaths(const Corners& corners, Add add) {
  constexpr int kRing[] = {1, 2, 3, 7, 4, 5};
  for (int i = 0; i < 6; ++i) add(corners, {0, kRing[i], kRing[(i + 1) % 6], 6});
}

/// A cube of about `about` hexahedra, or tetrahedra of which six share a diagonal of each grid cell.
MeshInput CubeGrid(ElementType type, size_t about) {
  const bool tets = type == ElementType::kTetrahedron;
  const size_t side = std::max<size_t>(1, std::lround(std::cbrt(about / (tets ? 6.0 : 1.0))));
  MeshInput input;
  input.type = type;
  Grid grid(input, side, side, side);
  grid.AddPoints();
  const auto add = [&](const auto& corners, std::initializer_list<int> element) {
    for (int corner : element) input.elements.push_back(corners[corner]);
  };
  grid.ForEachCell([&](const auto& corners) {
    if (!tets) add(corners, {0, 1, 2, 3, 4, 5, 6, 7});
    if (tets) AddPaths(corners, add);
  });
  return input;
}

/// An open sheet of about `about` triangles, two to a grid cell.
MeshInput TriangleSheet(size_t about) {
  const size_t side = std::max<size_t>(1, std::lround(std::sqrt(about / 2.0)));
  MeshInput input;
  input.type = ElementType::kTriangle;
  Grid grid(input, side, side, 0);
  grid.AddPoints();
  grid.ForEachCell([&](const auto& corners) {
    for (int corner : {0, 1, 2, 0, 2, 3}) input.elements.push_back(corners[corner]);
  });
  return input;
}

}  // namespace

MeshInput GenerateMesh(ElementType type, size_t about) {
  return type == ElementType::kTriangle ? TriangleSheet(about) : CubeGrid(type, about);
}

}  // namespace dynmesh::bench
