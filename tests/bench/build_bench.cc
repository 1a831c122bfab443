// A whole mesh from its elements: in bulk, one by one, and as plain arrays.

#include <benchmark/benchmark.h>

#include <functional>
#include <string>

#include "tests/bench/tasks.h"

namespace dynmesh::bench {
namespace {

/// `make` returns what is built, which is destroyed outside the time.
template <typename Make>
void Register(const std::string& name, size_t num_elements, Make make) {
  const auto run = [num_elements, make](benchmark::State& state) {
    for (auto _ : state) {
      auto made = make();
      benchmark::DoNotOptimize(&made);
      state.PauseTiming();
      { const auto gone = std::move(made); }
      state.ResumeTiming();
    }
    state.SetItemsProcessed(state.iterations() * num_elements);
  };
  benchmark::RegisterBenchmark(name.c_str(), run)->Unit(benchmark::kMillisecond);
}

Mesh BuildOneByOne(const MeshInput& input) {
  Mesh mesh;
  for (const Point& point : input.points) Must(mesh.AddVertex(point));
  for (size_t i = 0; i < input.elements.size(); i += input.stride()) {
    Must(mesh.AddElement(input.type, absl::MakeConstSpan(&input.elements[i], input.stride())));
  }
  Must(mesh.Commit());
  return mesh;
}

FlatMesh BuildAllFlat(const MeshInput& input) {
  FlatMesh mesh = BuildFlatDefault(input);
  AddFlatStorable(mesh);
  return mesh;
}

Mesh BuildWithStored(const MeshInput& input) {
  Mesh mesh = BuildMesh(input);
  for (Relation relation : kStorableRelations) Must(mesh.StoreRelation(relation, true));
  return mesh;
}

}  // namespace

void RegisterBuild(const Fixture& fixture) {
  const MeshInput& input = fixture.input;
  const size_t count = input.num_elements();
  Register("build/bulk", count, [&] { return BuildMesh(input); });
  Register("build/bulk_hilbert", count, [&] { return BuildMesh(input, SlotOrder::kHilbert); });
  Register("build/bulk_all_relations", count, [&] { return BuildWithStored(input); });
  Register("build/one_by_one", count, [&] { return BuildOneByOne(input); });
  Register("build/limit", count, [&] { return BuildFlatDefault(input); });
  Register("build/limit_hilbert", count, [&] { return BuildFlatDefault(HilbertSorted(input)); });
  Register("build/limit_all_relations", count, [&] { return BuildAllFlat(input); });
}

}  // namespace dynmesh::bench
