"""The simulation client: moves the vertices of a region step by step, and mends what that wears out.

It knows the mesh from the service alone. A move is one batch with the splits and collapses that it calls for;
swaps and smoothing where elements are poor then are another.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from dynmesh import Session, Transaction

from .elements import Floats, Ints
from .operators import SMOOTHING, Tally
from .patch import Patch, PatchReader
from .region import Region
from .remedies import CUT_ABOVE, LEVELS, find_remedies
from .survey import ANGLE_CHECKS, Survey
from .wear import Spacing, permitted, wear_of

_MOST_SHARP_DEG = 12.0  # elements with smaller angles are sharp, if none had so small ones at the start
_MOST_ROUNDS = 5  # of work on sharp elements at the end
_SMOOTHINGS = 2


@dataclass
class StepReport:
    """What one step did.

    Attributes
    ----------
    revision : int
        After it.
    batches : int
    operations : int
        Moves of vertices and operators that were carried out.
    held : int
        Vertices that had to stay where they were lest an element be turned over.
    read_s, commit_s, total_s : float
        Time for queries and for commits, both through RPC, and for everything.
    """

    revision: int
    batches: int = 0
    operations: int = 0
    held: int = 0
    read_s: float = 0.0
    commit_s: float = 0.0
    total_s: float = 0.0


class Simulation:
    """Drags a region of a session; the only editor of that session.

    Parameters
    ----------
    session : Session
    region : Region
    start : Survey
        Of the session as it is now.
    revision : int
        At which it was made.

    Attributes
    ----------
    tally : Tally
        Of all that it asked for so far.
    """

    def __init__(self, session: Session, region: Region, start: Survey, revision: int) -> None:
        self.tally = Tally()
        self._session = session
        self._region = region
        self._kind = start.kind
        self._sharp_deg = min(start.worst_angle, _MOST_SHARP_DEG)
        self._reader = PatchReader(session, start.kind, start.flipped)
        self._spacing = Spacing()
        self._report = StepReport(revision)

    def step(self, begin: float, end: float) -> StepReport:
        """Moves the region from where its path is at one time to where it is at another."""
        with self._new_report() as report:
            times = np.linspace(begin, end, self._region.moves(begin, end) + 1)
            places = [self._region.path(t) for t in times]
            for here, there in zip(places, places[1:]):
                self._move(here, there)
                self._improve(self._in_reach(there))
        return report

    def finish(self) -> StepReport:
        """Works on elements that are sharper than any at the start, wherever they are."""
        with self._new_report() as report:
            for _ in range(_MOST_ROUNDS):
                around = self._around_sharp()
                if not around.size:
                    break
                self._improve(around)
        return report

    # ---- Editing ----

    def _move(self, here: Floats, there: Floats) -> None:
        """Moves vertices, splits edges that become long and collapses those that become short."""
        patch = self._read(self._in_reach(here))
        self._spacing.learn(patch)
        pull = np.where(patch.is_known, self._region.pull(patch.points, here), 0.0)
        points, held = permitted(patch, patch.points + pull[:, None] * (there - here))
        moved = np.flatnonzero((points != patch.points).any(axis=1))
        worn = wear_of(patch, points, self._spacing)
        with self._edit() as tx:
            tx.move_vertices(patch.vertices[moved], points[moved])
            tx.split_edges(ends=worn.long, min_quality=LEVELS[0])
            tx.collapse_edges(ends=worn.short, parameters=worn.meeting, min_quality=LEVELS[0])
        self._spacing.inherit(tx.result.new_vertices, worn.long)
        self._count(tx, ("move vertex", moved), ("split edge", worn.long), ("collapse edge", worn.short))
        self._report.held += held

    def _improve(self, vertices: Ints) -> None:
        """Asks for what might better the poor elements at some vertices, int64[n]."""
        if self._kind is None:
            return
        patch = self._read(vertices)
        with self._timed("read_s"):
            remedies = find_remedies(self._session, self._kind, patch, self._sharp_deg)
        with self._edit() as tx:
            for swaps in remedies.swaps:
                tx.swap_faces(swaps.faces, min_quality=swaps.level)
                tx.swap_edges(ends=swaps.edges, min_quality=swaps.level)
            tx.collapse_edges(ends=remedies.collapses, parameters=1.0, min_quality=LEVELS[1])
            tx.split_edges(ends=remedies.splits, min_quality=CUT_ABOVE)
            tx.split_elements(self._kind, remedies.cuts, min_quality=CUT_ABOVE)
            tx.smooth_vertices(
                remedies.smoothed,
                method="optimizing",
                iterations=_SMOOTHINGS,
                move_boundary=True,
                tangential=True,
            )
        self._spacing.forget(tx.result.new_vertices)
        swapped = [(swaps.edges, swaps.faces) for swaps in remedies.swaps]
        self._count(
            tx,
            *(asked for edges, faces in swapped for asked in (("swap face", faces), ("swap edge", edges))),
            ("collapse edge", remedies.collapses),
            ("split edge", remedies.splits),
            ("split element", remedies.cuts),
            (SMOOTHING, remedies.smoothed),
        )

    @contextlib.contextmanager
    def _edit(self) -> Iterator[Transaction]:
        """A batch at the revision that we read, as nobody else edits this session."""
        at = self._report.revision
        with self._timed("commit_s"):
            with self._session.edit(if_revision=at, as_of_revision=at, skip_refused=True) as tx:
                yield tx
        self._report.revision = tx.result.revision
        self._report.batches += 1

    # ---- Asking ----

    def _in_reach(self, centre: Floats) -> Ints:
        """Vertices that the region pulls at when it is there: int64[n]."""
        with self._timed("read_s"):
            near = self._session.entities("vertex", box=self._region.box(centre))
        return near.ids[self._region.pull(near.positions, centre) > 0].astype(np.int64)

    def _around_sharp(self) -> Ints:
        """Vertices next to those of elements that are sharper than any at the start: int64[n]."""
        if self._kind is None:
            return np.zeros(0, dtype=np.int64)
        with self._timed("read_s"):
            check = ANGLE_CHECKS[self._kind]
            sharp = self._session.check({check: ("warn", self._sharp_deg)}, progress=False)[check].ids
            corners = self._session.neighbors(self._kind, "vertex", sharp).neighbors
            around = self._session.neighbors("vertex", "vertex", np.unique(corners)).neighbors
        return np.union1d(corners, around).astype(np.int64)

    def _read(self, vertices: Ints) -> Patch:
        with self._timed("read_s"):
            return self._reader.read(vertices, self._report.revision)

    # ---- Reporting ----

    @contextlib.contextmanager
    def _new_report(self) -> Iterator[StepReport]:
        self._report = StepReport(self._report.revision)
        with self._timed("total_s"):
            yield self._report

    @contextlib.contextmanager
    def _timed(self, name: str) -> Iterator[None]:
        started = time.perf_counter()
        yield
        setattr(self._report, name, getattr(self._report, name) + time.perf_counter() - started)

    def _count(self, tx: Transaction, *asked: tuple[str, Ints]) -> None:
        """Notes what became of a batch that asked for this, in this order."""
        self._report.operations += self.tally.add(tx.result, [(name, len(items)) for name, items in asked])
