"""What a mesh is, before it is dragged and after."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from dynmesh import ElementType, EntityKind, Session

from .elements import FLIPPED, Floats, Ints, is_cell, qualities, sizes

# Checks that measure the smallest angles of elements, in degrees.
ANGLE_CHECKS = {EntityKind.CELL: "min_dihedral", EntityKind.FACE: "min_face_angle"}

_AT_ONCE = 1 << 16


@dataclass(frozen=True)
class Survey:
    """Figures of all elements of the highest dimension that a session holds.

    Attributes
    ----------
    kind : EntityKind or None
        CELL, or FACE where there are no cells; None where there are neither.
    flipped : frozenset of ElementType
        Types most of whose elements are in negative order (`elements`).
    num_elements, num_inverted : int
        All, and those that are flat, concave, or turned against most others of their type.
    size : float
        Volume, or area of a surface.
    vertex_ids : int64[n]
    points : float64[n, 3]
    worst_angle : float
        Degrees: the smallest between two faces of a cell, of surfaces inside of a face; infinity without any.
    """

    kind: EntityKind | None
    flipped: frozenset[ElementType]
    num_elements: int
    num_inverted: int
    size: float
    vertex_ids: Ints
    points: Floats
    worst_angle: float


def survey(session: Session, flipped: frozenset[ElementType] | None = None) -> Survey:
    """Measures a session. `flipped`: as an earlier survey found them; default: by majority."""
    snapshot = session.snapshot(progress=False)
    kind = next((k for k in (EntityKind.CELL, EntityKind.FACE) if snapshot.blocks_of(k)), None)
    positions = np.zeros((int(snapshot.vertex_ids.max(initial=0)) + 1, 3))
    positions[snapshot.vertex_ids] = snapshot.positions
    turned, num_elements, num_inverted, size = set(), 0, 0, 0.0
    for block in snapshot.blocks_of(kind) if kind else ():
        volumes = _in_parts(sizes, block.type, positions, block.vertices)
        corners = block.vertices
        if block.type in flipped if flipped is not None else (volumes < 0).sum() > len(volumes) / 2:
            turned.add(block.type)
            corners = corners[:, FLIPPED[block.type]]
        num_elements += len(corners)
        size += float(np.abs(volumes).sum())
        if is_cell(block.type):
            num_inverted += int((_in_parts(qualities, block.type, positions, corners) <= 0).sum())
    ids = snapshot.vertex_ids.astype(np.int64)
    worst = _worst_angle(session, kind)
    return Survey(kind, frozenset(turned), num_elements, num_inverted, size, ids, snapshot.positions, worst)


def _worst_angle(session: Session, kind: EntityKind | None) -> float:
    if kind is None:
        return math.inf
    name = ANGLE_CHECKS[kind]
    return session.check([name], max_findings=0, progress=False)[name].lowest


def _in_parts(
    measure: Callable[[ElementType, Floats], Floats], of_type: ElementType, positions: Floats, corners: Ints
) -> Floats:
    """`measure` of all elements, without copying all their corners at once."""
    parts = [corners[begin : begin + _AT_ONCE] for begin in range(0, len(corners), _AT_ONCE)]
    return np.concatenate([measure(of_type, positions[part]) for part in parts])
