"""What a move does to a patch: where it would turn elements over, and which edges it leaves long or short."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .elements import Floats, Ids, Ints
from .patch import Mask, Patch

_LONG, _SHORT = 1.8, 0.6  # of the spacing that the mesh had there
_CHANGED = 1e-6  # relative
_MOST_ATTEMPTS = 8  # each holding more vertices back
_PASSED_OVER = 0xFFFFFFFF  # instead of a new vertex


@dataclass(frozen=True)
class Wear:
    """Edges that a move has worn out, by ids of their vertices, the worst first.

    Attributes
    ----------
    long : int64[n, 2]
    short : int64[m, 2]
        The first end can go: it lies inside, or on a flat part of the surface and the edge too.
    meeting : float64[m]
        Where both ends of these are to meet, as a parameter of the edge: at its middle if both can go.
    """

    long: Ints
    short: Ints
    meeting: Floats


class Spacing:
    """How long edges are to be at each vertex: as they were when the region first came there."""

    def __init__(self) -> None:
        self._by_id = np.zeros(0)

    def learn(self, patch: Patch) -> None:
        """Notes the mean length of the edges of vertices that are new here."""
        self._grow(patch.vertices)
        ends, lengths = patch.edges.ravel(), np.repeat(patch.lengths(patch.points), 2)
        size = len(patch.vertices)
        means = np.bincount(ends, lengths, size) / np.maximum(np.bincount(ends, minlength=size), 1)
        new = patch.vertices[patch.is_known & (self._by_id[patch.vertices] == 0)]
        self._by_id[new] = means[np.searchsorted(patch.vertices, new)]

    def inherit(self, vertices: Ids, ends: Ints) -> None:
        """New vertices, uint32[n], on edges between others, int64[n, 2], want what those want."""
        made = vertices != _PASSED_OVER
        self._grow(vertices[made])
        self._by_id[vertices[made]] = self.of(ends[made])

    def forget(self, vertices: Ids) -> None:
        """New vertices, uint32[n], where others may have been before."""
        made = vertices[vertices != _PASSED_OVER]
        self._grow(made)
        self._by_id[made] = 0

    def of(self, ends: Ints) -> Floats:
        """For edges between vertices, int64[n, 2]: float64[n]."""
        known = self._by_id[ends]
        return known.sum(axis=1) / np.maximum((known > 0).sum(axis=1), 1)

    def _grow(self, vertices: Ints | Ids) -> None:
        missing = int(vertices.max(initial=0)) + 1 - len(self._by_id)
        self._by_id = np.pad(self._by_id, (0, max(missing, 0)))


def permitted(patch: Patch, target: Floats) -> tuple[Floats, int]:
    """Positions, float64[m, 3], that turn no element over; and how many vertices are not at `target` there."""
    held = np.zeros(len(target), dtype=bool)
    for _ in range(_MOST_ATTEMPTS):
        points = np.where(held[:, None], patch.points, target)
        stuck = _corners_turned_over(patch, points)
        if not stuck.size:
            return points, int((held & patch.is_known).sum())
        held[stuck] = True
    return patch.points, int(patch.is_known.sum())


def wear_of(patch: Patch, points: Floats, spacing: Spacing) -> Wear:
    """What moving a patch to `points`, float64[m, 3], does to its edges."""
    before, after = patch.lengths(patch.points), patch.lengths(points)
    wanted = spacing.of(patch.vertices[patch.edges])
    long = (after > _LONG * wanted) & (after > (1 + _CHANGED) * before)
    long &= ~patch.is_spoilt[patch.edges].all(axis=1)
    goes = _can_go(patch)
    short = (after < _SHORT * wanted) & (after < (1 - _CHANGED) * before) & goes.any(axis=1)
    turned = np.where(goes[:, :1], patch.edges, patch.edges[:, ::-1])
    order = _sorted(short, after)
    return Wear(
        long=patch.vertices[patch.edges[_sorted(long, -after)]],
        short=patch.vertices[turned[order]],
        meeting=np.where(goes[order].all(axis=1), 0.5, 1.0),
    )


def _can_go(patch: Patch) -> Mask:
    """bool[e, 2]: whether the edge may be drawn together onto its other end."""
    free = patch.can_slide[patch.edges]
    return free & (patch.edge_on_surface[:, None] | ~patch.on_surface[patch.edges])


def _sorted(chosen: Mask, urgency: Floats) -> Ints:
    rows = np.flatnonzero(chosen)
    return rows[np.argsort(urgency[rows])]


def _corners_turned_over(patch: Patch, points: Floats) -> Ints:
    turned = [np.zeros(0, dtype=np.int64)]
    for block, before in zip(patch.blocks, patch.qualities):
        after = block.qualities(points, patch.points)
        turned.append(block.corners[(before > 0) & (after <= 0)].ravel())
    return np.concatenate(turned)
