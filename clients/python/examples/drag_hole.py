"""The demo: a simulation drags a hole through a real mesh, and four followers keep exact copies of it.

    make demo                  meshes plate_with_hole.geo with gmsh
    make demo MESH=part.vtu    takes any file that meshio reads, and pulls at a piece of its boundary

It starts a daemon, imports the mesh, asks for the neighbourhoods of all vertices, and then moves vertices in 50
steps, removing and adding elements where they would invert. Meanwhile one follower listens with Draco, one with
zstd, one is slow, and one leaves and comes back. Exit status 0 only if all checks at the end held.
"""

from __future__ import annotations

import argparse
import contextlib
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

import dynmesh
import meshio
import numpy as np
from dragging import picture, source
from dragging.followers import FollowerProcess, FollowerReport, Plan
from dragging.region import Region, ball_region
from dragging.report import Checks, megabytes, milliseconds, print_table, rate
from dragging.simulation import Simulation, StepReport
from dragging.survey import Survey, survey

_PLANS = (
    Plan("live, Draco", "draco"),
    Plan("live, zstd", "zstd"),
    Plan("slow", "auto", min_interval_s=1.0),
    Plan("comes back", "auto"),
)
_LEAVES_AT, _RETURNS_AT = 0.3, 0.7  # of all steps
_MOST_VALIDATED = 300_000  # elements: the server's own validation keeps editors waiting


@dataclass
class Memory:
    """Resident memory of a process in bytes: now, and at most so far."""

    now: int
    peak: int

    @staticmethod
    def of(pid: int) -> Memory:
        lines = Path(f"/proc/{pid}/status").read_text().splitlines()
        values = {line.split(":")[0]: line.split()[1] for line in lines if line.startswith("Vm")}
        return Memory(int(values["VmRSS"]) * 1024, int(values["VmHWM"]) * 1024)


@dataclass
class Run:
    """What happened in the demo, for the tables at the end."""

    daemon: dynmesh.Daemon
    session: dynmesh.Session
    before: dynmesh.SessionInfo
    start: Survey
    memory_before: Memory
    steps: list[StepReport] = field(default_factory=list)
    wall_s: float = 0.0
    followers: list[FollowerReport] = field(default_factory=list)


def main() -> int:
    args = _parse_arguments()
    args.output_dir.mkdir(parents=True, exist_ok=True)
    try:
        path = args.mesh or source.mesh_plate(args.output_dir)
        mesh, notes = source.load(path)
        print(f"{path}: {len(mesh.points):,} points; " + ", ".join(_describe(block) for block in mesh.cells))
        for note in notes:
            print(f"  note: {note}")
        with dynmesh.launch(args.daemon) as daemon:
            return _demonstrate(args, daemon, mesh)
    except (dynmesh.DynmeshError, OSError) as error:
        print(f"drag_hole.py: {error}", file=sys.stderr)
        return 2


def _demonstrate(args: argparse.Namespace, daemon: dynmesh.Daemon, mesh: meshio.Mesh) -> int:
    session = daemon.client.create_session("demo")
    _import_and_ask(session, mesh)
    memory = Memory.of(daemon.pid)
    _ask_for_neighbourhoods(session)
    run = Run(daemon, session, session.info(), survey(session.snapshot(progress=False)), memory)
    region = _choose_region(args, run.start)
    if region is None:
        print("nothing can be dragged: the mesh has no extent")
    else:
        _drag(args, run, region)
    _print_tables(run)
    print("\nChecks")
    checks = Checks()
    end = survey(session.snapshot(progress=False), run.start.flipped)
    _check(checks, run, end, is_plate=args.mesh is None)
    _write_surface(args.output_dir, run, end, region)
    return checks.exit_code()


# ---- Import and queries ----


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
        rows.append((f"vertex -> {kind}", len(answer.ids), len(answer.neighbors), milliseconds(took),
                     rate(len(answer.ids), took)))  # fmt: skip
    print_table("Neighbourhoods of all vertices", ("relation", "vertices", "neighbours", "time", "queries"), rows)


# ---- Dragging ----


def _choose_region(args: argparse.Namespace, start: Survey) -> Region | None:
    if args.mesh is None:
        return source.plate_region()
    if not len(start.points) or start.kind is None:
        return None
    rng = np.random.default_rng(args.seed)
    return ball_region(start.points, start.points[rng.integers(len(start.points))])


def _drag(args: argparse.Namespace, run: Run, region: Region) -> None:
    """Steps, while the followers follow, leave and return."""
    with contextlib.ExitStack() as stack:
        followers = [
            stack.enter_context(FollowerProcess(plan, run.daemon.target, run.session.name)) for plan in _PLANS
        ]
        for follower in followers:
            follower.copy(run.before.revision)
        simulation = Simulation(run.session, region, run.start, run.before.revision)
        leaves, returns = (round(args.steps * part) for part in (_LEAVES_AT, _RETURNS_AT))
        started = time.perf_counter()
        for number in range(args.steps):
            if number == leaves:
                followers[-1].leave()
            if number == returns:
                followers[-1].come_back()
            run.steps.append(simulation.step(number / args.steps, (number + 1) / args.steps))
            _show_progress(number + 1, args.steps, run.steps[-1])
        run.wall_s = time.perf_counter() - started
        run.followers = [follower.finish(run.steps[-1].revision) for follower in followers]


def _show_progress(done: int, steps: int, step: StepReport) -> None:
    if sys.stdout.isatty():
        print(f"\r  step {done}/{steps}: {step.moved} moved, {step.removed} removed, {step.added} added",
              end="\x1b[K" if done < steps else "\x1b[K\r\x1b[K", flush=True)  # fmt: skip


# ---- Results ----


def _print_tables(run: Run) -> None:
    after, memory = run.session.info(), Memory.of(run.daemon.pid)
    _print_counts(run.before, after)
    elements = max(run.start.num_elements, 1)
    rows = [
        ("after the import", megabytes(run.memory_before.now), run.memory_before.now / elements),
        ("now", megabytes(memory.now), memory.now / elements),
        ("at most", megabytes(memory.peak), memory.peak / elements),
        ("the mesh itself", megabytes(after.memory_bytes), after.memory_bytes / elements),
    ]
    print_table("Memory of the daemon", ("", "resident", "bytes/element"),
                [(name, total, f"{each:.0f}") for name, total, each in rows])  # fmt: skip
    if run.steps:
        _print_edits(run)
        _print_followers(run)


def _print_counts(before: dynmesh.SessionInfo, after: dynmesh.SessionInfo) -> None:
    header = ("", "V", "E", "F", "C", "V-E+F-C")
    rows = [
        ("imported", *before.counts, before.euler_characteristic),
        ("Euler's estimate", *before.estimated_counts, ""),
        (f"at revision {after.revision}", *after.counts, after.euler_characteristic),
        ("Euler's estimate", *after.estimated_counts, ""),
        ("on the boundary", *after.boundary_counts[:3], "", ""),
    ]
    print_table("Entities", header, rows)


def _print_edits(run: Run) -> None:
    steps = run.steps
    sums = {name: sum(getattr(step, name) for step in steps) for name in StepReport.__dataclass_fields__}
    items, batches = sum(step.items for step in steps), len(steps)
    commit_s = np.array([step.commit_s for step in steps])
    rows = [
        ("batches", batches, rate(batches, sums["commit_s"]), rate(batches, run.wall_s)),
        ("edits", items, rate(items, sums["commit_s"]), rate(items, run.wall_s)),
        ("  moved vertices", sums["moved"], "", ""),
        ("  removed", sums["removed"], "", ""),
        ("  added", sums["added"], "", ""),
    ]
    print_table("The simulation", ("", "count", "in commits", "in all"), rows)
    print(f"  {sums['inverted']:,} elements would have inverted; {sums['held']:,} times a vertex was held back")
    print(f"  a commit took {milliseconds(np.median(commit_s))} (p50), {milliseconds(np.quantile(commit_s, 0.99))} "
          f"(p99); queries {sums['read_s']:.1f} s, repairs {sums['repair_s']:.1f} s, "
          f"commits {sums['commit_s']:.1f} s, in all {run.wall_s:.1f} s")  # fmt: skip


def _print_followers(run: Run) -> None:
    header = ("follower", "codec", "deltas", "raw", "encoded", "ratio", "p50", "p99", "first copy")
    rows = []
    for follower in run.followers:
        late = follower.latencies_s or [float("nan")]
        ratio = follower.raw_bytes / max(follower.encoded_bytes, 1)
        rows.append((follower.plan.name, follower.plan.codec, follower.deltas, megabytes(follower.raw_bytes),
                     megabytes(follower.encoded_bytes), f"{ratio:.2f}", milliseconds(np.median(late)),
                     milliseconds(np.quantile(late, 0.99)), megabytes(follower.copy_bytes)))  # fmt: skip
    print_table("Followers (latency: from commit to applied and verified)", header, rows)
    for follower in run.followers:
        if follower.caught_up is not None:
            missed, size, took = follower.caught_up
            print(f"  '{follower.plan.name}' missed {missed} revisions and had them in {milliseconds(took)}, "
                  f"by {megabytes(size)}")  # fmt: skip


def _check(checks: Checks, run: Run, end: Survey, is_plate: bool) -> None:
    after = run.session.info()
    for follower in run.followers:
        checks.add(follower.checksum == after.checksum, f"'{follower.plan.name}' holds what the server holds",
                   f"checksum {follower.checksum}")  # fmt: skip
        checks.add(follower.refollows == 0, f"'{follower.plan.name}' never had to start over")
    checks.add(run.session.snapshot(progress=False).checksum() == after.checksum, "an export has the same checksum")
    checks.add(end.num_inverted <= run.start.num_inverted, "no element was inverted",
               f"{end.num_inverted} of {end.num_elements:,}, {run.start.num_inverted} at the start")  # fmt: skip
    checks.add(after.euler_characteristic == run.before.euler_characteristic, "the topology is the same",
               f"V-E+F-C = {after.euler_characteristic}")  # fmt: skip
    what = "volume" if end.kind == dynmesh.EntityKind.CELL else "area"
    change = (end.size - run.start.size) / run.start.size if run.start.size else 0.0
    if is_plate:
        checks.add(abs(change) < 1e-9, f"the {what} is the same", f"{end.size:.9g}, changed by {change:.1e} of it")
    else:
        print(f"          the {what} went from {run.start.size:.6g} to {end.size:.6g} ({change:+.2%})")
    if run.start.num_elements <= _MOST_VALIDATED:
        broken = run.session.validate()
        checks.add(not broken, "the server's data structure is sound", "; ".join(broken[:3]))


def _write_surface(directory: Path, run: Run, end: Survey, region: Region | None) -> None:
    surface = picture.read_surface(run.session)
    if surface is None:
        print("\nthe mesh has no surface to write")
        return
    items = sum(step.items for step in run.steps)
    caption = (f"{run.start.num_elements:,} elements became {end.num_elements:,} in {len(run.steps)} batches "
               f"of {items:,} edits")  # fmt: skip
    picture.write_vtu(directory / "drag_hole.vtu", surface)
    picture.draw(directory / "drag_hole.png", surface, region, caption)
    print(f"\nwrote {directory / 'drag_hole.png'} and {directory / 'drag_hole.vtu'}")


# ---- Arguments ----


def _describe(block: meshio.CellBlock) -> str:
    return f"{len(block.data):,} {block.type}"


def _parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description="Drag a hole through a mesh while four followers keep copies of it.")
    parser.add_argument("--mesh", type=Path, help="any file that meshio reads (default: a plate, meshed by gmsh)")
    parser.add_argument("--output-dir", type=Path, default=Path("build/demo"), help="for picture and VTU (%(default)s)")
    parser.add_argument("--steps", type=_positive, default=50, help="batches of edits (%(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="chooses the vertex to pull at (%(default)s)")
    parser.add_argument("--daemon", metavar="PATH", help="dynmeshd to start (default: that of the build)")
    return parser.parse_args()


def _positive(text: str) -> int:
    number = int(text)
    if number < 1:
        raise argparse.ArgumentTypeError("must be 1 or more")
    return number


if __name__ == "__main__":
    sys.exit(main())
