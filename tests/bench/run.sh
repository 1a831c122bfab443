#!/usr/bin/env bash
# Builds and runs the benchmarks of core/, of the store and of the daemon, prints ratios with their targets, writes RESULTS.md and
# build/bench/core.json. Wants a quiet machine and some twenty minutes.
#
# usage: tests/bench/run.sh
#   MESHES=DIR       the largest mesh of each element type in DIR/*.vtu (default: ../shared/meshes beside the
#                    checkout, if there); types that are missing are generated
#   REPETITIONS=N    medians over so many interleaved repetitions (default 5)
#   MIN_TIME=S       seconds for each benchmark and repetition (default 0.2)
#   SCALE=N...       sizes of the scale sweep (default "100000 800000"; add 10000000 where there are 16 GB)
#   SIZES="T H F"    tetrahedra, hexahedra, triangles of generated meshes (default "800000 250000 270000")
#   RESULTS=FILE     (default tests/bench/RESULTS.md)
set -euo pipefail
cd "$(dirname "$0")/../.."

meshes=${MESHES:-../shared/meshes}
build=build/bench
arrays=$build/meshes
reports=$build/reports
read -r -a sizes <<<"${SIZES:-800000 250000 270000}"
flags=(
  "--benchmark_repetitions=${REPETITIONS:-5}"
  "--benchmark_min_time=${MIN_TIME:-0.2}"
  --benchmark_enable_random_interleaving=true
  --benchmark_report_aggregates_only=true
  --benchmark_out_format=json
)
[ -z "${MESHES:-}" ] || [ -d "$meshes" ] || { echo "run.sh: no folder $meshes" >&2; exit 2; }

cmake --preset release -B $build -DDYNMESH_BENCH=ON -DDYNMESH_TESTS=OFF -DDYNMESH_SERVER=ON -DDYNMESH_PYTHON=ON \
  >/dev/null
cmake --build $build --target core_bench memory_bench scale_bench store_bench store_latency_bench dynmeshd dynmesh_python
rm -rf $reports $arrays
mkdir -p $reports $arrays

for file in "$meshes"/*.vtu; do
  [ ! -e "$file" ] || /usr/bin/python3 tests/bench/to_arrays.py "$file" "$arrays/$(basename "$file" .vtu)"
done

# The folder with the most elements of a type, or the generated mesh.
source_of() { # file of the elements, generated mesh
  local largest
  largest=$(find $arrays -name "$1" -printf '%s %h\n' | sort -n | tail -1 | cut -d' ' -f2-)
  echo "${largest:-$2}"
}

run() { # report, program, arguments...
  echo "== ${*:2}"
  $build/tests/bench/"$2" "${@:3}" "${flags[@]}" "--benchmark_out=$reports/$1.json" >$reports/log 2>&1 ||
    { cat $reports/log >&2; exit 1; }
}

sources=(
  "$(source_of tetra.u32 "tetrahedra:${sizes[0]}")"
  "$(source_of hexahedron.u32 "hexahedra:${sizes[1]}")"
  "$(source_of triangle.u32 "triangles:${sizes[2]}")"
)
for source in "${sources[@]}"; do
  name=$(basename "${source//:/_}")
  for order in raw hilbert; do
    run "core.$name.$order" core_bench "$source" $order
  done
  run "memory.$name.hilbert" memory_bench "$source" hilbert
done
for file in "$meshes"/*_t*.vtu; do # tetrahedra and triangles
  [ -e "$file" ] || continue
  echo "== service_bench.py $file"
  PYTHONPATH=$build/python /usr/bin/python3 tests/bench/service_bench.py $build/server/dynmeshd "$file" \
    "$reports/service.$(basename "$file" .vtu).hilbert.json"
done
for size in ${SCALE:-100000 800000}; do
  run "scale.$size.hilbert" scale_bench "$size"
done

run store.disk.none store_bench $reports
largest=$(ls -S "$meshes"/*_tet.vtu 2>/dev/null | head -1 || true)
if [ -n "$largest" ]; then
  echo "== durability_bench.py $largest"
  PYTHONPATH=$build/python /usr/bin/python3 tests/bench/durability_bench.py $build/server/dynmeshd "$largest" $reports
fi

/usr/bin/python3 tests/bench/table.py $reports $build/core.json "${RESULTS:-tests/bench/RESULTS.md}"
