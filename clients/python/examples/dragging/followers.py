"""Followers of a session, each with a mirror in a process of its own, as other machines would have.

A follower process answers commands one at a time; `FollowerProcess` has a method for each of them.
"""

from __future__ import annotations

import multiprocessing
import time
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from types import TracebackType
from typing import Any

import dynmesh

_START_TIMEOUT_S = 60.0
_FOLLOW_TIMEOUT_S = 120.0
_SLOW_READ_AHEAD_BYTES = 64 << 10


@dataclass(frozen=True)
class Plan:
    """How a follower follows: a name for the tables, the codec, and the seconds that it spends on each delta.

    While it does it reads nothing, so what the server sends gets stuck on the way, where there is room for
    64 KiB: the server then waits, and sends fewer, larger deltas.
    """

    name: str
    codec: str
    pause_s: float = 0.0


@dataclass
class FollowerReport:
    """What a follower received since its first copy of the whole, and what it holds now.

    Attributes
    ----------
    deltas : int
    raw_bytes, encoded_bytes : int
        Of topology and geometry, before and after encoding.
    latencies_s : list of float
        From commit to applied and verified.
    copy_bytes : int
        Encoded size of the first copy.
    refollows : int
        How often it had to fetch everything again.
    checksum : Checksum or None
        Of its copy at the end, computed there.
    caught_up : tuple of (int, int, float) or None
        After a return: revisions missed, encoded bytes and seconds until it had them.
    """

    plan: Plan
    deltas: int = 0
    raw_bytes: int = 0
    encoded_bytes: int = 0
    latencies_s: list[float] = field(default_factory=list)
    copy_bytes: int = 0
    refollows: int = 0
    checksum: dynmesh.Checksum | None = None
    caught_up: tuple[int, int, float] | None = None


class FollowerProcess:
    """The near end of a follower. Each method waits for the answer, or raises what went wrong over there."""

    def __init__(self, plan: Plan, target: str, session: str) -> None:
        context = multiprocessing.get_context("spawn")  # gRPC does not survive a fork
        self.plan = plan
        self._pipe, far_end = context.Pipe()
        self._process = context.Process(target=_serve, args=(far_end, plan, target, session), daemon=True)
        self._process.start()
        far_end.close()

    def __enter__(self) -> FollowerProcess:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._pipe.close()  # ends its loop
        self._process.join(timeout=10)
        if self._process.is_alive():
            self._process.kill()

    def copy(self, revision: int) -> int:
        """Waits until it has a copy at `revision` or later, and counts from there on."""
        return self._ask("copy", revision)

    def leave(self) -> int:
        """Disconnects, keeping its copy; returns the revision of that."""
        return self._ask("leave")

    def come_back(self) -> int:
        """Follows again, from the revision that it has; returns the revision that it then reached."""
        return self._ask("come_back")

    def finish(self, revision: int) -> FollowerReport:
        """Waits until it is at `revision`, and reports."""
        return self._ask("finish", revision)

    def _ask(self, command: str, *arguments: Any) -> Any:
        try:
            self._pipe.send((command, arguments))
            if not self._pipe.poll(_START_TIMEOUT_S + _FOLLOW_TIMEOUT_S):
                raise TimeoutError(f"follower {self.plan.name} does not answer")
            answer = self._pipe.recv()
        except (EOFError, BrokenPipeError):
            raise RuntimeError(f"follower {self.plan.name} has died") from None
        if isinstance(answer, Exception):
            raise answer
        return answer


class _Follower:
    """The far end: a mirror, and figures over all the mirrors that it has had."""

    def __init__(self, plan: Plan, session: dynmesh.Session) -> None:
        self._session = session
        self._report = FollowerReport(plan)
        self._mirror = self._follow(None)

    def copy(self, revision: int) -> int:
        reached = self._mirror.wait(revision, _FOLLOW_TIMEOUT_S)
        self._report.copy_bytes = self._mirror.stats.received_bytes
        self._counted = _Counters.of(self._mirror)
        return reached

    def leave(self) -> int:
        self._mirror.close()
        self._count()
        return self._mirror.state().revision

    def come_back(self) -> int:
        had, started = self._mirror.state().revision, time.perf_counter()
        now = self._session.revision
        self._mirror = self._follow(self._mirror)
        self._counted = _Counters()
        reached = self._mirror.wait(now, _FOLLOW_TIMEOUT_S)
        took = time.perf_counter() - started
        self._report.caught_up = (reached - had, self._mirror.stats.received_bytes, took)
        return reached

    def finish(self, revision: int) -> FollowerReport:
        self._mirror.wait(revision, _FOLLOW_TIMEOUT_S)
        self._report.checksum = self._mirror.checksum
        self._count()
        return self._report

    def close(self) -> None:
        self._mirror.close()

    def _follow(self, former: dynmesh.Mirror | None) -> dynmesh.Mirror:
        plan = self._report.plan
        on_delta = (lambda update: time.sleep(plan.pause_s)) if plan.pause_s else None
        return self._session.mirror(codec=plan.codec, from_mirror=former, on_delta=on_delta)

    def _count(self) -> None:
        """Adds what the mirror has received since it was last counted."""
        now, before, report = _Counters.of(self._mirror), self._counted, self._report
        report.deltas += now.deltas - before.deltas
        report.raw_bytes += now.raw_bytes - before.raw_bytes
        report.encoded_bytes += now.encoded_bytes - before.encoded_bytes
        report.latencies_s += now.latencies_s[len(before.latencies_s) :]
        report.refollows += self._mirror.stats.refollows
        self._counted = now


@dataclass(frozen=True)
class _Counters:
    deltas: int = 0
    raw_bytes: int = 0
    encoded_bytes: int = 0
    latencies_s: tuple[float, ...] = ()

    @staticmethod
    def of(mirror: dynmesh.Mirror) -> _Counters:
        with mirror.lock:
            stats = mirror.stats
            raw_bytes = stats.raw_topology_bytes + stats.raw_geometry_bytes
            return _Counters(stats.deltas, raw_bytes, stats.received_bytes, tuple(stats.latencies_s))


def _serve(pipe: Connection, plan: Plan, target: str, session: str) -> None:
    """Main function of a follower process."""
    read_ahead_bytes = _SLOW_READ_AHEAD_BYTES if plan.pause_s else None
    with dynmesh.connect(target, read_ahead_bytes=read_ahead_bytes) as client:
        follower = _Follower(plan, client.session(session))
        while True:
            try:
                command, arguments = pipe.recv()
            except (EOFError, KeyboardInterrupt):
                break
            try:
                answer = getattr(follower, command)(*arguments)
            except Exception as error:  # belongs to whoever asked
                answer = error
            pipe.send(answer)
        follower.close()
