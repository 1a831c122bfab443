// What changed, against copying the same bytes: into new memory, as an answer needs it, and into memory that
// is warm.

#include <benchmark/benchmark.h>
#include <malloc.h>

#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "core/delta/diff.h"
#include "tests/bench/edits.h"
#include "tests/bench/tasks.h"

namespace dynmesh::bench {
namespace {

struct Bytes {
  const void* data;
  size_t size;
};

template <typename T>
void Append(const std::vector<T>& items, std::vector<Bytes>& arrays) {
  if (!items.empty()) arrays.push_back({items.data(), items.size() * sizeof(T)});
}

std::vector<Bytes> ArraysOf(const Delta& delta) {
  std::vector<Bytes> arrays;
  Append(delta.removed_vertices, arrays);
  Append(delta.vertex_slots, arrays);
  Append(delta.positions, arrays);
  for (const ElementChanges& changes : delta.elements) {
    Append(changes.removed, arrays);
    Append(changes.slots, arrays);
    Append(changes.types, arrays);
    Append(changes.vertices, arrays);
  }
  return arrays;
}

using Copy = std::vector<std::unique_ptr<char[]>>;

Copy Allocate(const std::vector<Bytes>& arrays) {
  Copy copy;
  for (const Bytes& bytes : arrays) copy.push_back(std::make_unique_for_overwrite<char[]>(bytes.size));
  return copy;
}

void CopyInto(const Copy& copy, const std::vector<Bytes>& arrays) {
  for (size_t i = 0; i < arrays.size(); ++i) std::memcpy(copy[i].get(), arrays[i].data, arrays[i].size);
  benchmark::ClobberMemory();
}

/// Much memory, that is: what was freed would be warm, or not, as chance has it.
constexpr size_t kMuch = 1 << 20;

template <typename Task>
void Register(const std::string& name, size_t bytes, Task task) {
  const auto run = [bytes, task](benchmark::State& state) {
    for (auto _ : state) {
      if (bytes >= kMuch) {
        state.PauseTiming();
        malloc_trim(0);
        state.ResumeTiming();
      }
      task();
    }
    state.SetBytesProcessed(state.iterations() * bytes);
  };
  benchmark::RegisterBenchmark(name.c_str(), run)->Unit(benchmark::kMicrosecond);
}

/// What changed in `mesh` since `from`, and copying that.
void RegisterCase(const std::string& task, std::shared_ptr<const Mesh> mesh, int64_t from) {
  const auto delta = std::make_shared<const Delta>(Diff(*mesh, from));
  const std::vector<Bytes> arrays = ArraysOf(*delta);
  size_t bytes = 0;
  for (const Bytes& array : arrays) bytes += array.size;
  const auto warm = std::make_shared<const Copy>(Allocate(arrays));
  Register(task + "/on_demand", bytes, [mesh, from] { benchmark::DoNotOptimize(Diff(*mesh, from)); });
  Register(task + "/limit", bytes, [delta, arrays] { CopyInto(Allocate(arrays), arrays); });
  Register(task + "/limit_warm", bytes, [delta, arrays, warm] { CopyInto(*warm, arrays); });
}

std::shared_ptr<const Mesh> WithReplaced(const Fixture& fixture, const Patch& patch) {
  auto mesh = std::make_shared<Mesh>(fixture.mesh.Clone());
  const Edit batch[] = {patch.remove, patch.add};
  Must(ApplyBatch(*mesh, batch, {}));
  return mesh;
}

}  // namespace

void RegisterDiff(const Fixture& fixture) {
  const MeshInput& input = fixture.input;
  const auto whole = std::make_shared<const Mesh>(fixture.mesh.Clone());
  RegisterCase("diff/one_edit",
               WithReplaced(fixture, PatchOf(input, {static_cast<Slot>(input.num_elements() / 2)})), 1);
  RegisterCase("diff/1_percent", WithReplaced(fixture, NeighbouringElements(input, 0.01)), 1);
  RegisterCase("diff/all", whole, 0);
}

}  // namespace dynmesh::bench
