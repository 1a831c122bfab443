#include "tests/bench/mesh_source.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <numeric>
#include <random>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "core/mesh/error.h"
#include "core/mesh/spatial_order.h"

namespace dynmesh::bench {
namespace {

static_assert(std::endian::native == std::endian::little);

struct NamedType {
  ElementType type;
  const char* generated;
  const char* file;
};
constexpr NamedType kTypes[] = {{ElementType::kTetrahedron, "tetrahedra:", "tetra.u32"},
                                {ElementType::kHexahedron, "hexahedra:", "hexahedron.u32"},
                                {ElementType::kTriangle, "triangles:", "triangle.u32"}};

absl::Status Damaged(const std::string& path, const char* what) {
  return absl::DataLossError(absl::StrCat(path, ": ", what));
}

/// All of a file as rows of T.
template <typename T>
absl::Status ReadRows(const std::string& path, size_t row_bytes, std::vector<T>& rows) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file) return absl::NotFoundError(absl::StrCat("cannot open ", path));
  const size_t bytes = file.tellg();
  if (bytes == 0 || bytes % row_bytes != 0) return Damaged(path, "size is no whole number of rows");
  rows.resize(bytes / sizeof(T));
  file.seekg(0);
  file.read(reinterpret_cast<char*>(rows.data()), bytes);
  return file ? absl::OkStatus() : Damaged(path, "cannot be read to its end");
}

absl::Status CheckInput(const std::string& path, const MeshInput& input) {
  for (const Point& p : input.points) {
    if (!std::isfinite(p[0] + p[1] + p[2])) return Damaged(path, "a coordinate is not finite");
  }
  for (VertexId v : input.elements) {
    if (v.slot() >= input.points.size()) return Damaged(path, "an element names a point that is not there");
  }
  return absl::OkStatus();
}

absl::StatusOr<MeshInput> ReadFolder(const std::string& folder) {
  MeshInput input;
  DYNMESH_RETURN_IF_ERROR(ReadRows(folder + "/points.f64", sizeof(Point), input.points));
  for (const NamedType& named : kTypes) {
    const std::string path = absl::StrCat(folder, "/", named.file);
    if (!std::ifstream(path)) continue;
    input.type = named.type;
    DYNMESH_RETURN_IF_ERROR(ReadRows(path, NumVertices(named.type) * sizeof(VertexId), input.elements));
    DYNMESH_RETURN_IF_ERROR(CheckInput(path, input));
    return input;
  }
  return absl::NotFoundError(absl::StrCat("no elements in ", folder));
}

/// The input with vertices[k] = old vertices[order[k]], and elements likewise.
MeshInput Reordered(const MeshInput& input, const Permutation& vertices, const Permutation& elements) {
  const Permutation ranks = Inverse(vertices);
  MeshInput sorted;
  sorted.type = input.type;
  for (uint32_t v : vertices) sorted.points.push_back(input.points[v]);
  sorted.elements.reserve(input.elements.size());
  for (uint32_t element : elements) {
    const VertexId* row = &input.elements[element * input.stride()];
    for (size_t k = 0; k < input.stride(); ++k) sorted.elements.push_back(VertexId(ranks[row[k].slot()]));
  }
  return sorted;
}

Permutation RandomOrder(size_t count, std::mt19937& random) {
  Permutation order(count);
  std::iota(order.begin(), order.end(), 0);
  std::shuffle(order.begin(), order.end(), random);
  return order;
}

}  // namespace

absl::StatusOr<MeshInput> ReadMeshInput(const std::string& source) {
  for (const NamedType& named : kTypes) {
    if (source.rfind(named.generated, 0) != 0) continue;
    uint32_t count;
    if (!absl::SimpleAtoi(source.substr(source.find(':') + 1), &count) || count == 0) {
      return absl::InvalidArgumentError(absl::StrCat("no number of elements in ", source));
    }
    return GenerateMesh(named.type, count);
  }
  return ReadFolder(source);
}

MeshInput HilbertSorted(const MeshInput& input) {
  const Permutation order = HilbertOrder(input.points);
  const Permutation ranks = Inverse(order);
  std::vector<uint32_t> lowest(input.num_elements(), kNoSlot);
  for (size_t i = 0; i < input.elements.size(); ++i) {
    uint32_t& rank = lowest[i / input.stride()];
    rank = std::min(rank, ranks[input.elements[i].slot()]);
  }
  return Reordered(input, order, CountingOrder(lowest, input.points.size()));
}

MeshInput Shuffled(const MeshInput& input) {
  std::mt19937 random(1);
  const Permutation vertices = RandomOrder(input.points.size(), random);
  return Reordered(input, vertices, RandomOrder(input.num_elements(), random));
}

}  // namespace dynmesh::bench
