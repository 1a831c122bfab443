// A tenth of the elements removed, and added again, as a batch each; lists, counters, stamps and checksums
// kept current.

#include <benchmark/benchmark.h>

#include <memory>
#include <string>

#include "tests/bench/digest.h"
#include "tests/bench/edits.h"
#include "tests/bench/tasks.h"

namespace dynmesh::bench {
namespace {

constexpr double kShare = 0.1;

/// Times `timed` on a copy of the mesh to which `before` was applied, if any.
void Register(const std::string& name, const Mesh& mesh, std::shared_ptr<const Edit> before,
              std::shared_ptr<const Edit> timed) {
  const auto run = [&mesh, before, timed](benchmark::State& state) {
    for (auto _ : state) {
      state.PauseTiming();
      auto copy = std::make_unique<Mesh>(mesh.Clone());
      if (before != nullptr) Apply(*copy, *before);
      state.ResumeTiming();
      Apply(*copy, *timed);
      state.PauseTiming();
      copy.reset();
      state.ResumeTiming();
    }
    state.SetItemsProcessed(state.iterations() * NumItems(*timed));
  };
  benchmark::RegisterBenchmark(name.c_str(), run)->Unit(benchmark::kMillisecond);
}

void RegisterPatch(const Fixture& fixture, const std::string& which, const Patch& patch) {
  const auto remove = std::make_shared<const Edit>(patch.remove);
  const auto add = std::make_shared<const Edit>(patch.add);
  Mesh copy = fixture.mesh.Clone();
  Apply(copy, *remove);
  const Slot left = fixture.mesh.NumElements(fixture.input.kind()) - patch.size();
  CheckSame(copy.NumElements(fixture.input.kind()) == left, "edit", "remove");
  Apply(copy, *add);
  bool same = true;
  for (EntityKind kind : kEntityKinds) same = same && copy.NumLive(kind) == fixture.mesh.NumLive(kind);
  CheckSame(same, "edit", "add");
  Register("edit/remove_cells/" + which, fixture.mesh, nullptr, remove);
  Register("edit/add_cells/" + which, fixture.mesh, remove, add);
}

}  // namespace

void RegisterEdits(const Fixture& fixture) {
  RegisterPatch(fixture, "random", RandomElements(fixture.input, kShare));
  RegisterPatch(fixture, "neighbouring", NeighbouringElements(fixture.input, kShare));
}

}  // namespace dynmesh::bench
