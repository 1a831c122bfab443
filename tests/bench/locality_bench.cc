// On-demand queries on the mesh as it was built, and after a quarter of its elements was replaced by local
// edits.

#include <benchmark/benchmark.h>

#include <memory>
#include <string>

#include "core/mesh/relations.h"
#include "tests/bench/digest.h"
#include "tests/bench/edits.h"
#include "tests/bench/tasks.h"

namespace dynmesh::bench {
namespace {

constexpr double kShare = 0.25;

void Register(const std::string& name, std::shared_ptr<const Mesh> mesh, Relation relation) {
  const auto run = [mesh, relation](benchmark::State& state) {
    for (auto _ : state) {
      Sum sum;
      ForEachRow(*mesh, relation, [&](Slot slot, absl::Span<const Slot> row) { sum(slot, row); });
      benchmark::DoNotOptimize(sum.value);
    }
    state.SetItemsProcessed(state.iterations() * mesh->NumLive(relation.from));
  };
  benchmark::RegisterBenchmark(name.c_str(), run)->Unit(benchmark::kMillisecond);
}

uint64_t NumEntries(const Mesh& mesh, Relation relation) {
  uint64_t entries = 0;
  ForEachRow(mesh, relation, [&](Slot, absl::Span<const Slot> row) { entries += row.size(); });
  return entries;
}

}  // namespace

void RegisterLocality(const Fixture& fixture) {
  const auto fresh = std::make_shared<const Mesh>(fixture.mesh.Clone());
  auto mesh = std::make_shared<Mesh>(fixture.mesh.Clone());
  ReplaceInPatches(fixture.input, kShare, *mesh);
  const std::shared_ptr<const Mesh> replaced = std::move(mesh);
  for (Relation relation : kStorableRelations) {
    if (fixture.flat.of(relation).size() == 0) continue;
    const std::string name = NameOf(relation);
    CheckSame(NumEntries(*fresh, relation) == NumEntries(*replaced, relation), "locality", name.c_str());
    Register("locality/fresh/" + name, fresh, relation);
    Register("locality/replaced_25_percent/" + name, replaced, relation);
  }
}

}  // namespace dynmesh::bench
