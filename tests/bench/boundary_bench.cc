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

/// Calls fn(id) for each member, by blocks that stay in the cache.
template <typename Fn>
void ForEachCollected(const BitSet& set, Fn fn) {
  std::array<Slot, 1024> block;
  for (Slot next = 0;;) {
    const size_t count = set.Collect(next, block.data(), block.size());
    for (size_t i = 0; i < count; ++i) fn(block[i]);
    if (count < block.size()) return;
    next = block[count - 1] + 1;
  }
}

uint64_t SumCollected(const BitSet& set) {
  uint64_t sum = 0;
  ForEachCollected(set, [&](Slot id) { sum += id; });
  return sum;
}

uint64_t SumOf(const std::vector<Slot>& ids) {
  uint64_t sum = 0;
  for (Slot id : ids) sum += id;
  return sum;
}

/// What a viewer would do with an id: look up where its vertices are.
struct HeightSum {
  const Mesh* mesh;
  double value = 0;

  void operator()(VertexId v) { value += mesh->Position(v)[2]; }
  void operator()(EdgeId e) {
    for (VertexId v : mesh->Vertices(e)) (*this)(v);
  }
  void operator()(FaceId f) {
    for (VertexId v : mesh->Vertices(f)) (*this)(v);
  }
};

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
    if (kind == side) {
      on[i] = true;
    } else {
      for (uint32_t id : flat.of({side, kind}).Row(i)) on[id] = true;
    }
  }
  std::vector<Slot> ids;
  for (uint32_t i = 0; i < on.size(); ++i) {
    if (on[i]) ids.push_back(i);
  }
  return ids;
}

/// Listing alone: against reading an array. In blocks and at once.
void RegisterListing(const BitSet& set, const std::vector<Slot>& ids, const std::string& task) {
  const auto listed = std::make_shared<std::vector<Slot>>();
  set.ListMembers(*listed);
  CheckSame(*listed == ids, task.c_str(), "list");
  CheckSame(SumCollected(set) == SumOf(ids), task.c_str(), "collect");
  Register(task + "/limit", ids.size(), [ids] { return SumOf(ids); });
  Register(task + "/collect", ids.size(), [&set] { return SumCollected(set); });
  Register(task + "/list", ids.size(), [&set, listed] {
    set.ListMembers(*listed);
    return listed->data();
  });
}

/// Listing to look something up: against the same with the ids at hand.
template <typename Id>
void RegisterUse(const Mesh& mesh, const std::vector<Slot>& ids, const std::string& task) {
  const auto from_array = [&mesh, ids] {
    HeightSum sum{&mesh};
    for (Slot id : ids) sum(Id(id));
    return sum.value;
  };
  const auto from_set = [&mesh] {
    HeightSum sum{&mesh};
    ForEachCollected(mesh.Boundary(Id::kKind), [&](Slot id) { sum(Id(id)); });
    return sum.value;
  };
  CheckSame(from_array() == from_set(), task.c_str(), "use");
  Register(task + "/limit", ids.size(), from_array);
  Register(task + "/collect", ids.size(), from_set);
}

template <typename Id>
void RegisterKind(const Fixture& fixture, const std::string& name) {
  const std::vector<Slot> ids = BoundaryOf(fixture.flat, Id::kKind);
  RegisterListing(fixture.mesh.Boundary(Id::kKind), ids, "boundary/" + name);
  RegisterUse<Id>(fixture.mesh, ids, "boundary/" + name + "_used");
}

}  // namespace

void RegisterBoundary(const Fixture& fixture) {
  fixture.flat.has_cells() ? RegisterKind<FaceId>(fixture, "faces") : RegisterKind<EdgeId>(fixture, "edges");
  RegisterKind<VertexId>(fixture, "vertices");
}

}  // namespace dynmesh::bench
