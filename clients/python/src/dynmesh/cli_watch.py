"""``dynmesh watch``: a line for each step of a session."""

from __future__ import annotations

import argparse
import json
from typing import Any

from .kinds import ELEMENT_KINDS
from .mirror import Mirror, Update
from .session import Session


def watch(session: Session, args: argparse.Namespace) -> int:
    """Prints steps until ``args.count`` of them, an error, or an interruption, which is the usual end."""
    session.info()  # an error of the first call is a better one than that of a mirror
    with session.mirror(codec=args.codec, min_interval=args.min_interval) as mirror:
        try:
            for number, update in enumerate(mirror.updates(), 1):
                print(json.dumps(_record(mirror, update)) if args.json else _line(mirror, update), flush=True)
                if number == args.count:
                    break
        except KeyboardInterrupt:
            pass
    return 0


def _record(mirror: Mirror, update: Update) -> dict[str, Any]:
    with mirror.lock:
        counts = {f"{kind}s": mirror.num_elements(kind) for kind in ELEMENT_KINDS}
        checksum, vertices = str(mirror.checksum), mirror.num_vertices
    return {
        "revision": update.revision,
        "from_revision": update.from_revision,
        "written_vertices": sum(d.vertex_slots.size for d in update.deltas),
        "removed_vertices": sum(d.removed_vertices.size for d in update.deltas),
        "written_elements": sum(d.num_written for d in update.deltas),
        "removed_elements": sum(d.num_removed for d in update.deltas),
        "bytes": update.received_bytes,
        "latency_ms": round(update.latency_s * 1000, 3),
        "vertices": vertices,
        "elements": counts,
        "checksum": checksum,
    }


def _line(mirror: Mirror, update: Update) -> str:
    record = _record(mirror, update)
    elements = ", ".join(f"{count} {kind}" for kind, count in record["elements"].items() if count)
    return (
        f"revision {record['revision']:6}  "
        f"vertices +{record['written_vertices']} -{record['removed_vertices']}  "
        f"elements +{record['written_elements']} -{record['removed_elements']}  "
        f"{record['bytes']} B  {record['latency_ms']:.1f} ms  "
        f"now {record['vertices']} vertices, {elements or 'no elements'}"
    )
