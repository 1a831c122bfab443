"""``dynmesh adapt``: brings a session's mesh to a target edge length."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import asdict
from typing import Any

from .adapt import AdaptResult, MeshShape
from .cli_notes import add_note_options
from .session import Session


def add_adapt(make: Callable[[str, str], argparse.ArgumentParser]) -> None:
    """Adds the command; ``make(name, help)`` makes its parser."""
    parser = make("adapt", "Bring a mesh of triangles or tetrahedra to a target edge length.")
    parser.add_argument("name", metavar="NAME")
    size = parser.add_mutually_exclusive_group(required=True)
    size.add_argument("--target-length", metavar="LENGTH", type=float, help="of all edges")
    size.add_argument("--size-attribute", metavar="NAME", help="the vertex attribute that holds it")
    parser.add_argument("--min-quality", metavar="Q", type=float, default=0.3, help="least quality, 0 to 1 (0.3)")
    parser.add_argument(
        "--feature-angle", metavar="DEGREES", type=float, default=40.0, help="edges that are sharper are kept (40)"
    )
    parser.add_argument("--max-passes", metavar="N", type=int, default=10, help="(10)")
    parser.add_argument("--max-elements", metavar="N", type=int, help="split no further from there on")
    add_note_options(parser)


def adapt(session: Session, args: argparse.Namespace) -> tuple[dict[str, Any], str]:
    """Does it; returns the result for programs and for humans."""
    result = session.adapt(
        args.target_length,
        size_attribute=args.size_attribute,
        min_quality=args.min_quality,
        feature_angle=args.feature_angle,
        max_passes=args.max_passes,
        max_elements=args.max_elements,
        message=args.message,
    )
    return asdict(result), _describe(result)


def _describe(result: AdaptResult) -> str:
    lines = [
        f"{result.end} after {result.passes} passes, at revision {result.revision}",
        f"{result.splits} splits, {result.collapses} collapses, {result.swaps} swaps, {result.moves} moves",
        "",
        f"{'':8} {'elements':>10} {'edges':>10} {'mean length':>12} {'in band':>8} {'angle':>7} {'quality':>8}",
    ]
    lines += [_row("before", result.before), _row("after", result.after)]
    return "\n".join(lines)


def _row(title: str, shape: MeshShape) -> str:
    return (
        f"{title:8} {shape.elements:10} {shape.edges:10} {shape.mean_length:12.6g} {shape.share_in_band:8.1%} "
        f"{shape.smallest_angle:7.2f} {shape.least_quality:8.3f}"
    )
