"""What came out of a run: tables for humans, and checks that decide about the exit status."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import dynmesh
import numpy as np

from .followers import FollowerReport
from .operators import Outcome
from .report import Checks, megabytes, milliseconds, part, print_table, rate
from .simulation import StepReport
from .survey import Survey

_SIZE_TOLERANCE = 1e-9  # relative
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
    finish: StepReport | None = None
    wall_s: float = 0.0
    outcomes: dict[str, Outcome] = field(default_factory=dict)
    followers: list[FollowerReport] = field(default_factory=list)

    def total(self, name: str) -> float:
        """An attribute of `StepReport`, of all steps and the work at the end."""
        reports = [*self.steps, *([self.finish] if self.finish else [])]
        return sum(getattr(report, name) for report in reports)


def print_tables(run: Run, end: Survey) -> None:
    """Entities, memory, the simulation with its operators, the followers. `end`: as the session is now."""
    after = run.session.info()
    _print_counts(run.before, after)
    _print_memory(run, after)
    _print_shapes(run.start, end)
    if run.steps:
        _print_edits(run)
        _print_operators(run.outcomes)
        _print_followers(run)


def check(checks: Checks, run: Run, end: Survey, is_plate: bool) -> None:
    """All that must hold. `end`: as the session is now; `is_plate`: it is the demo's own mesh."""
    after = run.session.info()
    for follower in run.followers:
        name = follower.plan.name
        checks.add(follower.checksum == after.checksum, f"'{name}' equals the server", f"{follower.checksum}")
        checks.add(follower.refollows == 0, f"'{name}' never had to start over")
        batches = run.total("batches")
        if is_plate and run.wall_s < batches * follower.plan.pause_s:
            found = f"{follower.deltas} for {batches} revisions"
            checks.add(follower.deltas < batches, f"'{name}' was sent fewer, larger deltas", found)
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
    if is_plate:
        _check_shapes(checks, run, end)
    if run.start.num_elements <= _MOST_VALIDATED:
        broken = run.session.validate()
        checks.add(not broken, "the server's data structure is sound", "; ".join(broken[:3]))


def _check_shapes(checks: Checks, run: Run, end: Survey) -> None:
    """A plate whose hole moved has the volume and angles that it had; other meshes are pulled out of shape."""
    change = part(abs(end.size - run.start.size), run.start.size)
    found = f"{run.start.size:.12g} became {end.size:.12g}"
    checks.add(change < _SIZE_TOLERANCE, "the volume is the same", found)
    found = f"{run.start.worst_angle:.2f} became {end.worst_angle:.2f} degrees"
    checks.add(end.worst_angle >= run.start.worst_angle, "the worst dihedral angle is no worse", found)


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


def _print_shapes(start: Survey, end: Survey) -> None:
    is_volume = end.kind == dynmesh.EntityKind.CELL
    angle = "worst dihedral angle" if is_volume else "worst angle of a face"
    rows = [
        ("elements", start.num_elements, end.num_elements),
        ("inverted or flat", start.num_inverted, end.num_inverted),
        ("volume" if is_volume else "area", f"{start.size:.9g}", f"{end.size:.9g}"),
        (angle, _degrees(start.worst_angle), _degrees(end.worst_angle)),
    ]
    print_table("Shape", ("", "before", "after"), rows)


def _degrees(angle: float) -> str:
    return f"{angle:.2f} deg" if np.isfinite(angle) else "-"


def _print_edits(run: Run) -> None:
    rows = [
        (what, count, rate(count, run.total("commit_s")), rate(count, run.wall_s))
        for what, count in (("batches", run.total("batches")), ("operations", run.total("operations")))
    ]
    print_table("The simulation", ("", "count", "in commits", "in all"), rows)
    steps_s = [step.total_s for step in run.steps]
    median, worst = milliseconds(np.median(steps_s)), milliseconds(np.quantile(steps_s, 0.99))
    print(f"  a step took {median} (p50), {worst} (p99) through RPC; queries {run.total('read_s'):.1f} s, commits")
    print(f"  {run.total('commit_s'):.1f} s, in all {run.wall_s:.1f} s")
    print(f"  {run.total('held'):,} times a vertex was held back, as it would have turned an element over")


def _print_operators(outcomes: dict[str, Outcome]) -> None:
    rows = []
    for name, outcome in outcomes.items():
        reasons = ", ".join(f"{count:,} {reason}" for reason, count in outcome.reasons.most_common(3))
        rows.append((name, outcome.asked, outcome.accepted, outcome.asked - outcome.accepted, reasons))
    header = ("", "asked", "accepted", "refused", "reasons")
    print_table("Operators (reasons: of the first 100 refusals in a batch)", header, rows)


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
