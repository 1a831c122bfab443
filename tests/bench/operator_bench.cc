// Edit operators at random places, as one batch: each planned, checked and carried out, with edges, faces,
// boundary, stamps and checksums kept current. `.../by_elements` does the same by removing elements and
// adding others. `.../batches` are large batches one after the other, as service_bench.py sends them to a
// daemon.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <memory>
#include <numeric>
#include <random>

#include "core/edit/transaction.h"
#include "tests/bench/digest.h"
#include "tests/bench/operators.h"
#include "tests/bench/tasks.h"

namespace dynmesh::bench {
namespace {

using Places = std::shared_ptr<const std::vector<Slot>>;

void OperateAt(Mesh& mesh, const Operator& op, const std::vector<Slot>& places) {
  const Edit edit = op.edit(places);
  Must(ApplyBatch(mesh, absl::MakeConstSpan(&edit, 1), {}).status());
}

/// As a client does who knows nothing but elements.
void ReplaceByElements(Mesh& mesh, const std::vector<dynmesh::Patch>& patches) {
  mesh.BeginBatch();
  std::vector<VertexId> made;
  for (const dynmesh::Patch& patch : patches) {
    made.clear();
    for (const auto& vertex : patch.new_vertices) made.push_back(Must(mesh.AddVertex(vertex.position)));
    for (EntityId id : patch.removed) Must(mesh.RemoveElement(id));
    for (NewElement element : patch.added) {
      for (VertexId& v : element.mutable_vertices()) {
        if (v.slot() & kNewVertex) v = made[v.slot() & ~kNewVertex];
      }
      Must(mesh.AddElement(element.type, element.vertices()));
    }
    for (VertexId v : patch.removed_vertices) Must(mesh.RemoveVertex(v));
  }
  Must(mesh.Commit());
}

/// A copy has no room to grow, and would move all its arrays in the first edit, which no other edit does.
void MakeRoom(ElementType type, Mesh& mesh) {
  std::vector<VertexId> vertices;
  for (int k = 0; k < NumVertices(type); ++k) vertices.push_back(Must(mesh.AddVertex({0, 0, 0})));
  Must(mesh.AddElement(type, vertices));
  Must(mesh.Commit());
}

template <typename Task>
void Register(const std::string& name, const Fixture& fixture, size_t items, Task task) {
  const auto run = [&fixture, items, task](benchmark::State& state) {
    for (auto _ : state) {
      state.PauseTiming();
      auto copy = std::make_unique<Mesh>(fixture.mesh.Clone());
      MakeRoom(fixture.input.type, *copy);
      state.ResumeTiming();
      task(*copy);
      state.PauseTiming();
      copy.reset();
      state.ResumeTiming();
    }
    state.SetItemsProcessed(state.iterations() * items);
  };
  benchmark::RegisterBenchmark(name.c_str(), run)->Unit(benchmark::kMillisecond);
}

void RegisterOperator(const Fixture& fixture, const Operator& op) {
  const Mesh& mesh = fixture.mesh;
  const auto places = std::make_shared<const std::vector<Slot>>(PlacesFor(mesh, op, kPlaces));
  const auto patches = std::make_shared<std::vector<dynmesh::Patch>>(places->size());
  for (size_t i = 0; i < places->size(); ++i) Must(op.plan(mesh, (*places)[i], (*patches)[i]));
  Mesh operated = mesh.Clone(), replaced = mesh.Clone();
  OperateAt(operated, op, *places);
  ReplaceByElements(replaced, *patches);
  for (EntityKind kind : kEntityKinds) {
    CheckSame(operated.NumLive(kind) == replaced.NumLive(kind), op.name.c_str(), "by_elements");
  }
  const std::string name = "edit/" + op.name;
  Register(name, fixture, places->size(), [op, places](Mesh& copy) { OperateAt(copy, op, *places); });
  Register(name + "/by_elements", fixture, places->size(),
           [patches](Mesh& copy) { ReplaceByElements(copy, *patches); });
}

/// Random slots of a kind, `kBatch` a batch.
std::vector<Edit> BatchesOf(const Mesh& mesh, const Operator& op) {
  constexpr size_t kBatch = 10'000, kBatches = 6;
  std::vector<Slot> slots(mesh.slots(op.kind).limit());
  std::iota(slots.begin(), slots.end(), 0);
  std::shuffle(slots.begin(), slots.end(), std::mt19937(1));
  slots.resize(std::min(slots.size(), kBatch * kBatches));
  std::vector<Edit> batches;
  for (auto begin = slots.begin(); begin != slots.end();) {
    const auto end = begin + std::min<std::ptrdiff_t>(kBatch, slots.end() - begin);
    batches.push_back(op.edit({begin, end}));
    begin = end;
  }
  return batches;
}

/// The first batch, which makes arrays move to where they can grow and frees the first slots, is not timed.
void RegisterBatches(const Fixture& fixture, const Operator& op) {
  const auto run = [&fixture, batches = BatchesOf(fixture.mesh, op)](benchmark::State& state) {
    const BatchOptions options{.skip_refused = true};
    uint64_t accepted = 0;
    for (auto _ : state) {
      state.PauseTiming();
      auto copy = std::make_unique<Mesh>(fixture.mesh.Clone());
      Must(ApplyBatch(*copy, absl::MakeConstSpan(batches).first(1), options).status());
      state.ResumeTiming();
      for (size_t i = 1; i < batches.size(); ++i) {
        const BatchResult result = Must(ApplyBatch(*copy, absl::MakeConstSpan(&batches[i], 1), options));
        accepted += result.results[0].new_slots.size() - result.results[0].skipped.size();
      }
      state.PauseTiming();
      copy.reset();
      state.ResumeTiming();
    }
    state.SetItemsProcessed(accepted);
  };
  benchmark::RegisterBenchmark(("edit/" + op.name + "/batches").c_str(), run)->Unit(benchmark::kMillisecond);
}

}  // namespace

void RegisterOperators(const Fixture& fixture) {
  for (const Operator& op : OperatorsFor(fixture.input.type)) {
    RegisterOperator(fixture, op);
    if (op.name == "split") RegisterBatches(fixture, op);  // none of it is refused
  }
}

}  // namespace dynmesh::bench
