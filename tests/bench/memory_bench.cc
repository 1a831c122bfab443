// Bytes for each element: resident, as the system counts them, and array by array, as the mesh does. A
// program of its own, so that nothing else is resident.
//
// usage: memory_bench MESH raw|hilbert [--benchmark_...]

#include <benchmark/benchmark.h>
#include <malloc.h>
#include <unistd.h>

#include <fstream>
#include <memory>
#include <string>

#include "tests/bench/arguments.h"
#include "tests/bench/fixture.h"

namespace dynmesh::bench {
namespace {

size_t ResidentBytes() {
  malloc_trim(0);
  size_t pages = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> pages >> resident;
  return resident * sysconf(_SC_PAGESIZE);
}

void Count(benchmark::State& state, const Mesh& mesh, size_t num_elements) {
  for (const auto& [name, bytes] : mesh.MemoryByArray()) {
    if (bytes > 0) state.counters["array " + name] = static_cast<double>(bytes) / num_elements;
  }
  state.counters["counted"] = static_cast<double>(mesh.memory_bytes()) / num_elements;
}

/// `stored`: with all storable relations.
template <bool kStored>
void BytesPerElement(benchmark::State& state, const MeshInput* input) {
  for (auto _ : state) {
    const size_t before = ResidentBytes();
    Mesh mesh = BuildMesh(*input);
    if (kStored) {
      for (Relation relation : kStorableRelations) Must(mesh.StoreRelation(relation, true));
    }
    state.counters["resident"] = static_cast<double>(ResidentBytes() - before) / input->num_elements();
    Count(state, mesh, input->num_elements());
  }
}

void FlatBytesPerElement(benchmark::State& state, const MeshInput* input) {
  for (auto _ : state) {
    const FlatMesh mesh = BuildFlatDefault(*input);
    state.counters["counted"] = static_cast<double>(mesh.memory_bytes()) / input->num_elements();
  }
}

}  // namespace
}  // namespace dynmesh::bench

int main(int argc, char** argv) {
  using namespace dynmesh::bench;  // NOLINT: this is the program
  UseNewPages();
  const MeshInput input = InputOfArguments(argc, argv);
  benchmark::RegisterBenchmark("memory/bytes_per_cell/default", BytesPerElement<false>, &input)
      ->Iterations(1);
  benchmark::RegisterBenchmark("memory/bytes_per_cell/all_stored", BytesPerElement<true>, &input)
      ->Iterations(1);
  benchmark::RegisterBenchmark("memory/bytes_per_cell/limit", FlatBytesPerElement, &input)->Iterations(1);
  return RunBenchmarks(argc, argv);
}
