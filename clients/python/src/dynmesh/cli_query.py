"""``dynmesh query``: neighbours and places of a session."""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable, Sequence
from typing import Any

from .cli_parser import ids
from .session import Session

# What is printed with --json, and without.
Answer = tuple[dict[str, Any], str]

_KINDS = ("vertex", "edge", "face", "cell")
_BOX = ("X0", "Y0", "Z0", "X1", "Y1", "Z1")
_POINT = ("X", "Y", "Z")
_ORIGIN, _DIRECTION = ("OX", "OY", "OZ"), ("DX", "DY", "DZ")
# argparse takes -1e-3 and -1. for options.
_NEGATIVE_NUMBER = re.compile(r"-(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?$")


def add_questions(make: Callable[[str, str], argparse.ArgumentParser]) -> None:
    """Adds the parsers; ``make(name, help)`` makes one. Each sets ``ask(session, args)``."""

    def command(name: str, help_text: str) -> argparse.ArgumentParser:
        parser = make(name, help_text)
        parser._negative_number_matcher = _NEGATIVE_NUMBER
        return parser

    _add_neighbors(command("neighbors", "Neighbours of entities, a line for each."))
    box = command("box", "Entities in a box: vertices inside, others whose bounding box meets it.")
    box.add_argument("name", metavar="NAME")
    box.add_argument("kind", choices=_KINDS)
    _add_numbers(box, _BOX)
    box.set_defaults(ask=_box)
    nearest = command("nearest", "The vertices nearest to a point, with distances.")
    _add_point(nearest)
    nearest.add_argument("--count", metavar="N", type=int, default=1, help="how many (1)")
    nearest.set_defaults(ask=_nearest)
    locate = command("locate", "The cell that contains a point, or the face that it lies on.")
    _add_point(locate)
    locate.add_argument("--in", dest="kind", choices=("cell", "face"), default="cell", help="(cell)")
    locate.add_argument("--tolerance", metavar="LENGTH", type=float, default=0.0, help="for faces")
    locate.set_defaults(ask=_locate)
    ray = command("ray", "What a ray hits: faces, with t of origin + t * direction.")
    ray.add_argument("name", metavar="NAME")
    _add_numbers(ray, _ORIGIN + _DIRECTION)
    ray.add_argument("--all", action="store_true", help="all hits, not only the first")
    ray.add_argument("--any-face", action="store_true", help="inner faces too")
    ray.set_defaults(ask=_ray)


def _add_neighbors(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("name", metavar="NAME")
    parser.add_argument("from_kind", metavar="FROM", choices=_KINDS)
    parser.add_argument("to_kind", metavar="TO", choices=_KINDS)
    parser.add_argument("--ids", metavar="ID,...", type=ids, help="of these (default: of all)")
    parser.add_argument("--rings", metavar="N", type=int, default=1, help="in at most so many steps (1)")
    parser.add_argument("--boundary", action="store_true", help="only of those on the boundary")
    parser.add_argument("--box", metavar=_BOX, nargs=6, type=float, help="only of those in this box")
    parser.set_defaults(ask=_neighbors)


def _add_point(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("name", metavar="NAME")
    _add_numbers(parser, _POINT)


def _add_numbers(parser: argparse.ArgumentParser, names: Sequence[str]) -> None:
    # One by one: argparse cannot print a positional with several metavars.
    for name in names:
        parser.add_argument(name, type=float)


def _numbers(args: argparse.Namespace, names: Sequence[str]) -> list[float]:
    return [getattr(args, name) for name in names]


def _neighbors(session: Session, args: argparse.Namespace) -> Answer:
    csr = session.neighbors(
        args.from_kind,
        args.to_kind,
        args.ids,
        rings=args.rings,
        boundary_only=args.boundary,
        box=None if args.box is None else _corners(args.box),
    )
    rows = [{"id": int(entity), "neighbors": csr.row(i).tolist()} for i, entity in enumerate(csr.ids)]
    lines = [f"{row['id']}: {' '.join(map(str, row['neighbors']))}".rstrip() for row in rows]
    return {"revision": csr.revision, "rows": rows}, "\n".join(lines)


def _box(session: Session, args: argparse.Namespace) -> Answer:
    found, revision = session._in_box(args.kind, _corners(_numbers(args, _BOX)))
    return {"revision": revision, "ids": found.tolist()}, "\n".join(map(str, found.tolist()))


def _nearest(session: Session, args: argparse.Namespace) -> Answer:
    found = session.nearest_vertices(_numbers(args, _POINT), args.count)
    near, distances = found.ids.tolist(), found.distances.tolist()
    lines = [f"{vertex} at distance {distance:g}" for vertex, distance in zip(near, distances)]
    return {"revision": found.revision, "ids": near, "distances": distances}, "\n".join(lines)


def _locate(session: Session, args: argparse.Namespace) -> Answer:
    found = session.locate(_numbers(args, _POINT), args.kind, tolerance=args.tolerance)
    entity = int(found.ids[0])
    record = {"revision": found.revision, "kind": args.kind, "id": None if entity < 0 else entity}
    return record, f"in no {args.kind}" if entity < 0 else f"{args.kind} {entity}"


def _ray(session: Session, args: argparse.Namespace) -> Answer:
    found = session.cast_rays(
        _numbers(args, _ORIGIN),
        _numbers(args, _DIRECTION),
        hits="all" if args.all else "first",
        targets="any" if args.any_face else "surface",
    )
    faces, t = found.faces.tolist(), found.t.tolist()
    lines = [f"face {face} at t = {at:g}" for face, at in zip(faces, t)]
    return {"revision": found.revision, "faces": faces, "t": t}, "\n".join(lines) or "nothing"


def _corners(numbers: list[float]) -> list[list[float]]:
    return [numbers[:3], numbers[3:]]
