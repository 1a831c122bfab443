"""What is dragged: a ball or a cylinder that carries everything inside, and pulls less and less around it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .elements import Floats

# Of a mesh that is not the demo's own: at most so many vertices move, and at most this part of them.
_MOST_VERTICES = 4000
_LARGEST_PART = 0.25

_LARGEST_MOVE = 0.2  # of the way on which the pull fades: strains the mesh by 30 %
_EVERYWHERE = 1e100


@dataclass(frozen=True)
class Region:
    """A field of displacements around a centre that travels.

    Points nearer than `inner` to the centre move as it does, those beyond `outer` stay, and in between the
    pull fades smoothly. Each step is a small one-to-one map of space, so it is the mesh that wears out, not
    the shape.

    Attributes
    ----------
    inner, outer : float
    extent : float64[3]
        1 for axes in which distance counts: a cylinder along z has (1, 1, 0), a ball (1, 1, 1).
    path : callable
        The centre, float64[3], for a time from 0 to 1.
    """

    inner: float
    outer: float
    extent: Floats
    path: Callable[[float], Floats]

    def distances(self, points: Floats, centre: Floats) -> Floats:
        """Of points, float64[n, 3], from the centre: float64[n]."""
        return np.linalg.norm((points - centre) * self.extent, axis=1)

    def pull(self, points: Floats, centre: Floats) -> Floats:
        """How much of the centre's step each point takes part in, 0 to 1: float64[n]."""
        s = np.clip((self.distances(points, centre) - self.inner) / (self.outer - self.inner), 0, 1)
        return 1 - s * s * (3 - 2 * s)

    def box(self, centre: Floats) -> Floats:
        """Low and high corner of all that it can pull at: float64[2, 3]."""
        reach = np.where(self.extent > 0, self.outer, _EVERYWHERE)
        return np.array([centre - reach, centre + reach])

    def moves(self, begin: float, end: float) -> int:
        """In how many moves a step is to be made, so that each strains the mesh by little."""
        length = np.linalg.norm(self.path(end) - self.path(begin))
        return max(1, int(np.ceil(length / (_LARGEST_MOVE * (self.outer - self.inner)))))


def hole_region(centre: Floats, radius: float, travel: float) -> Region:
    """A hole along the z axis, dragged in a slalom along the x axis."""

    def path(t: float) -> Floats:
        return centre + travel * np.array([t, 0.14 * np.sin(2 * np.pi * t), 0])

    return Region(1.1 * radius, 2.3 * radius, np.array([1.0, 1.0, 0.0]), path)


def ball_region(points: Floats, start: Floats) -> Region | None:
    """A ball round `start` that is pulled away from the middle of the points and bends to the side.

    Returns None where there is nothing to pull: all points at one place.
    """
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    distances = np.linalg.norm(points - start, axis=1)
    count = min(_MOST_VERTICES, max(int(_LARGEST_PART * len(points)), 4), len(points) - 1)
    outer = float(np.partition(distances, count)[count]) if count > 0 else 0.0
    if outer <= 0:
        return None
    out, aside = _directions(points, start - middle)

    def path(t: float) -> Floats:
        return start + 1.2 * outer * (t * out + 0.4 * t * t * aside)

    return Region(0.35 * outer, outer, np.ones(3), path)


def _directions(points: Floats, outward: Floats) -> tuple[Floats, Floats]:
    """Unit vectors: outward, and across it within the plane or space that the points span."""
    some = points[:: max(len(points) // 1000, 1)] - points.mean(axis=0)
    spread, axes = np.linalg.svd(some, full_matrices=False)[1:]
    spanned = axes[spread > 1e-6 * spread[0]]
    out = outward / np.linalg.norm(outward) if np.linalg.norm(outward) > 0 else spanned[0]
    across = [axis - (axis @ out) * out for axis in spanned]
    aside = max(across, key=np.linalg.norm)
    length = np.linalg.norm(aside)
    return out, aside / length if length > 1e-6 else np.zeros(3)
