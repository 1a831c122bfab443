"""``dynmesh repair``: what is to be mended, and what came of it."""

from __future__ import annotations

import argparse
from typing import Any

from .repairs import RemoveDuplicates, RepairResult, RepairStep, choose_steps
from .session import Session


def add_repair_options(parser: argparse.ArgumentParser) -> None:
    """The options of the command, in the order in which the steps are taken."""
    parser.add_argument("--weld", metavar="TOLERANCE", type=float, help="merge vertices within this distance")
    parser.add_argument(
        "--remove-duplicates", action="store_true", help="remove elements that are equal to others, or flat"
    )
    parser.add_argument(
        "--remove-isolated", action="store_true", help="the same, and vertices that no element has"
    )
    parser.add_argument(
        "--split-non-manifold",
        action="store_true",
        help="take apart what just touches in a vertex, or in an edge of more than two faces",
    )
    parser.add_argument(
        "--orient", action="store_true", help="make faces and cells turn alike, surfaces outwards"
    )
    parser.add_argument(
        "--fill-holes", metavar="EDGES", type=int, help="close holes of surfaces of at most so many edges"
    )
    parser.add_argument("--dry-run", action="store_true", help="tell what would be done, and do nothing")


def repair(session: Session, args: argparse.Namespace) -> RepairResult:
    """Carries out what the options ask for."""
    steps = choose_steps(
        (),
        weld=args.weld,
        remove_duplicates=args.remove_duplicates or args.remove_isolated,
        split_non_manifold=args.split_non_manifold,
        orient=args.orient,
        fill_holes=args.fill_holes,
    )
    return session.repair(
        [_with_isolated(step, args) for step in steps],
        if_revision=args.if_revision,
        validate_only=args.dry_run,
        message=args.message,
    )


def repair_record(result: RepairResult) -> dict[str, Any]:
    """The result for programs."""
    steps = [
        {
            "step": step.step.name,
            **{
                name: {"count": found.count, "kinds": found.kinds.tolist(), "ids": found.ids.tolist()}
                for name, found in step.findings.items()
            },
        }
        for step in result.steps
    ]
    return {
        "revision": result.revision,
        "durable_revision": result.durable_revision,
        "counts": result.counts._asdict(),
        "steps": steps,
    }


def describe_repair(result: RepairResult, args: argparse.Namespace) -> str:
    """The result for humans."""
    lines = [f"{'would be done at ' if args.dry_run else ''}revision {result.revision}"]
    for step in result.steps:
        found = ", ".join(f"{found.count} {name.replace('_', ' ')}" for name, found in step.findings.items())
        lines.append(f"{step.step.name.replace('_', ' ')}: {found or 'nothing'}")
    return "\n".join(lines)


def _with_isolated(step: RepairStep, args: argparse.Namespace) -> RepairStep:
    if isinstance(step, RemoveDuplicates) and args.remove_isolated:
        return RemoveDuplicates(isolated_vertices=True)
    return step
