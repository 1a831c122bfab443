#include "tests/bench/edits.h"

#include <algorithm>
#include <numeric>
#include <random>
#include <utility>

#include "core/mesh/spatial_order.h"

namespace dynmesh::bench {
namespace {

constexpr size_t kPatchSize = 100;

size_t NumOf(size_t all, double share) { return all * share; }

std::mt19937 Random() { return std::mt19937(42); }

}  // namespace

Patch PatchOf(const MeshInput& input, std::vector<Slot> elements) {
  Patch patch;
  patch.add.type = input.type;
  patch.add.vertices.reserve(elements.size() * input.stride());
  for (Slot element : elements) {
    const VertexId* row = &input.elements[element * input.stride()];
    for (size_t k = 0; k < input.stride(); ++k) patch.add.vertices.push_back(row[k].slot());
  }
  patch.remove = {input.kind(), std::move(elements)};
  return patch;
}

std::vector<Slot> ElementsAlongCurve(const MeshInput& input) {
  std::vector<Point> centers(input.num_elements(), Point{0, 0, 0});
  for (size_t i = 0; i < input.elements.size(); ++i) {
    const Point& corner = input.points[input.elements[i].slot()];
    for (int axis = 0; axis < 3; ++axis) centers[i / input.stride()][axis] += corner[axis] / input.stride();
  }
  return HilbertOrder(centers);
}

Patch RandomElements(const MeshInput& input, double share) {
  std::vector<Slot> all(input.num_elements()), drawn;
  std::iota(all.begin(), all.end(), 0);
  auto random = Random();
  std::sample(all.begin(), all.end(), std::back_inserter(drawn), NumOf(all.size(), share), random);
  std::shuffle(drawn.begin(), drawn.end(), random);
  return PatchOf(input, std::move(drawn));
}

Patch NeighbouringElements(const MeshInput& input, double share) {
  const std::vector<Slot> curve = ElementsAlongCurve(input);
  const auto begin = curve.begin() + curve.size() / 3;
  return PatchOf(input, std::vector<Slot>(begin, begin + NumOf(curve.size(), share)));
}

void ReplaceInPatches(const MeshInput& input, double share, Mesh& mesh) {
  const std::vector<Slot> curve = ElementsAlongCurve(input);
  std::vector<size_t> patches(curve.size() / kPatchSize);
  std::iota(patches.begin(), patches.end(), 0);
  auto random = Random();
  std::shuffle(patches.begin(), patches.end(), random);
  patches.resize(NumOf(patches.size(), share));
  for (size_t patch : patches) {
    const auto begin = curve.begin() + patch * kPatchSize;
    Patch edits = PatchOf(input, std::vector<Slot>(begin, begin + kPatchSize));
    const Edit batch[] = {std::move(edits.remove), std::move(edits.add)};
    Must(ApplyBatch(mesh, batch, {}));
  }
}

void Apply(Mesh& mesh, const Edit& edit) { Must(ApplyBatch(mesh, {&edit, 1}, {})); }

}  // namespace dynmesh::bench
