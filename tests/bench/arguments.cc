#include "tests/bench/arguments.h"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <iostream>
#include <string>

#include "tests/bench/fixture.h"

namespace dynmesh::bench {

MeshInput InputOfArguments(int& argc, char** argv) {
  const std::string source = argc > 2 ? argv[1] : "", order = argc > 2 ? argv[2] : "";
  if (order != "raw" && order != "hilbert") {
    std::cerr << "usage: " << argv[0] << " MESH raw|hilbert [--benchmark_...]\n";
    std::exit(2);
  }
  std::rotate(argv + 1, argv + 3, argv + argc);
  argc -= 2;
  MeshInput input = Must(ReadMeshInput(source));
  if (order == "hilbert") return HilbertSorted(input);
  return source.find(':') != std::string::npos ? Shuffled(input) : input;
}

int RunBenchmarks(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
  return 0;
}

}  // namespace dynmesh::bench
