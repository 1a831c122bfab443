// Listing the boundary against reading a plain array of the same ids.

#include <benchmark/benchmark.h>

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "tests/bench/digest.h"
#include "tests/bench/tasks.h"

namespace dynmesh::bench {
namespace {

/// The sum of the members, by blocks that stay in the cache.
uint64_t SumCollected(const BitSet& set) {
  std::array<Slot, 1024> block;
  uint64_t sum = 0;
  for (Slot next = 0;;) {
    const size_t count = set.Collect(next, block.data(), block.size());
    for (size_t i = 0; i < count; ++i) sum += block[i];
    if (count < block.size()) return sum;
    next = block[count - 1] + 1;
  }
}

uint64_t SumOf(const std::vector<Slot>& ids) {
  uint64_t sum = 0;
  for (Slot id : ids) sum += id;
  return sum;
}

template <typename Task>
void Register(const std::string& name, size_t count, Task task) {
  const auto run = [count, task](benchmark::State& state) {
    for (auto _ : state) benchmark::DoNotOptimize(task());
    state.SetItemsProcessed(state.iterations() * count);
  };
  benchmark::RegisterBenchmark(name.c_str(), run)->Unit(benchmark::kMicrosecond);
}

/// The entities of a kind on the boundary, from the flat arrays alone.
std::vector<Slot> BoundaryOf(const FlatMesh& flat, EntityKind kind) {
  const EntityKind side = flat.has_cells() ? EntityKind::kFace : EntityKind::kEdge;
  const FlatRows& uses = flat.of({side, EntityKind(Dimension(side) + 1)});
  std::vector<bool> on(flat.of({kind, EntityKind::kEdge}).size());
  for (uint32_t i = 0; i < uses.size(); ++i) {
    if (uses.Row(i).size() != 1) continue;
    if (kind == side) on[i] = true;
    if (kind != side)
      for (uint32_t id : flat.of({side, kind}).Row(i)) on[id] = true;
  }
  std::vector<Slot> ids;
  for (uint32_t i = 0; i < on.size(); ++i)
    if (on[i]) ids.push_back(i);
  return ids;
}

void RegisterKind(const Fixture& fixture, EntityKind kind, const std::string& task) {
  const BitSet& set = fixture.mesh.Boundary(kind);
  const std::vector<Slot> ids = BoundaryOf(fixture.flat, kind);
  std::vector<Slot> listed;
  set.ListMembers(listed);
  CheckSame(listed == ids, task.c_str(), "list");
  CheckSame(SumCollected(set) == SumOf(ids), task.c_str(), "collect");
  Register(task + "/limit", ids.size(), [ids] { return SumOf(ids); });
  Register(task + "/collect", ids.size(), [&set] { return SumCollected(set); });
  Register(task + "/list", ids.size(), [&set, out = std::make_shared<std::vector<Slot>>()] {
    set.ListMembers(*out);
    return out->data();
  });
}

}  // namespace

void RegisterBoundary(const Fixture& fixture) {
  const EntityKind side = fixture.flat.has_cells() ? EntityKind::kFace : EntityKind::kEdge;
  RegisterKind(fixture, side, fixture.flat.has_cells() ? "boundary/faces" : "boundary/edges");
  RegisterKind(fixture, EntityKind::kVertex, "boundary/vertices");
}

}  // namespace dynmesh::bench
