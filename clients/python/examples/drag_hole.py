"""The demo: a simulation drags a hole through a real mesh, and four followers keep exact copies of it.

    make demo                  meshes plate_with_hole.geo with gmsh
    make demo MESH=part.vtu    takes any file that meshio reads, and pulls at a piece of its boundary

It starts a daemon, imports the mesh, asks for the neighbourhoods of all vertices, and then moves vertices in
50 steps. What that wears out it mends by the operators of the service: edges that become long are split, short
ones collapsed, poor elements swapped and smoothed. Meanwhile one follower listens with Draco, one with zstd,
one reads slowly, and one leaves and comes back. Exit status 0 only if all checks at the end held.
"""

from __future__ import annotations

import argparse
import contextlib
import subprocess
import sys
import time
from pathlib import Path

import dynmesh
import meshio
import numpy as np
from dragging import source
from dragging.followers import FollowerProcess, Plan
from dragging.region import Region, ball_region
from dragging.report import Checks, milliseconds, print_table, rate
from dragging.results import Memory, Run, check, print_tables
from dragging.simulation import Simulation, StepReport
from dragging.survey import Survey, survey

_PLANS = (
    Plan("live, Draco", "draco"),
    Plan("live, zstd", "zstd"),
    Plan("slow", "auto", pause_s=2.0),
    Plan("comes back", "auto"),
)
_LEAVES_AT, _RETURNS_AT = 0.3, 0.7  # of all steps
_EXIT_ERROR = 2


def main() -> int:
    args = _parse_arguments()
    args.output_dir.mkdir(parents=True, exist_ok=True)
    try:
        mesh = _load(args.mesh or source.mesh_plate(args.output_dir))
        with dynmesh.launch(args.daemon) as daemon:
            return _demonstrate(args, daemon, mesh)
    except (dynmesh.DynmeshError, OSError, subprocess.CalledProcessError) as error:
        print(f"drag_hole.py: {error}", file=sys.stderr)
        return _EXIT_ERROR


def _demonstrate(args: argparse.Namespace, daemon: dynmesh.Daemon, mesh: meshio.Mesh) -> int:
    session = daemon.client.create_session("demo")
    empty = Memory.of(daemon.pid)
    _import_and_ask(session, mesh)
    imported = Memory.of(daemon.pid)
    _ask_for_neighbourhoods(session)
    start = survey(session)
    run = Run(daemon, session, session.info(), start, empty, imported)
    region = _choose_region(args, session, start)
    if region is None:
        print("\nnothing can be dragged: the mesh has no extent")
    _follow_and_drag(args, run, region)
    end = survey(session, start.flipped)
    print_tables(run, end)
    print("\nChecks")
    checks = Checks()
    checks.add(len(run.followers) == len(_PLANS), "all followers reported", str(len(run.followers)))
    check(checks, run, end, is_plate=args.mesh is None)
    _write_surface(args.output_dir, run, end, region)
    return checks.exit_code()


# ---- Import and queries ----


def _load(path: Path) -> meshio.Mesh:
    started = time.perf_counter()
    mesh, notes = source.load(path)
    took = time.perf_counter() - started
    blocks = ", ".join(f"{len(block.data):,} {block.type}" for block in mesh.cells)
    print(f"{path}: {len(mesh.points):,} points; {blocks or 'no cells'}; read in {took:.2f} s")
    for note in notes:
        print(f"  note: {note}")
    return mesh


def _import_and_ask(session: dynmesh.Session, mesh: meshio.Mesh) -> None:
    """Imports the mesh, and stops the time until the first question is answered."""
    started = time.perf_counter()
    result = session.import_mesh(mesh, progress=False)
    imported = time.perf_counter()
    session.neighbors("vertex", "cell", [0] if len(mesh.points) else [])
    answered = time.perf_counter()
    print(f"imported in {imported - started:.2f} s, first answer after {answered - started:.2f} s")
    for warning in result.warnings:
        print(f"  warning: {warning}")


def _ask_for_neighbourhoods(session: dynmesh.Session) -> None:
    """The neighbours of all vertices, in bulk."""
    rows = []
    for kind in ("vertex", "edge", "face", "cell"):
        started = time.perf_counter()
        answer = session.neighbors("vertex", kind)
        took = time.perf_counter() - started
        count = len(answer.ids)
        total = len(answer.neighbors)
        rows.append((f"vertex -> {kind}", count, total, milliseconds(took), rate(count, took)))
    header = ("relation", "vertices", "neighbours", "time", "queries")
    print_table("Neighbourhoods of all vertices", header, rows)


# ---- Dragging ----


def _choose_region(args: argparse.Namespace, session: dynmesh.Session, start: Survey) -> Region | None:
    """The hole of the plate; of other meshes the surroundings of a vertex, if possible on the boundary."""
    if args.mesh is None:
        return source.plate_region()
    vertices = session.boundary("vertex")
    if not vertices.size:
        vertices = start.vertex_ids
    if not vertices.size:
        return None
    chosen = np.random.default_rng(args.seed).choice(vertices)
    return ball_region(start.points, start.points[np.searchsorted(start.vertex_ids, chosen)])


def _follow_and_drag(args: argparse.Namespace, run: Run, region: Region | None) -> None:
    """Steps, while the followers follow, leave and return; without a region they only copy."""
    leaves, returns = (round(args.steps * part) for part in (_LEAVES_AT, _RETURNS_AT))
    with contextlib.ExitStack() as stack:
        followers = [
            stack.enter_context(FollowerProcess(plan, run.daemon.target, run.session.name)) for plan in _PLANS
        ]
        for follower in followers:
            follower.copy(run.before.revision)
        started = time.perf_counter()
        simulation = Simulation(run.session, region, run.start, run.before.revision) if region else None
        for number in range(args.steps):
            if number == leaves:
                followers[-1].leave()
            if number == returns:
                followers[-1].come_back()
            if simulation is not None:
                run.steps.append(simulation.step(number / args.steps, (number + 1) / args.steps))
                _show_progress(number + 1, args.steps, run.steps[-1])
        if simulation is not None:
            run.finish = simulation.finish()
            run.outcomes = simulation.tally.outcomes
        run.wall_s = time.perf_counter() - started
        last = run.finish.revision if run.finish else run.before.revision
        run.followers = [follower.finish(last) for follower in followers]


def _show_progress(done: int, steps: int, step: StepReport) -> None:
    if sys.stdout.isatty():
        line = f"step {done}/{steps}: {step.operations} operations"
        print(f"\r\x1b[K{line if done < steps else ''}", end="", flush=True)


# ---- Results ----


def _write_surface(directory: Path, run: Run, end: Survey, region: Region | None) -> None:
    from dragging import picture  # not above, where each follower's process would load matplotlib too

    surface = picture.read_surface(run.session)
    if surface is None:
        print("\nthe mesh has no surface to write")
        return
    change = f"{run.start.num_elements:,} elements became {end.num_elements:,}"
    picture.write_vtu(directory / "drag_hole.vtu", surface)
    caption = f"{change} in {run.total('batches')} batches of {run.total('operations'):,} operations"
    picture.draw(directory / "drag_hole.png", surface, region, caption)
    print(f"\nwrote {directory / 'drag_hole.png'} and {directory / 'drag_hole.vtu'}")


# ---- Arguments ----


def _parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description="Drag a hole through a mesh while four followers keep copies of it.",
        formatter_class=argparse.ArgumentDefaultsHelpFormatter,
    )
    add = parser.add_argument
    add("--mesh", type=Path, help="any file that meshio reads; without it, a plate meshed by gmsh")
    add("--output-dir", type=Path, default=Path("build/demo"), help="where picture and VTU go")
    add("--steps", type=_positive, default=50, help="in which the region travels")
    add("--seed", type=int, default=1, help="chooses the vertex to pull at")
    add("--daemon", metavar="PATH", help="dynmeshd to start; without it, that of the build")
    return parser.parse_args()


def _positive(text: str) -> int:
    number = int(text)
    if number < 1:
        raise argparse.ArgumentTypeError("must be 1 or more")
    return number


if __name__ == "__main__":
    sys.exit(main())
