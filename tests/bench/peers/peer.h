#ifndef DYNMESH_TESTS_BENCH_PEERS_PEER_H_
#define DYNMESH_TESTS_BENCH_PEERS_PEER_H_

#include <benchmark/benchmark.h>

#include <memory>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "tests/bench/build_timing.h"
#include "tests/bench/digest.h"
#include "tests/bench/fixture.h"

/// What the peers share. A peer names vertices and elements by the indices of the input, so the sums that its
/// walks give can be compared with those of the flat arrays.
namespace dynmesh::bench {

/// A task whose answer is a sum. Ends the program unless it is `expected`.
template <typename Task>
void RegisterPeerTask(const std::string& name, uint64_t expected, Task task) {
  CheckSame(task() == expected, "peer", name.c_str());
  const auto run = [task](benchmark::State& state) {
    for (auto _ : state) benchmark::DoNotOptimize(task());
  };
  benchmark::RegisterBenchmark(("peer/" + name).c_str(), run)->Unit(benchmark::kMillisecond);
}

/// `make` returns a pointer to what it builds, which is destroyed outside the time.
template <typename Make>
void RegisterPeerBuild(const std::string& name, size_t num_elements, Make make) {
  RegisterTimedBuild("peer/" + name, num_elements, make);
}

/// Edits of `items` places. `make` returns a pointer to what is edited, ready and with the places found, and
/// `edit(*made)` how many edits it did; only that is timed.
template <typename Make, typename Edit>
void RegisterPeerEdit(const std::string& name, size_t items, Make make, Edit edit) {
  constexpr int kIterations = 3;  // each makes a mesh
  const auto run = [name, items, make, edit](benchmark::State& state) {
    for (auto _ : state) {
      state.PauseTiming();
      auto made = make();
      state.ResumeTiming();
      const size_t done = edit(*made);
      state.PauseTiming();
      CheckSame(done == items, "peer", name.c_str());
      made.reset();
      state.ResumeTiming();
    }
    state.SetItemsProcessed(state.iterations() * items);
  };
  benchmark::RegisterBenchmark(("peer/" + name).c_str(), run)
      ->Unit(benchmark::kMillisecond)
      ->Iterations(kIterations);
}

/// Sum of all entries of a relation.
inline uint64_t SumOf(const FlatMesh& flat, Relation relation) {
  const std::vector<uint32_t>& ids = flat.of(relation).ids;
  return std::accumulate(ids.begin(), ids.end(), uint64_t{0});
}

/// Sum of the ends of the edges of all cells.
inline uint64_t SumOfCellEdgeEnds(const FlatMesh& flat) {
  const FlatRows& ends = flat.rows[1][0];
  uint64_t sum = 0;
  for (uint32_t e : flat.rows[3][1].ids) sum += uint64_t{ends.ids[2 * e]} + ends.ids[2 * e + 1];
  return sum;
}

/// Sum of the members of a boundary set.
inline uint64_t SumOf(const BitSet& set) {
  uint64_t sum = 0;
  set.ForEach([&](Slot slot) { sum += slot; });
  return sum;
}

inline constexpr Relation kVertexVertices = {EntityKind::kVertex, EntityKind::kVertex};
inline constexpr Relation kVertexFaces = {EntityKind::kVertex, EntityKind::kFace};
inline constexpr Relation kVertexCells = {EntityKind::kVertex, EntityKind::kCell};
inline constexpr Relation kEdgeCells = {EntityKind::kEdge, EntityKind::kCell};
inline constexpr Relation kCellCells = {EntityKind::kCell, EntityKind::kCell};

}  // namespace dynmesh::bench

#endif  // DYNMESH_TESTS_BENCH_PEERS_PEER_H_
