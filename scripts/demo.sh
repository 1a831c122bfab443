#!/usr/bin/env bash
# Runs the demo in a build: `make demo` has installed the packages (setup.sh build demo) and built build/dev.
#
# usage: [MESH=path] [BUILD=build/dev] scripts/demo.sh [options of drag_hole.py]
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
python=${BUILD:-$root/build/dev}/venv/bin/python
if [ ! -x "$python" ]; then
  echo "demo.sh: no $python; please run 'make demo'" >&2
  exit 1
fi
exec "$python" "$root/clients/python/examples/drag_hole.py" --output-dir "$root/build/demo" \
  ${MESH:+--mesh "$MESH"} "$@"
