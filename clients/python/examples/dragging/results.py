"""What came out of a run: tables for humans, and checks that decide about the exit status."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import dynmesh
import numpy as np

from .followers import FollowerReport
from .report import Checks, megabytes, milliseconds, part, print_table, rate
from .simulation import StepReport
from .survey import Survey

_SIZE_TOLERANCE = 1e-9  # relative
_HOLE_TOLERANCE = 1e-3  # of the plate's volume: vertices of the rim may be held back now and then
_MOST_VALIDATED = 300_000  # elements: the server's own validation takes a microsecond for each


@dataclass
class Memory:
    """Resident memory of a process in bytes: now, and at most so far."""

    now: int
    peak: int

    @staticmethod
    def of(pid: int) -> Memory:
        """That of a running process."""
        lines = Path(f"/proc/{pid}/status").read_text().splitlines()
        kib = {line.split(":")[0]: int(line.split()[1]) for line in lines if line.startswith("Vm")}
        return Memory(kib["VmRSS"] * 1024, kib["VmHWM"] * 1024)


@dataclass
class Run:
    """Everything that the tables and checks speak of.

    Attributes
    ----------
    before, start : SessionInfo, Survey
        After the import.
    empty, imported : Memory
        Of the daemon, before and after the import.
    wall_s : float
        From the first step to the end of the last.
    """

    daemon: dynmesh.Daemon
    session: dynmesh.Session
    before: dynmesh.SessionInfo
    start: Survey
    empty: Memory
    imported: Memory
    steps: list[StepReport] = field(default_factory=list)
    wall_s: float = 0.0
    followers: list[FollowerReport] = field(default_factory=list)

    @property
    def items(self) -> int:
        """Moves, removals and additions of all steps."""
        return sum(step.items for step in self.steps)


def print_tables(run: Run) -> None:
    """Entities, memory, the simulation, the followers."""
    after = run.session.info()
    _print_counts(run.before, after)
    _print_memory(run, after)
    if run.steps:
        _print_edits(run)
        _print_followers(run)


def check(checks: Checks, run: Run, end: Survey, is_plate: bool) -> None:
    """All that must hold. `end`: as the session is now; `is_plate`: it is the demo's own mesh."""
    after = run.session.info()
    for follower in run.followers:
        name = follower.plan.name
        checks.add(follower.checksum == after.checksum, f"'{name}' equals the server", f"{follower.checksum}")
        checks.add(follower.refollows == 0, f"'{name}' never had to start over")
        if is_plate and run.wall_s < len(run.steps) * follower.plan.pause_s:
            found = f"{follower.deltas} for {len(run.steps)} revisions"
            checks.add(follower.deltas < len(run.steps), f"'{name}' was sent fewer, larger deltas", found)
    exported = run.session.snapshot(progress=False).checksum()
    checks.add(exported == after.checksum, "an export equals the server")
    checks.add(
        end.num_inverted <= run.start.num_inverted,
        "no element was inverted",
        f"{end.num_inverted} of {end.num_elements:,}, {run.start.num_inverted} at the start",
    )
    checks.add(
        after.euler_characteristic == run.before.euler_characteristic,
        "the topology is the same",
        f"V-E+F-C = {after.euler_characteristic}",
    )
    _check_sizes(checks, run, end, is_plate)
    if run.start.num_elements <= _MOST_VALIDATED:
        broken = run.session.validate()
        checks.add(not broken, "the server's data structure is sound", "; ".join(broken[:3]))


def _check_sizes(checks: Checks, run: Run, end: Survey, is_plate: bool) -> None:
    """A plate whose hole moved has the volume that it had; other meshes are pulled out of shape."""
    is_volume = end.kind == dynmesh.EntityKind.CELL
    if is_volume:
        error = part(abs(sum(step.size_error for step in run.steps)), run.start.size)
        found = f"to {error:.0e} of the volume"
        checks.add(error < _SIZE_TOLERANCE, "what was added fills what was removed", found)
    what = "volume" if is_volume else "area"
    found = f"{run.start.size:.9g} became {end.size:.9g}"
    if is_plate:
        change = part(abs(end.size - run.start.size), run.start.size)
        checks.add(change < _HOLE_TOLERANCE, f"the {what} is the same", found)
    else:
        print(f"          the {what} {found}")


# ---- Tables ----


def _print_counts(before: dynmesh.SessionInfo, after: dynmesh.SessionInfo) -> None:
    rows = [
        ("imported", *before.counts, before.euler_characteristic),
        ("Euler's estimate", *before.estimated_counts, ""),
        (f"at revision {after.revision}", *after.counts, after.euler_characteristic),
        ("Euler's estimate", *after.estimated_counts, ""),
        ("on the boundary", *after.boundary_counts[:3], "", ""),
    ]
    print_table("Entities", ("", "V", "E", "F", "C", "V-E+F-C"), rows)


def _print_memory(run: Run, after: dynmesh.SessionInfo) -> None:
    memory = Memory.of(run.daemon.pid)
    sizes = [
        ("empty", run.empty.now),
        ("after the import", run.imported.now),
        ("now", memory.now),
        ("at most", memory.peak),
        ("the mesh itself", after.memory_bytes),
    ]
    elements = max(run.start.num_elements, 1)
    rows = [(name, megabytes(size), f"{size / elements:.0f}") for name, size in sizes]
    print_table("Memory of the daemon", ("", "resident", "bytes/element"), rows)


def _print_edits(run: Run) -> None:
    def total(name: str) -> float:
        return sum(getattr(step, name) for step in run.steps)

    batches, commit_s = len(run.steps), np.array([step.commit_s for step in run.steps])
    rows = [
        ("batches", batches, rate(batches, total("commit_s")), rate(batches, run.wall_s)),
        ("edits", run.items, rate(run.items, total("commit_s")), rate(run.items, run.wall_s)),
        ("  moved vertices", total("moved"), "", ""),
        ("  removed", total("removed"), "", ""),
        ("  added", total("added"), "", ""),
    ]
    print_table("The simulation", ("", "count", "in commits", "in all"), rows)
    print(f"  {total('inverted'):,} elements would have inverted; {total('repairs'):,} cavities were emptied")
    print(f"  and filled anew; {total('held'):,} times a vertex was held back")
    median, worst = milliseconds(np.median(commit_s)), milliseconds(np.quantile(commit_s, 0.99))
    print(f"  a commit took {median} (p50), {worst} (p99); queries {total('read_s'):.1f} s, repairs")
    print(f"  {total('repair_s'):.1f} s, commits {total('commit_s'):.1f} s, in all {run.wall_s:.1f} s")


def _print_followers(run: Run) -> None:
    header = ("follower", "codec", "deltas", "raw", "encoded", "ratio", "p50", "p99", "first copy")
    rows = [_follower_row(follower) for follower in run.followers]
    print_table("Followers (latency: from commit to applied and verified)", header, rows)
    for follower in run.followers:
        if follower.caught_up is not None:
            missed, size, took = follower.caught_up
            print(f"  '{follower.plan.name}' missed {missed} revisions and had them in", end=" ")
            print(f"{milliseconds(took)}, by {megabytes(size)}")


def _follower_row(follower: FollowerReport) -> tuple[str | int, ...]:
    late = follower.latencies_s or [float("nan")]
    return (
        follower.plan.name,
        follower.plan.codec,
        follower.deltas,
        megabytes(follower.raw_bytes),
        megabytes(follower.encoded_bytes),
        f"{part(follower.raw_bytes, follower.encoded_bytes):.2f}",
        milliseconds(np.median(late)),
        milliseconds(np.quantile(late, 0.99)),
        megabytes(follower.copy_bytes),
    )
