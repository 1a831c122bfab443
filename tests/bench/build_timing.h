#ifndef DYNMESH_TESTS_BENCH_BUILD_TIMING_H_
#define DYNMESH_TESTS_BENCH_BUILD_TIMING_H_

#include <benchmark/benchmark.h>

#include <string>
#include <utility>

namespace dynmesh::bench {

/// Times make(), whose result is destroyed outside the time.
template <typename Make>
void RegisterTimedBuild(const std::string& name, size_t num_elements, Make make) {
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

}  // namespace dynmesh::bench

#endif  // DYNMESH_TESTS_BENCH_BUILD_TIMING_H_
