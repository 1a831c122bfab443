#!/usr/bin/env bash
# Builds the image, waits until the container is healthy, makes one edit through it, and stops it again.
#
# Takes Docker where an engine runs. Elsewhere it takes buildah and podman, with a base image that debootstrap
# makes from this machine's own package sources, and keeps everything in a temporary directory. `make image-test`
# builds the Python client that it needs.
#
# usage: [BUILD=build/dev] [KEEP=1] docker/smoke.sh       KEEP: do not delete the temporary directory
set -euo pipefail
cd "$(dirname "$0")/.."

readonly image=dynmesh-smoke container=dynmesh-smoke-$$ port=7447
readonly python=${BUILD:-build/dev}/venv/bin/python
readonly healthy_within_s=60

say() { printf '== %s (%ds)\n' "$*" "$SECONDS"; }
fail() {
  echo "smoke.sh: $*" >&2
  engine logs "$container" >&2 || true
  exit 1
}

# ---- Docker ----

use_docker() {
  engine() { docker "$@"; }
  build() { docker build -f docker/Dockerfile -t "$image" .; }
  start() { docker run -d --name "$container" -p "127.0.0.1:$port:$port" "$image"; }
  is_healthy() { [ "$(docker inspect -f '{{.State.Health.Status}}' "$container")" = healthy ]; }
  clean_up() { docker rm -f "$container" > /dev/null 2>&1 || true; }
}

# ---- buildah and podman ----

use_podman() {
  install_podman
  work=$(mktemp -d)
  write_storage_conf
  # Without cgroups of their own and without a network of their own, containers run inside containers too.
  # It complains of having no systemd for its timers; we ask for the health ourselves.
  engine() { podman --runtime runc --cgroup-manager cgroupfs --log-level fatal "$@"; }
  build() {
    make_base
    buildah --storage-driver vfs bud --isolation chroot --format docker --pull-never \
      --build-arg BASE=localhost/dynmesh-base -f docker/Dockerfile -t "$image" .
  }
  start() {
    engine run -d --name "$container" --network host --ulimit nofile=4096:4096 --ulimit nproc=4096:4096 \
      -e "DYNMESHD_LISTEN=127.0.0.1:$port" "localhost/$image"
  }
  is_healthy() { engine healthcheck run "$container" > /dev/null 2>&1; }
  clean_up() {
    engine rm -f -t 0 "$container" > /dev/null 2>&1 || true
    [ -n "${KEEP:-}" ] || rm -rf "$work"
  }
}

install_podman() {
  local missing=()
  for package in buildah podman runc debootstrap; do
    dpkg-query -W -f='${db:Status-Status}' "$package" 2> /dev/null | grep -qx installed ||
      missing+=("$package")
  done
  [ ${#missing[@]} -gt 0 ] || return 0
  [ "$(id -u)" -eq 0 ] || { echo "smoke.sh: needs Docker, or to be root" >&2; exit 1; }
  say "installing ${missing[*]}"
  apt-get update -q
  DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends "${missing[@]}"
}

write_storage_conf() {
  export CONTAINERS_STORAGE_CONF=$work/storage.conf
  cat > "$CONTAINERS_STORAGE_CONF" << EOF
[storage]
driver = "vfs"
graphroot = "$work/storage"
runroot = "$work/run"
EOF
}

# An image of Debian with this machine's package sources.
make_base() {
  say "making a base image"
  local tree=$work/base mirror from
  mirror=$(debian_mirror)
  if ! debootstrap --variant=minbase bookworm "$tree" "$mirror" > "$work/debootstrap.log"; then
    tail "$work/debootstrap.log" >&2
    return 1
  fi
  rm -f "$tree/etc/apt/sources.list"
  cp -r /etc/apt/apt.conf.d "$tree/etc/apt/"
  for sources in /etc/apt/sources.list /etc/apt/sources.list.d/debian.sources; do
    [ ! -f "$sources" ] || cp "$sources" "$tree$sources"
  done
  from=$(buildah --storage-driver vfs from scratch)
  buildah --storage-driver vfs add -q "$from" "$tree" / > /dev/null
  buildah --storage-driver vfs commit -q --rm "$from" localhost/dynmesh-base > /dev/null
  rm -rf "$tree"
}

# Where this machine itself gets Debian from.
debian_mirror() {
  local uris
  uris=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 'Codename: bookworm' 'Origin: Debian')
  [ -n "$uris" ] || { echo "smoke.sh: apt knows no Debian bookworm; run apt-get update" >&2; return 1; }
  head -n 1 <<< "$uris"
}

# ---- The test ----

wait_until_healthy() {
  local deadline=$((SECONDS + healthy_within_s))
  until is_healthy; do
    [ "$SECONDS" -lt "$deadline" ] || fail "not healthy within $healthy_within_s s"
    [ "$(engine inspect -f '{{.State.Running}}' "$container")" = true ] || fail "the container has ended"
    sleep 0.2
  done
}

stop_and_check() {
  engine stop -t 30 "$container" > /dev/null
  local status
  status=$(engine inspect -f '{{.State.ExitCode}}' "$container")
  [ "$status" -eq 0 ] || fail "it ended with status $status"
  engine logs "$container" 2>&1 | grep -q 'drained' || fail "it did not say that it drained"
}

[ -x "$python" ] || { echo "smoke.sh: no $python; please run 'make image-test'" >&2; exit 1; }
if docker info > /dev/null 2>&1; then use_docker; else use_podman; fi
trap clean_up EXIT

say "building the image"
build
say "starting a container"
start
wait_until_healthy
user=$(engine exec "$container" id -u)
[ "$user" -ne 0 ] || fail "the daemon runs as root"
say "healthy, as user $user; making an edit"
"$python" docker/smoke_edit.py "127.0.0.1:$port"
say "stopping it"
stop_and_check
say "passed"
