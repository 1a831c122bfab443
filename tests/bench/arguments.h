#ifndef DYNMESH_TESTS_BENCH_ARGUMENTS_H_
#define DYNMESH_TESTS_BENCH_ARGUMENTS_H_

#include <string>

#include "tests/bench/mesh_source.h"

namespace dynmesh::bench {

/// Makes large arrays always come from new pages: else what happened to be freed before decides who gets warm
/// ones. Call it first of all.
void UseNewPages();

/// The mesh that the first two arguments name, which are taken away: its source (see ReadMeshInput) and its
/// order, "raw" (that of the source; a generated mesh is shuffled) or "hilbert". Ends the program when they
/// are wrong.
MeshInput InputOfArguments(int& argc, char** argv);

/// Puts what is measured into the context of the report.
void DescribeInput(const MeshInput& input, const std::string& order);

/// Runs the benchmarks that were registered, as the other arguments want it; returns the program's exit code.
int RunBenchmarks(int argc, char** argv);

}  // namespace dynmesh::bench

#endif  // DYNMESH_TESTS_BENCH_ARGUMENTS_H_
