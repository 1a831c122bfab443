#!/usr/bin/env bash
# Installs the Debian 12 packages that dynmesh builds, tests and demonstrates with. Does nothing when all are there.
#
# usage: scripts/setup.sh [server|build|test|demo|bench]...   (default: build test demo)
set -euo pipefail

server_packages=(
  g++ cmake ninja-build ccache pkg-config
  libgrpc++-dev libprotobuf-dev protobuf-compiler protobuf-compiler-grpc
  libabsl-dev libboost-dev libspdlog-dev libdraco-dev libzstd-dev libxxhash-dev librocksdb-dev
)
build_packages=(
  "${server_packages[@]}"
  python3 python3-dev python3-venv python3-setuptools python3-wheel python3-pybind11 pybind11-dev
  python3-grpcio python3-protobuf python3-numpy python3-meshio python3-tqdm
)
test_packages=(
  libgtest-dev libgmock-dev python3-pytest python3-hypothesis python3-vtk9 draco
)
demo_packages=(gmsh python3-matplotlib python3-pil)
bench_packages=(libbenchmark-dev libcgal-dev libopenmesh-dev libvtk9-dev python3-numpy python3-meshio)

groups=("$@")
[ ${#groups[@]} -gt 0 ] || groups=(build test demo)

packages=()
for group in "${groups[@]}"; do
  case "$group" in
    server | build | test | demo | bench) ;;
    *)
      echo "setup.sh: unknown group '$group' (server, build, test, demo, bench)" >&2
      exit 2
      ;;
  esac
  declare -n list="${group}_packages"
  packages+=("${list[@]}")
done

missing=()
for package in "${packages[@]}"; do
  status=$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null || true)
  [ "$status" = installed ] || missing+=("$package")
done
[ ${#missing[@]} -gt 0 ] || exit 0

sudo=()
if [ "$(id -u)" -ne 0 ]; then
  command -v sudo >/dev/null || { echo "setup.sh: not root and no sudo; please install: ${missing[*]}" >&2; exit 1; }
  sudo=(sudo)
fi
echo "setup.sh: installing ${missing[*]}"
export DEBIAN_FRONTEND=noninteractive
"${sudo[@]}" apt-get update -q
"${sudo[@]}" apt-get install -y -q --no-install-recommends "${missing[@]}"
