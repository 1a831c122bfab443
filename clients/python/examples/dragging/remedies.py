"""Which operators might better the poor elements of a patch. Which those are, the service says."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import combinations, permutations

import numpy as np
from dynmesh import CheckResult, ElementType, EntityKind, Session

from .elements import Floats, Ints
from .patch import Block, Patch
from .survey import ANGLE_CHECKS

# Triangles and tetrahedra of a quality below one of these are swapped away, if all that takes their place is
# above it. A tetrahedron above the second has no angle below 11 degrees.
LEVELS = (0.3, 0.42, 0.5)

# Other elements below the first are cut up, if all parts are above the second.
_CUT_BELOW, CUT_ABOVE = 0.45, 0.1

_MOST_POOR, _MOST_SHARP = 1000, 100  # worked on at a time, the worst first
_MOST_FINDINGS = 1_000_000

_SIMPLICES = (ElementType.TRIANGLE, ElementType.TETRAHEDRON)


@dataclass(frozen=True)
class Swaps:
    """Edges by their ends, int64[n, 2], and faces, int64[m], of elements whose quality is below a level."""

    level: float
    edges: Ints
    faces: Ints


@dataclass(frozen=True)
class Remedies:
    """Operators to ask for.

    Attributes
    ----------
    swaps : tuple of Swaps
        Of triangles and tetrahedra.
    collapses : int64[n, 2]
        Edges of those with a sharp angle; the first end goes.
    splits : int64[m, 2]
        Edges of pyramids: to split one of the base makes tetrahedra of the cells on both sides.
    cuts : int64[c]
        Hexahedra, prisms and quads.
    smoothed : int64[v]
        Vertices of poor elements.
    """

    swaps: tuple[Swaps, ...]
    collapses: Ints
    splits: Ints
    cuts: Ints
    smoothed: Ints


@dataclass(frozen=True)
class _Poor:
    """Poor elements of one type: ids, qualities, and corners; and the corners of sharp ones."""

    of_type: ElementType
    ids: Ints
    quality: Floats
    corners: Ints
    sharp: Ints


def find_remedies(session: Session, kind: EntityKind, patch: Patch, sharp_deg: float) -> Remedies:
    """Asks which elements of a patch are poor, and which have angles below `sharp_deg`, in degrees."""
    poor = [_poor(session, kind, patch, block, sharp_deg) for block in patch.blocks]
    simplices = [part for part in poor if part.of_type in _SIMPLICES]
    pyramids = [part for part in poor if part.of_type == ElementType.PYRAMID]
    others = [part for part in poor if part.of_type not in (*_SIMPLICES, ElementType.PYRAMID)]
    corners = _joined([part.corners.ravel() for part in poor])
    return Remedies(
        swaps=tuple(_swaps(session, kind, patch, simplices, level) for level in LEVELS),
        collapses=patch.vertices[_collapses(patch, simplices)],
        splits=patch.vertices[_longest_of_bases(patch, pyramids)],
        cuts=_joined([part.ids[part.quality < _CUT_BELOW] for part in others]),
        smoothed=patch.vertices[np.unique(corners[patch.can_slide[corners]])],
    )


def _poor(session: Session, kind: EntityKind, patch: Patch, block: Block, sharp_deg: float) -> _Poor:
    angle = ANGLE_CHECKS[kind]
    report = session.check(
        {"quality": ("warn", LEVELS[-1]), angle: ("warn", sharp_deg)},
        kind=kind,
        ids=block.ids,
        max_findings=_MOST_FINDINGS,
        as_of_revision=patch.revision,
        progress=False,
    )
    ids, quality = _worst(report["quality"], _MOST_POOR)
    sharp, _ = _worst(report[angle], _MOST_SHARP)
    corners = block.corners_of(ids)
    ours = patch.is_spoilt[corners].sum(axis=1) < 2  # so that none of their edges is one of a spoilt element
    return _Poor(
        of_type=block.of_type,
        ids=ids[ours],
        quality=quality[ours],
        corners=corners[ours],
        sharp=block.corners_of(sharp),
    )


def _worst(found: CheckResult, most: int) -> tuple[Ints, Floats]:
    """Ids and values of the lowest."""
    order = np.argsort(found.values, kind="stable")[:most]
    return found.ids[order].astype(np.int64), found.values[order]


def _swaps(session: Session, kind: EntityKind, patch: Patch, simplices: list[_Poor], level: float) -> Swaps:
    edges = _pairs([np.sort(part.corners[part.quality < level]) for part in simplices], combinations)
    if kind == EntityKind.FACE:
        edges = edges[patch.is_flat[edges].any(axis=1)]  # elsewhere a flip would change the form
        return Swaps(level, patch.vertices[edges], _joined([]))
    below = _joined([part.ids[part.quality < level] for part in simplices])
    faces = session.neighbors("cell", "face", below, as_of_revision=patch.revision).neighbors
    between, count = np.unique(faces, return_counts=True)
    return Swaps(level, patch.vertices[edges], between[count == 2])


def _collapses(patch: Patch, simplices: list[_Poor]) -> Ints:
    """Edges of sharp elements whose first end lies inside, so that the surface stays: int64[n, 2]."""
    pairs = _pairs([part.sharp for part in simplices], permutations)
    return pairs[(patch.can_slide & ~patch.on_surface)[pairs[:, 0]]]


def _pairs(parts: list[Ints], pick: Callable[[range, int], Iterable[tuple[int, int]]]) -> Ints:
    """Pairs of corners of elements, each once: int64[n, 2]."""
    pairs = [part[:, list(pick(range(part.shape[1]), 2))].reshape(-1, 2) for part in parts]
    return np.unique(np.concatenate([np.zeros((0, 2), dtype=np.int64), *pairs]), axis=0)


def _longest_of_bases(patch: Patch, pyramids: list[_Poor]) -> Ints:
    """The longest edge of the base of each pyramid, each once: int64[n, 2]."""
    bases = [part.corners[part.quality < _CUT_BELOW, :4] for part in pyramids]
    base = np.concatenate([np.zeros((0, 4), dtype=np.int64), *bases])
    ends = np.stack([base, np.roll(base, -1, axis=1)], axis=-1)
    lengths = np.linalg.norm(patch.points[ends[..., 1]] - patch.points[ends[..., 0]], axis=-1)
    longest = ends[np.arange(len(ends)), lengths.argmax(axis=1)]
    return np.unique(np.sort(longest), axis=0)


def _joined(parts: list[Ints]) -> Ints:
    return np.concatenate([np.zeros(0, dtype=np.int64), *parts])
