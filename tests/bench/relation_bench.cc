// Walking all rows of a relation: from plain arrays, stored in the mesh, worked out on demand.

#include <benchmark/benchmark.h>

#include <string>

#include "core/mesh/relations.h"
#include "tests/bench/digest.h"
#include "tests/bench/tasks.h"

namespace dynmesh::bench {
namespace {

/// Whether a Mesh always has the relation: the downward ones but cell->edges, and upward by one dimension.
constexpr bool IsAlwaysStored(Relation relation) {
  const int from = Dimension(relation.from), to = Dimension(relation.to);
  return to < from ? !(from == 3 && to == 1) : to == from + 1;
}

/// `walk(fn)` calls fn(slot, row) for every row.
template <typename Walk>
void Register(const std::string& name, size_t num_rows, Walk walk) {
  const auto run = [num_rows, walk](benchmark::State& state) {
    for (auto _ : state) {
      Sum sum;
      walk(sum);
      benchmark::DoNotOptimize(sum.value);
    }
    state.SetItemsProcessed(state.iterations() * num_rows);
  };
  benchmark::RegisterBenchmark(name.c_str(), run)->Unit(benchmark::kMillisecond);
}

/// One relation of a fixture.
class RelationTask {
 public:
  RelationTask(const Fixture& fixture, Relation relation)
      : fixture_(fixture), relation_(relation), num_rows_(fixture.flat.of(relation).size()) {}

  void RegisterAs(const std::string& task) const {
    const Walks walks{&fixture_, relation_};
    Fingerprint limit, stored, on_demand;
    walks.Limit(limit);
    walks.OnDemand(on_demand);
    CheckSame(on_demand == limit, task.c_str(), "on_demand");
    Register(task + "/limit", num_rows_, [walks](Sum& sum) { walks.Limit(sum); });
    Register(task + "/on_demand", num_rows_, [walks](Sum& sum) { walks.OnDemand(sum); });
    if (!walks.IsStored()) return;
    walks.Stored(stored);
    CheckSame(stored == limit, task.c_str(), "stored");
    Register(task + "/stored", num_rows_, [walks](Sum& sum) { walks.Stored(sum); });
  }

 private:
  struct Walks {
    const Fixture* fixture;
    Relation relation;

    bool IsStorable() const { return StorableIndex(relation) < kNumStorableRelations; }
    bool IsStored() const { return IsStorable() || IsAlwaysStored(relation); }

    template <typename Fn>
    void Limit(Fn& fn) const {
      ForEachFlatRow(fixture->flat.of(relation), fn);
    }
    template <typename Fn>
    void OnDemand(Fn& fn) const {
      ForEachRow(fixture->mesh, relation, [&](Slot slot, absl::Span<const Slot> row) { fn(slot, row); });
    }
    template <typename Fn>
    void Stored(Fn& fn) const {
      ForEachRow(fixture->stored, relation, [&](Slot slot, absl::Span<const Slot> row) { fn(slot, row); });
    }
  };

  const Fixture& fixture_;
  const Relation relation_;
  const size_t num_rows_;
};

}  // namespace

void RegisterRelations(const Fixture& fixture) {
  constexpr Relation kPaperTask = {EntityKind::kCell, EntityKind::kEdge};
  if (fixture.flat.has_cells()) RelationTask(fixture, kPaperTask).RegisterAs("paper_task");
  for (EntityKind from : kEntityKinds) {
    for (EntityKind to : kEntityKinds) {
      const Relation relation{from, to};
      if (fixture.flat.of(relation).size() == 0) continue;
      RelationTask(fixture, relation).RegisterAs("relation/" + NameOf(relation));
    }
  }
}

}  // namespace dynmesh::bench
