"""The simulation client: moves the vertices of a region step by step, and keeps every element positive.

It knows the mesh from the service alone. Each step asks for the neighbourhood of what moves, repairs what the
move would invert or flatten, and commits moves, removals and additions as one batch.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from dynmesh import ElementType, EntityKind, Session
from numpy.typing import NDArray

from .cavities import POOR, Cavities
from .elements import Floats, Ints, sizes
from .fans import CENTRE, fan
from .patch import Block, Change, Patch, Sent, fill_batch, read_patch
from .region import Region
from .survey import Survey

_MOST_REPAIRS = 600  # tried in one attempt
_MOST_ATTEMPTS = 8  # at a step, each holding more vertices back

_SIMPLEX = {EntityKind.CELL: ElementType.TETRAHEDRON, EntityKind.FACE: ElementType.TRIANGLE}

Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class StepReport:
    """What one step did.

    Attributes
    ----------
    revision : int
    moved, removed, added : int
        Items of the batch.
    inverted : int
        Elements that the move alone would have inverted.
    repairs : int
        Cavities that were emptied and filled anew.
    held : int
        Vertices that had to stay where they were.
    size_error : float
        By how much the volume of what was added differs from that of what was removed.
    read_s, repair_s, commit_s : float
        Time for the queries, for our own work, and for the commit.
    """

    revision: int
    moved: int
    removed: int
    added: int
    inverted: int
    repairs: int
    held: int
    size_error: float
    read_s: float
    repair_s: float
    commit_s: float

    @property
    def items(self) -> int:
        """Moves, removals and additions."""
        return self.moved + self.removed + self.added


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
    """

    def __init__(self, session: Session, region: Region, start: Survey, revision: int) -> None:
        self._session = session
        self._region = region
        self._kind = start.kind
        self._flipped = start.flipped
        self._pinned = start.pinned
        self._revision = revision
        self._reachable = start.vertex_ids[region.within_reach(start.points)]
        self._spacing: float | None = None

    def step(self, begin: float, end: float) -> StepReport:
        """Moves the region from where its path is at one time to where it is at another, and commits."""
        started = time.perf_counter()
        here, there = self._region.path(begin), self._region.path(end)
        patch = self._read(here)
        pulled = patch.points + self._region.pull(patch.points, here)[:, None] * (there - here)
        target = np.where(patch.moving[:, None], pulled, patch.points)
        have_read = time.perf_counter()
        change, held = self._repaired(patch, target)
        repaired = time.perf_counter()
        sent = self._commit(patch, change)
        committed = time.perf_counter()
        return StepReport(
            revision=self._revision,
            moved=sent.moved,
            removed=sent.removed,
            added=sent.added,
            inverted=sum(_count_inverted(block, patch, target) for block in patch.blocks),
            repairs=change.repairs,
            held=held,
            size_error=_size_error(patch, change),
            read_s=have_read - started,
            repair_s=repaired - have_read,
            commit_s=committed - repaired,
        )

    # ---- Talking to the service ----

    def _read(self, centre: Floats) -> Patch:
        points = self._session.positions(self._reachable, as_of_revision=self._revision)
        moving = self._reachable[self._region.pull(points, centre) > 0]
        if self._kind is None:
            points = self._session.positions(moving, as_of_revision=self._revision)
            return Patch(self._revision, moving, points, np.ones(len(moving), dtype=bool), ())
        patch = read_patch(self._session, self._kind, moving, self._revision)
        if self._spacing is None:
            self._spacing = _median_spacing(patch)
        return patch

    def _commit(self, patch: Patch, change: Change) -> Sent:
        with self._session.edit(if_revision=self._revision, as_of_revision=self._revision) as tx:
            kind = self._kind or EntityKind.CELL
            sent = fill_batch(tx, patch, change, kind, self._flipped)
        self._revision = tx.result.revision
        kept = np.setdiff1d(self._reachable, sent.lost_vertices)
        self._reachable = np.union1d(kept, tx.result.resolve(sent.new_handles).astype(np.int64))
        return sent

    # ---- Repairing ----

    def _repaired(self, patch: Patch, target: Floats) -> tuple[Change, int]:
        """A change that leaves nothing inverted that was not before, and how many vertices it holds back."""
        held = np.zeros(len(patch.points), dtype=bool)
        for _ in range(_MOST_ATTEMPTS):
            points = np.where(held[:, None], patch.points, target)
            change, stuck = self._attempt(patch, points)
            if not stuck.size:
                return change, int((held & patch.moving).sum())
            held[stuck] = True
        return Change(patch.points), int(patch.moving.sum())

    def _attempt(self, patch: Patch, points: Floats) -> tuple[Change, Ints]:
        """A change with the vertices at `points`, and the vertices of elements that it leaves inverted."""
        change, stuck = Change(points), [np.zeros(0, dtype=np.int64)]
        simplex = _SIMPLEX.get(self._kind) if self._kind else None
        for block in patch.blocks:
            if block.of_type == simplex:
                stuck.append(self._repair_simplices(block, patch, change))
        for block in patch.blocks:
            if block.of_type != simplex:
                stuck.append(_repair_by_fans(block, patch, change))
        return change, np.unique(np.concatenate(stuck))

    def _repair_simplices(self, block: Block, patch: Patch, change: Change) -> Ints:
        quality = block.qualities(change.points, patch.points)
        before = block.qualities(patch.points, patch.points)
        pinned, spacing = self._pinned_in(patch), self._spacing or 0.0
        cavities = Cavities(
            block.of_type, block.corners, quality, change.points, patch.moving, pinned, spacing
        )
        worn = np.flatnonzero(cavities.is_worn(quality, before))
        change.repairs += _repair_worst_first(cavities, worn)
        given = len(block.ids)
        change.points = cavities.points
        change.removed = np.concatenate([change.removed, block.ids[~cavities.alive[:given]]])
        change.added.append((block.of_type, cavities.corners[given:][cavities.alive[given:]]))
        change.lost = np.concatenate([change.lost, cavities.lost_vertices()])
        ruined = (before > 0) & cavities.alive[:given] & (quality <= 0)
        return np.unique(block.corners[ruined])

    def _pinned_in(self, patch: Patch) -> Mask:
        """Vertices that more hangs on than tetrahedra or, on a surface, triangles."""
        pinned = np.isin(patch.vertices, self._pinned)
        for block in patch.blocks:
            if block.of_type != _SIMPLEX[self._kind]:
                pinned[block.corners] = True
        return pinned


def _repair_worst_first(cavities: Cavities, worn: Ints) -> int:
    """Repairs what can be repaired of the elements `worn`; returns how often."""
    order = worn[np.argsort(cavities.quality[worn])][:_MOST_REPAIRS]
    again = order[cavities.quality[order] <= 0]  # when their neighbours are better
    elements = np.concatenate([order, again]).tolist()
    return sum(cavities.repair(element) for element in elements if cavities.alive[element])


def _repair_by_fans(block: Block, patch: Patch, change: Change) -> Ints:
    """Replaces worn elements by fans; returns the vertices of those that stay inverted."""
    quality = block.qualities(change.points, patch.points)
    before = block.qualities(patch.points, patch.points)
    gone, stuck = [], [np.zeros(0, dtype=np.int64)]
    worn = np.flatnonzero((quality <= 0) | ((quality < POOR) & (quality < 0.999 * before)))
    for row in worn:
        made = fan(block.of_type, block.corners[row], change.points)
        if made is not None:
            for of_type, corners in made.blocks:
                change.added.append((of_type, np.where(corners == CENTRE, len(change.points), corners)))
            change.points = np.vstack([change.points, made.point])
            gone.append(block.ids[row])
        elif quality[row] <= 0 < before[row]:
            stuck.append(block.corners[row])
    change.removed = np.concatenate([change.removed, np.array(gone, dtype=np.int64)])
    change.repairs += len(gone)
    return np.concatenate(stuck)


def _count_inverted(block: Block, patch: Patch, target: Floats) -> int:
    inverted = block.qualities(target, patch.points) <= 0
    return int((inverted & (block.qualities(patch.points, patch.points) > 0)).sum())


def _size_error(patch: Patch, change: Change) -> float:
    new = sum(float(sizes(of_type, change.points[corners]).sum()) for of_type, corners in change.added)
    for block in patch.blocks:
        gone = block.corners[np.isin(block.ids, change.removed)]
        new -= float(sizes(block.of_type, change.points[gone]).sum())
    return new


def _median_spacing(patch: Patch) -> float:
    ends = [block.corners[:, :2] for block in patch.blocks]
    points = patch.points[np.concatenate(ends)] if ends else np.zeros((0, 2, 3))
    return float(np.median(np.linalg.norm(points[:, 1] - points[:, 0], axis=1))) if len(points) else 0.0
