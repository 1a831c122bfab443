"""``dynmesh split``, ``collapse``, ``swap``, ``smooth``, ``dissolve`` and ``merge``: operators, as one revision."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import Any

import numpy as np

from .arrays import Ids
from .cli_notes import add_note_options
from .cli_warnings import warning_records
from .edit_result import EditResult
from .session import Session

AddCommand = Callable[[str, str], argparse.ArgumentParser]

_NO_VERTEX = 0xFFFFFFFF  # in `EditResult.new_vertices`, of a split that was passed over


def add_operators(add: AddCommand) -> None:
    """Adds the commands; ``args.operate(session, args)`` carries out what one of them asks for."""
    split = add("split", "Put a vertex on each edge, or into each element.")
    _add_places(split, "edges, or elements of --kind", ends=True)
    split.add_argument("--kind", choices=("edge", "face", "cell"), help="split elements of this kind at their middles")
    split.add_argument("--at", metavar="T", type=float, help="where on the edge, 0 to 1 (0.5)")
    collapse = add("collapse", "Draw each edge together.")
    _add_places(collapse, "edges", ends=True)
    collapse.add_argument("--at", metavar="T", type=float, help="where on the edge (middle, or on the boundary)")
    swap = add("swap", "Flip each edge of two triangles, remove each edge inside of tetrahedra; or swap faces.")
    _add_places(swap, "edges, or faces", ends=True)
    swap.add_argument("--faces", action="store_true", help="IDs are faces between two tetrahedra")
    smooth = add("smooth", "Move vertices to where the elements round them are better.")
    smooth.epilog = (
        "A batch may look at 200,000,000 entities (max_batch_work): the vertices, times their elements, times the "
        "iterations. Of one that is refused for it, take fewer iterations or vertices at a time."
    )
    _add_places(smooth, "vertices (all: up to a million, times the iterations)", ends=False, at_least_one=False)
    smooth.add_argument("--method", choices=("guarded", "laplacian", "optimizing"), default="guarded", help="(guarded)")
    smooth.add_argument("--iterations", metavar="N", type=int, default=1, help="(1)")
    smooth.add_argument("--move-boundary", action="store_true", help="vertices of the boundary, too")
    dissolve = add("dissolve", "Remove each vertex and close the gap.")
    _add_places(dissolve, "vertices", ends=False)
    merge = add("merge", "Weld pairs of vertices that no edge joins: the second of each becomes the first.")
    _add_places(merge, "vertices, two for each pair", ends=False)
    merge.set_defaults(pairs=True)
    for parser, operate in (
        (split, _split),
        (collapse, _collapse),
        (swap, _swap),
        (smooth, _smooth),
        (dissolve, _dissolve),
        (merge, _merge),
    ):
        parser.set_defaults(operate=operate)


def operate(session: Session, args: argparse.Namespace) -> EditResult:
    """Carries out a command."""
    tx = session.edit(
        if_revision=args.if_revision,
        validate_only=args.dry_run,
        skip_refused=args.skip_refused,
        message=args.message,
    )
    with tx:
        args.operate(session, tx, args)
    return tx.result


def _add_places(
    parser: argparse.ArgumentParser, what: str, *, ends: bool, at_least_one: bool = True
) -> None:
    parser.add_argument("name", metavar="NAME")
    parser.add_argument("ids", metavar="ID", nargs="+" if at_least_one else "*", type=int, help=f"of {what}")
    if ends:
        parser.add_argument("--ends", action="store_true", help="IDs are pairs of vertices, the ends of edges")
    parser.add_argument("--min-quality", metavar="Q", type=float, default=0.0, help="of new elements, 0 to 1 (0)")
    parser.add_argument("--allow-inversion", action="store_true", help="elements may be turned over")
    parser.add_argument("--skip-refused", action="store_true", help="pass over what the mesh refuses, and say why")
    parser.add_argument("--if-revision", metavar="R", type=int, help="only if the session is at this revision")
    parser.add_argument("--dry-run", action="store_true", help="tell what would be done, and do nothing")
    add_note_options(parser)


def _limits(args: argparse.Namespace) -> dict[str, Any]:
    return {"allow_inversion": args.allow_inversion, "min_quality": args.min_quality}


def _edges(args: argparse.Namespace) -> dict[str, Any]:
    return {"ends": np.array(args.ids).reshape(-1, 2)} if args.ends else {"edges": args.ids}


def _split(_: Session, tx: Any, args: argparse.Namespace) -> None:
    if args.kind:
        tx.split_elements(args.kind, args.ids, **_limits(args))
    else:
        tx.split_edges(**_edges(args), parameters=args.at, **_limits(args))


def _collapse(_: Session, tx: Any, args: argparse.Namespace) -> None:
    tx.collapse_edges(**_edges(args), parameters=args.at, **_limits(args))


def _swap(_: Session, tx: Any, args: argparse.Namespace) -> None:
    if args.faces:
        tx.swap_faces(args.ids, **_limits(args))
    else:
        tx.swap_edges(**_edges(args), **_limits(args))


def _smooth(session: Session, tx: Any, args: argparse.Namespace) -> None:
    ids: Any = args.ids or session.snapshot(progress=False).vertex_ids
    tx.smooth_vertices(
        ids, method=args.method, iterations=args.iterations, move_boundary=args.move_boundary, **_limits(args)
    )


def _dissolve(_: Session, tx: Any, args: argparse.Namespace) -> None:
    tx.dissolve_vertices(args.ids, **_limits(args))


def _merge(_: Session, tx: Any, args: argparse.Namespace) -> None:
    tx.merge_vertices(np.array(args.ids).reshape(-1, 2), **_limits(args))


def operator_record(result: EditResult) -> dict[str, Any]:
    """The result for programs."""
    return {
        "revision": result.revision,
        "durable_revision": result.durable_revision,
        "counts": result.counts._asdict(),
        "new_vertices": [None if id_ == _NO_VERTEX else id_ for id_ in result.new_vertices.tolist()],
        "moved": sum(result.num_moved),
        "skipped": _skipped(result).tolist(),
        "refusals": [
            {"index": refusal.index, "reason": refusal.reason, "message": refusal.message, **refusal.metadata}
            for refusals in result.refusals
            for refusal in refusals
        ],
        "warnings": warning_records(result.warnings),
    }


def describe_operators(result: EditResult, args: argparse.Namespace) -> str:
    """The result for humans."""
    counts = ", ".join(f"{count} {name}" for name, count in result.counts._asdict().items())
    lines = [f"{'would be' if args.dry_run else 'revision'} {result.revision}: {counts}"]
    made = result.new_vertices[result.new_vertices != _NO_VERTEX]
    if len(made):
        lines.append(f"new vertices: {' '.join(map(str, made))}")
    if sum(result.num_moved):
        lines.append(f"moved: {sum(result.num_moved)} vertices")
    if len(_skipped(result)):
        lines.append(f"passed over: {len(_skipped(result))}")
    lines += [
        f"  item {refusal.index}: {refusal.reason}: {refusal.message}"
        for refusals in result.refusals
        for refusal in refusals
    ]
    return "\n".join(lines)


def _skipped(result: EditResult) -> Ids:
    return np.concatenate(result.skipped) if result.skipped else np.empty(0, np.uint32)
