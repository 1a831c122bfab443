"""What a mesh is, before it is dragged and after."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from dynmesh import ElementType, EntityKind, Snapshot

from .elements import FLIPPED, Floats, Ints, is_cell, qualities, sizes

_AT_ONCE = 1 << 16


@dataclass(frozen=True)
class Survey:
    """Figures of all elements of the highest dimension that a session holds.

    Attributes
    ----------
    kind : EntityKind or None
        CELL, or FACE where there are no cells; None where there are neither.
    flipped : frozenset of ElementType
        Types that the mesh has in negative order.
    num_elements, num_inverted : int
        All, and those that are inverted or flat.
    size : float
        Volume, or area of a surface.
    vertex_ids : int64[n]
    points : float64[n, 3]
    pinned : int64[p]
        Ids of vertices that elements of lower dimension hang on.
    """

    kind: EntityKind | None
    flipped: frozenset[ElementType]
    num_elements: int
    num_inverted: int
    size: float
    vertex_ids: Ints
    points: Floats
    pinned: Ints


def survey(snapshot: Snapshot, flipped: frozenset[ElementType] | None = None) -> Survey:
    """Measures a snapshot. `flipped`: as found by an earlier survey; default: by the sign of each type's volume."""
    kind = next((k for k in (EntityKind.CELL, EntityKind.FACE) if snapshot.blocks_of(k)), None)
    positions = np.zeros((int(snapshot.vertex_ids.max(initial=0)) + 1, 3))
    positions[snapshot.vertex_ids] = snapshot.positions
    turned, num_elements, num_inverted, size = set(), 0, 0, 0.0
    for block in snapshot.blocks_of(kind) if kind else ():
        block_size, inverted = _measured(block.type, positions, block.vertices)
        if block.type in flipped if flipped is not None else block_size < 0:
            turned.add(block.type)
            block_size, inverted = _measured(block.type, positions, block.vertices[:, FLIPPED[block.type]])
        num_elements += len(block.ids)
        num_inverted += inverted
        size += block_size
    return Survey(kind, frozenset(turned), num_elements, num_inverted, size,
                  snapshot.vertex_ids.astype(np.int64), snapshot.positions, _pinned(snapshot, kind))  # fmt: skip


def _measured(of_type: ElementType, positions: Floats, corners: Ints) -> tuple[float, int]:
    """Size of all elements, and how many are not positive."""
    size, inverted = 0.0, 0
    for begin in range(0, len(corners), _AT_ONCE):
        part = positions[corners[begin : begin + _AT_ONCE]]
        size += float(sizes(of_type, part).sum())
        inverted += int((qualities(of_type, part) <= 0).sum()) if is_cell(of_type) else 0
    return size, inverted


def _pinned(snapshot: Snapshot, kind: EntityKind | None) -> Ints:
    lower = [block for block in snapshot.blocks if kind is None or block.type.kind < kind]
    parts = [block.vertices.ravel() for block in lower]
    return np.unique(np.concatenate(parts)).astype(np.int64) if parts else np.zeros(0, dtype=np.int64)
