#ifndef DYNMESH_TESTS_BENCH_TASKS_H_
#define DYNMESH_TESTS_BENCH_TASKS_H_

#include "tests/bench/fixture.h"

/// One function for each family of tasks: it checks that all who do a task give the same answer, then
/// registers a benchmark for each. The fixture must outlive the run. Names are those of table.py.
namespace dynmesh::bench {

void RegisterBuild(const Fixture& fixture);
void RegisterRelations(const Fixture& fixture);
void RegisterBoundary(const Fixture& fixture);
void RegisterEdits(const Fixture& fixture);
void RegisterOperators(const Fixture& fixture);
void RegisterDiff(const Fixture& fixture);
void RegisterLocality(const Fixture& fixture);

/// Peers are there when their packages were found (DYNMESH_BENCH_CGAL, _OPENMESH, _VTK).
void RegisterCgalTds3(const Fixture& fixture);
void RegisterCgalSurfaceMesh(const Fixture& fixture);
void RegisterOpenMesh(const Fixture& fixture);
void RegisterVtk(const Fixture& fixture);

}  // namespace dynmesh::bench

#endif  // DYNMESH_TESTS_BENCH_TASKS_H_
