// All tasks on one mesh in one order.
//
// usage: core_bench MESH raw|hilbert [--benchmark_...]

#include "tests/bench/arguments.h"
#include "tests/bench/tasks.h"

int main(int argc, char** argv) {
  using namespace dynmesh::bench;  // NOLINT: this is the program
  UseNewPages();
  const Fixture fixture(InputOfArguments(argc, argv));
  RegisterBuild(fixture);
  RegisterRelations(fixture);
  RegisterBoundary(fixture);
  RegisterEdits(fixture);
  RegisterOperators(fixture);
  RegisterDiff(fixture);
  RegisterLocality(fixture);
#ifdef DYNMESH_BENCH_CGAL
  RegisterCgalTds3(fixture);
  RegisterCgalSurfaceMesh(fixture);
#endif
#ifdef DYNMESH_BENCH_OPENMESH
  RegisterOpenMesh(fixture);
#endif
#ifdef DYNMESH_BENCH_VTK
  RegisterVtk(fixture);
#endif
  return RunBenchmarks(argc, argv);
}
