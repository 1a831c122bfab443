// A whole mesh from its elements: in bulk, one by one, and as plain arrays.

#include <benchmark/benchmark.h>

#include <functional>
#include <string>

#include "tests/bench/build_timing.h"
#include "tests/bench/tasks.h"

namespace dynmesh::bench {
namespace {

Mesh BuildOneByOne(const MeshInput& input) {
  Mesh mesh;
  for (const Point& point : input.points) Must(mesh.AddVertex(point));
  for (size_t i = 0; i < input.elements.size(); i += input.stride()) {
    Must(mesh.AddElement(input.type, absl::MakeConstSpan(&input.elements[i], input.stride())));
  }
  Must(mesh.Commit());
  return mesh;
}

FlatMesh BuildAllFlat(const MeshInput& input) {
  FlatMesh mesh = BuildFlatDefault(input);
  AddFlatStorable(mesh);
  return mesh;
}

Mesh BuildWithStored(const MeshInput& input) {
  Mesh mesh = BuildMesh(input);
  for (Relation relation : kStorableRelations) Must(mesh.StoreRelation(relation, true));
  return mesh;
}

}  // namespace

void RegisterBuild(const Fixture& fixture) {
  const MeshInput& input = fixture.input;
  const size_t count = input.num_elements();
  RegisterTimedBuild("build/bulk", count, [&] { return BuildMesh(input); });
  RegisterTimedBuild("build/bulk_hilbert", count, [&] { return BuildMesh(input, SlotOrder::kHilbert); });
  RegisterTimedBuild("build/bulk_all_relations", count, [&] { return BuildWithStored(input); });
  RegisterTimedBuild("build/one_by_one", count, [&] { return BuildOneByOne(input); });
  RegisterTimedBuild("build/limit", count, [&] { return BuildFlatDefault(input); });
  RegisterTimedBuild("build/limit_hilbert", count, [&] { return BuildFlatDefault(HilbertSorted(input)); });
  RegisterTimedBuild("build/limit_all_relations", count, [&] { return BuildAllFlat(input); });
}

}  // namespace dynmesh::bench
