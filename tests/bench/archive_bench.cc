// Keeping a mesh and making it anew of what was kept, against building it of its elements.
//
// usage: archive_bench MESH raw|hilbert [--benchmark_...]

#include <benchmark/benchmark.h>

#include <chrono>
#include <string>
#include <utility>
#include <vector>

#include "core/archive/dirty_pages.h"
#include "core/archive/head.h"
#include "core/archive/page.h"
#include "core/archive/rebuilder.h"
#include "core/archive/record.h"
#include "core/edit/apply_patch.h"
#include "tests/bench/arguments.h"
#include "tests/bench/build_timing.h"
#include "tests/bench/fixture.h"
#include "tests/bench/operators.h"

namespace dynmesh::bench {
namespace {

struct Kept {
  std::string head;
  std::vector<std::string> pages;
  size_t page_bytes = 0;
};

Kept Keep(const Mesh& mesh) {
  Kept kept;
  kept.head = EncodeHead(mesh);
  DirtyPages all;
  all.AddAll(mesh);
  for (PageId page : all.List()) {
    kept.pages.push_back(EncodePage(mesh, page));
    kept.page_bytes += kept.pages.back().size();
  }
  return kept;
}

Rebuilder ReadPages(const Kept& kept) {
  Rebuilder rebuilder = Must(Rebuilder::Start(kept.head));
  for (const std::string& page : kept.pages) Must(rebuilder.AddPage(page));
  return rebuilder;
}

Mesh Rebuild(const Kept& kept) { return Must(ReadPages(kept).Finish()); }

void EncodePages(benchmark::State& state, const Mesh* mesh, size_t page_bytes) {
  for (auto _ : state) {
    const Kept kept = Keep(*mesh);
    benchmark::DoNotOptimize(&kept);
  }
  state.SetBytesProcessed(state.iterations() * page_bytes);
  state.counters["bytes_per_element"] =
      static_cast<double>(page_bytes) /
      (mesh->NumElements(EntityKind::kCell) + mesh->NumElements(EntityKind::kFace));
}

/// Splits edges, a batch each, and calls keep(mesh) in it, which alone is timed.
template <typename KeepBatch>
void TimeSplits(benchmark::State& state, const Mesh& mesh, KeepBatch keep) {
  const Operator split = OperatorsFor(ElementType::kTetrahedron)[0];
  const std::vector<Slot> places = PlacesFor(mesh, split, kPlaces);
  Mesh copy = mesh.Clone();
  size_t next = 0, bytes = 0;
  for (auto _ : state) {
    if (next == places.size()) {
      copy = mesh.Clone();
      next = 0;
    }
    copy.BeginBatch();
    dynmesh::Patch patch;
    AppliedPatch applied;
    Must(split.plan(copy, places[next++], patch));
    Must(ApplyPatch(copy, patch, applied));
    const auto start = std::chrono::steady_clock::now();
    bytes += keep(copy);
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
    state.SetIterationTime(elapsed.count());
    Must(copy.Commit());
  }
  state.SetItemsProcessed(state.iterations());
  if (bytes != 0) state.counters["bytes_per_split"] = static_cast<double>(bytes) / state.iterations();
}

void RecordSplit(benchmark::State& state, const Mesh* mesh) {
  RecordEncoder encoder;
  TimeSplits(state, *mesh, [&](const Mesh& copy) { return encoder.Encode(copy, "").size(); });
}

void MarkSplit(benchmark::State& state, const Mesh* mesh) {
  DirtyPages dirty;
  TimeSplits(state, *mesh, [&](const Mesh& copy) {
    dirty.Add(copy.journal());
    return 0;
  });
}

}  // namespace
}  // namespace dynmesh::bench

int main(int argc, char** argv) {
  using namespace dynmesh;         // NOLINT: this is the program
  using namespace dynmesh::bench;  // NOLINT
  UseNewPages();
  const MeshInput input = InputOfArguments(argc, argv);
  const Mesh mesh = BuildMesh(input);
  const Kept kept = Keep(mesh);
  const size_t count = input.num_elements();
  RegisterTimedBuild("archive/build", count, [&] { return BuildMesh(input); });
  RegisterTimedBuild("archive/read_pages", count, [&] { return ReadPages(kept); });
  RegisterTimedBuild("archive/rebuild", count, [&] { return Rebuild(kept); });
  benchmark::RegisterBenchmark("archive/encode_pages", EncodePages, &mesh, kept.page_bytes)
      ->Unit(benchmark::kMillisecond);
  // As many as there are places: more would time copies of the mesh.
  benchmark::RegisterBenchmark("archive/record_of_split", RecordSplit, &mesh)
      ->UseManualTime()
      ->Iterations(kPlaces);
  benchmark::RegisterBenchmark("archive/mark_split", MarkSplit, &mesh)->UseManualTime()->Iterations(kPlaces);
  return RunBenchmarks(argc, argv);
}
