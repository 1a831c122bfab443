// Whether the cost of a tetrahedron stays what it is as meshes grow.
//
// usage: scale_bench NUM_TETRAHEDRA [--benchmark_...]

#include <benchmark/benchmark.h>

#include <iostream>
#include <string>
#include <utility>

#include "absl/strings/numbers.h"
#include "core/mesh/relations.h"
#include "tests/bench/arguments.h"
#include "tests/bench/digest.h"
#include "tests/bench/fixture.h"

namespace dynmesh::bench {
namespace {

void Bulk(benchmark::State& state, const MeshInput* input) {
  for (auto _ : state) {
    Mesh mesh = BuildMesh(*input);
    benchmark::DoNotOptimize(&mesh);
    state.PauseTiming();
    { const Mesh gone = std::move(mesh); }
    state.ResumeTiming();
  }
  state.SetItemsProcessed(state.iterations() * input->num_elements());
}

void PaperTask(benchmark::State& state, const Mesh* mesh) {
  for (auto _ : state) {
    Sum sum;
    ForEachRow(*mesh, {EntityKind::kCell, EntityKind::kEdge},
               [&](Slot slot, absl::Span<const Slot> row) { sum(slot, row); });
    benchmark::DoNotOptimize(sum.value);
  }
  state.SetItemsProcessed(state.iterations() * mesh->NumLive(EntityKind::kCell));
}

}  // namespace
}  // namespace dynmesh::bench

int main(int argc, char** argv) {
  using namespace dynmesh;         // NOLINT: this is the program
  using namespace dynmesh::bench;  // NOLINT
  UseNewPages();
  uint32_t count = 0;
  if (argc < 2 || !absl::SimpleAtoi(argv[1], &count) || count == 0) {
    std::cerr << "usage: " << argv[0] << " NUM_TETRAHEDRA [--benchmark_...]\n";
    return 2;
  }
  argv[1] = argv[0];
  const MeshInput input = HilbertSorted(GenerateMesh(ElementType::kTetrahedron, count));
  DescribeInput(input, "hilbert");
  const Mesh mesh = BuildMesh(input);
  Mesh stored = mesh.Clone();
  Must(stored.StoreRelation({EntityKind::kCell, EntityKind::kEdge}, true));
  benchmark::RegisterBenchmark("scale/bulk", Bulk, &input)->Unit(benchmark::kMillisecond);
  benchmark::RegisterBenchmark("scale/paper_task/on_demand", PaperTask, &mesh)->Unit(benchmark::kMillisecond);
  benchmark::RegisterBenchmark("scale/paper_task/stored", PaperTask, &stored)->Unit(benchmark::kMillisecond);
  return RunBenchmarks(argc - 1, argv + 1);
}
