"""A live copy of a session that follows it in the background and proves itself."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from types import TracebackType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .arguments import as_int64, as_number
from .arrays import Ids, Points, frozen
from .checksum import Checksum
from .delta import Delta
from .errors import DeadlineExceededError, DynmeshError, MirrorError
from .follower import Follower, Subscribe
from .kinds import KindLike, as_kind
from .mirror_state import MirrorState
from .mirror_stats import MirrorStats
from .snapshot import Snapshot
from .v1 import subscriptions_pb2

if TYPE_CHECKING:
    import meshio


class Elements(NamedTuple):
    """Elements of one kind by slot: types uint8[size] (0: none) and vertices uint32[size, width]."""

    types: NDArray[np.uint8]
    vertices: Ids


@dataclass(frozen=True)
class Update:
    """One step of a mirror, from one revision of the session to a later one.

    Attributes
    ----------
    from_revision, revision : int
    deltas : tuple of Delta
        One; several chunks when the answer was long.
    received_bytes : int
    latency_s : float
        Since the commit of `revision`, by the two wall clocks.
    """

    from_revision: int
    revision: int
    deltas: tuple[Delta, ...]
    received_bytes: int
    latency_s: float


class Mirror:
    """Follows a session; made by `Session.mirror`.

    >>> with session.mirror() as mirror:
    ...     mirror.wait(revision)
    ...     with mirror.lock:
    ...         points = mirror.positions[mirror.elements("cell").vertices[7]]

    What can be read is always a whole revision: chunks of a longer answer are held back until it is
    complete. Each state is compared with the session's checksum, which covers vertices and elements, not
    attributes. A copy that differs is thrown away and fetched again, once; if that one differs too the mirror
    ends with a `MirrorError`. A broken connection is taken up again from the last revision, for as long as the
    mirror is open; if another session has the name by then, its copy is fetched from the beginning.

    Thread safety: everything may be called from any thread. Arrays are views that stay as they are only
    while `lock` is held; `snapshot` copies.

    Parameters
    ----------
    on_delta : callable, optional
        Called in the mirror's own thread with each `Update`. If it raises, the mirror ends.

    Attributes
    ----------
    stats : MirrorStats
    """

    def __init__(
        self,
        subscribe: Subscribe,
        request: subscriptions_pb2.SubscribeRequest,
        state: MirrorState,
        on_delta: Callable[[Update], None] | None = None,
    ) -> None:
        self.stats = MirrorStats()
        self._on_delta = on_delta
        self._condition = threading.Condition(threading.RLock())
        self._state = state
        self._last: Update | None = None
        self._pending_bytes = 0
        self._synced = True
        self._confirmed = state.revision == 0  # else the server has yet to say that the session is still that one
        self._starting_over = False
        self._closed = False
        self._error: DynmeshError | None = None
        self._follower = Follower(subscribe, request, _MirrorSink(self))
        self._follower.start()

    # ---- Reading ----

    @property
    def lock(self) -> threading.Condition:
        """Held by a ``with`` block, nothing changes."""
        return self._condition

    @property
    def revision(self) -> int:
        """Revision of the session that this copy equals; 0 before the first delta."""
        return self._current().revision

    @property
    def checksum(self) -> Checksum:
        """Of this copy, computed here."""
        return self._current().checksum

    @property
    def num_vertices(self) -> int:
        """Live vertices."""
        return self._current().vertices.count

    @property
    def positions(self) -> Points:
        """float64[size, 3] by vertex slot; meaningless where `live_vertices` is False."""
        return frozen(self._current().vertices.positions)

    @property
    def live_vertices(self) -> NDArray[np.bool_]:
        """bool[size] by vertex slot."""
        return frozen(self._current().vertices.live)

    def num_elements(self, kind: KindLike) -> int:
        """Elements of a kind."""
        return self._current().elements[as_kind(kind)].count

    def elements(self, kind: KindLike) -> Elements:
        """Elements of a kind ("edge", "face", "cell") by slot."""
        table = self._current().elements[as_kind(kind)]
        return Elements(frozen(table.types), frozen(table.vertices))

    def attribute(self, name: str, kind: KindLike) -> NDArray[Any]:
        """Rows of an attribute by slot: [size, components] of its type, the default row where none was ever set.

        There is a row for each slot of `positions`, or of `elements` of the kind. Faces and edges that are no elements
        are not part of a mirror, their rows are: `size` is larger where one of them has a row beyond those, and slots
        from `size` on have the default row. Where no entity stands a row means nothing.

        Raises KeyError if there is no such column.
        """
        return frozen(self._current().attributes[as_kind(kind), name].values)

    def snapshot(self) -> Snapshot:
        """A copy of everything."""
        with self._condition:
            return self._current().snapshot()

    def to_meshio(self, *, slots: bool = True) -> meshio.Mesh:
        """A copy of everything for meshio: as `Snapshot.to_meshio`."""
        return self.snapshot().to_meshio(slots=slots)

    # ---- Following ----

    def wait(self, revision: int, timeout: float | None = None) -> int:
        """Waits until this copy is at `revision` or later; returns where it is.

        Raises `DeadlineExceededError` after `timeout` seconds (None: no limit), and what ended the mirror.
        """
        as_int64(revision, "revision")
        with self._condition:
            self._condition.wait_for(lambda: self._ended() or self._is_at(revision), _patience(timeout))
            if self._is_at(revision):
                return self._state.revision
            self._raise_if_ended()
            raise DeadlineExceededError(f"revision {revision} was not reached within {timeout} s")

    def updates(self, timeout: float | None = None) -> Iterator[Update]:
        """Steps of the mirror, beginning with the last one, until it is closed.

        Whoever is slow gets fewer: always the newest, never one that is past. ``on_delta`` sees them all.
        Raises what ended the mirror, and `DeadlineExceededError` when nothing happened for `timeout` seconds.
        """
        seen: Update | None = None
        while True:
            with self._condition:
                self._condition.wait_for(lambda: self._ended() or self._last is not seen, _patience(timeout))
                if self._last is seen:
                    if self._closed:
                        return
                    self._raise_if_ended()
                    raise DeadlineExceededError(f"no update within {timeout} s")
                seen = self._last
            assert seen is not None
            yield seen

    def pause(self) -> None:
        """Stops following: no step is taken any more but one that has begun.

        The server queues nothing for it. What it has sent already is taken first after `resume`; then come fewer,
        larger deltas.
        """
        self._follower.set_paused(True)

    def resume(self) -> None:
        """Reads on."""
        self._follower.set_paused(False)

    def close(self) -> None:
        """Ends following; what was copied stays readable."""
        with self._condition:
            self._closed = True
            self._condition.notify_all()
        self._follower.close()

    def state(self) -> MirrorState:
        """A copy of the data, from which another mirror may go on."""
        with self._condition:
            return self._current().copy()

    def __enter__(self) -> Mirror:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _current(self) -> MirrorState:
        with self._condition:
            if not self._synced:
                self._raise_if_ended()
                raise MirrorError("the copy differed and is being fetched again", reason="REFOLLOWING")
            return self._state

    def _is_at(self, revision: int) -> bool:
        return self._synced and self._confirmed and self._state.revision >= revision

    def _ended(self) -> bool:
        return self._closed or self._error is not None

    def _raise_if_ended(self) -> None:
        if self._error is not None:
            raise self._error
        if self._closed:
            raise MirrorError("the mirror is closed", reason="CLOSED")


def _patience(timeout: float | None) -> float | None:
    """Seconds for a condition, which takes no infinity."""
    if timeout is None or as_number(timeout, "timeout") > threading.TIMEOUT_MAX:
        return None
    return float(timeout)


class _MirrorSink:
    """The side of a mirror that its follower writes to."""

    def __init__(self, mirror: Mirror) -> None:
        self._mirror = mirror

    def resume_at(self) -> tuple[int, str]:
        self._mirror._pending_bytes = 0
        return self._mirror._state.revision, self._mirror._state.session_uid

    def received(self, message: subscriptions_pb2.SubscribeResponse) -> None:
        with self._mirror._condition:
            self._mirror.stats.count(message)
            self._mirror._pending_bytes += len(message.delta)

    def take(self, deltas: tuple[Delta, ...], message: subscriptions_pb2.SubscribeResponse) -> None:
        mirror = self._mirror
        with mirror._condition:
            from_revision = mirror._state.revision
            self._apply(deltas)
            mirror._state.session_uid = message.session_uid
            latency_s = max(time.time() - message.commit_time_us * 1e-6, 0.0)
            update = Update(from_revision, message.revision, deltas, mirror._pending_bytes, latency_s)
            mirror.stats.latencies_s.append(latency_s)
            mirror._pending_bytes = 0
            mirror._last = update
            mirror._condition.notify_all()
        if mirror._on_delta is not None:
            mirror._on_delta(update)

    def reconnecting(self) -> None:
        with self._mirror._condition:
            self._mirror.stats.reconnects += 1

    def start_over(self) -> bool:
        mirror = self._mirror
        with mirror._condition:
            if mirror._starting_over:
                return False
            mirror._state, mirror._synced, mirror._starting_over = MirrorState(), False, True
            mirror.stats.refollows += 1
            return True

    def failed(self, error: DynmeshError) -> None:
        with self._mirror._condition:
            self._mirror._error = error
            self._mirror._condition.notify_all()

    def _apply(self, deltas: tuple[Delta, ...]) -> None:
        self._mirror._synced = False  # until all are applied and verified
        for delta in deltas:
            self._mirror._state.apply(delta)
        self._mirror._synced = self._mirror._confirmed = True
        self._mirror._starting_over = False
