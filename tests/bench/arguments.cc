#include "tests/bench/arguments.h"

#include <benchmark/benchmark.h>
#include <malloc.h>

#include <algorithm>
#include <iostream>
#include <string>

#include "tests/bench/fixture.h"

namespace dynmesh::bench {

void UseNewPages() { mallopt(M_MMAP_THRESHOLD, 128 << 10); }

MeshInput InputOfArguments(int& argc, char** argv) {
  const std::string source = argc > 2 ? argv[1] : "", order = argc > 2 ? argv[2] : "";
  if (order != "raw" && order != "hilbert") {
    std::cerr << "usage: " << argv[0] << " MESH raw|hilbert [--benchmark_...]\n";
    std::exit(2);
  }
  std::rotate(argv + 1, argv + 3, argv + argc);
  argc -= 2;
  MeshInput input = Must(ReadMeshInput(source));
  DescribeInput(input, order);
  if (order == "hilbert") return HilbertSorted(input);
  return source.find(':') != std::string::npos ? Shuffled(input) : input;
}

void DescribeInput(const MeshInput& input, const std::string& order) {
  benchmark::AddCustomContext("type", std::string(ElementTypeName(input.type)));
  benchmark::AddCustomContext("elements", std::to_string(input.num_elements()));
  benchmark::AddCustomContext("vertices", std::to_string(input.points.size()));
  benchmark::AddCustomContext("order", order);
}

int RunBenchmarks(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
  return 0;
}

}  // namespace dynmesh::bench
