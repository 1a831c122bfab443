"""The neighbourhood that moves in one step, as the service describes it, and the batch that changes it."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from dynmesh import ElementType, EntityKind, Session
from dynmesh.edit import EditBatch
from numpy.typing import NDArray

from .elements import FLIPPED, Floats, Ints, is_cell, own_normals, qualities, sizes


@dataclass(frozen=True)
class Block:
    """Elements of one type: ids int64[n], and corners int64[n, k], local and in positive order."""

    of_type: ElementType
    ids: Ints
    corners: Ints

    def qualities(self, points: Floats, before: Floats) -> Floats:
        """`elements.qualities` at `points`; faces are held against the normals that they had at `before`."""
        normals = None if is_cell(self.of_type) else own_normals(before[self.corners])
        return qualities(self.of_type, points[self.corners], normals)


@dataclass(frozen=True)
class Patch:
    """Vertices that are about to move, all elements round them, and the vertices of those.

    Vertices are numbered locally: i stands for the vertex `vertices[i]`.

    Attributes
    ----------
    revision : int
        Of the session that all of this was read at.
    vertices : int64[m]
        Ascending.
    points : float64[m, 3]
    moving : bool[m]
        Exactly those vertices all of whose elements are in the patch.
    blocks : tuple of Block
    """

    revision: int
    vertices: Ints
    points: Floats
    moving: NDArray[np.bool_]
    blocks: tuple[Block, ...]


@dataclass
class Change:
    """What a step does to a patch. Vertices from `len(patch.vertices)` on are new ones.

    Attributes
    ----------
    points : float64[m + new, 3]
    removed : int64[r]
        Ids of elements.
    added : list of (ElementType, int64[a, k])
        Local corners in positive order.
    lost : int64[l]
        Local vertices that have no elements any more.
    repairs : int
        Cavities and single elements that were filled anew.
    """

    points: Floats
    removed: Ints = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    added: list[tuple[ElementType, Ints]] = field(default_factory=list)
    lost: Ints = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    repairs: int = 0


@dataclass(frozen=True)
class Sent:
    """How many items a batch had, and which vertices came and went."""

    moved: int
    removed: int
    added: int
    new_handles: NDArray[np.int64]
    lost_vertices: Ints


def read_patch(session: Session, kind: EntityKind, moving: Ints, revision: int) -> Patch:
    """Asks the service for the elements of `kind` round the vertices `moving`, int64[n]."""
    star = session.neighbors("vertex", kind, moving, as_of_revision=revision)
    found = session.entities(kind, np.unique(star.neighbors), as_of_revision=revision)
    vertices = np.union1d(found.vertices, moving).astype(np.int64)
    points = session.positions(vertices, as_of_revision=revision)
    corners = np.searchsorted(vertices, found.vertices)
    blocks = []
    for value in np.unique(found.types[found.is_element]):
        of_type = ElementType(int(value))
        rows = np.flatnonzero((found.types == value) & found.is_element)
        local = corners[found.vertex_offsets[rows][:, None] + np.arange(of_type.num_vertices)]
        negative = sizes(of_type, points[local]) < 0  # then it is the order of its vertices that is
        local[negative] = local[negative][:, FLIPPED[of_type]]
        blocks.append(Block(of_type, found.ids[rows].astype(np.int64), local))
    return Patch(revision, vertices, points, np.isin(vertices, moving), tuple(blocks))


def fill_batch(
    batch: EditBatch, patch: Patch, change: Change, kind: EntityKind, flipped: frozenset[ElementType]
) -> Sent:
    """Adds a change to a batch of edits: moves, removals, additions.

    New elements of the types `flipped` are written in negative order.
    """
    old = len(patch.vertices)
    moved = np.flatnonzero((change.points[:old] != patch.points).any(axis=1))
    moved = np.setdiff1d(moved, change.lost)
    lost = patch.vertices[change.lost[change.lost < old]]
    batch.move_vertices(patch.vertices[moved], change.points[moved])
    batch.remove_elements(kind, change.removed)
    batch.remove_vertices(lost)
    new = np.setdiff1d(np.arange(old, len(change.points)), change.lost)
    handles = batch.add_vertices(change.points[new])
    names = np.zeros(len(change.points), dtype=np.int64)
    names[:old] = patch.vertices
    names[new] = handles
    for of_type, corners in change.added:
        order = FLIPPED[of_type] if of_type in flipped else range(of_type.num_vertices)
        batch.add_elements(of_type, names[corners[:, list(order)]])
    num_added = sum(len(corners) for _, corners in change.added)
    return Sent(len(moved), len(change.removed) + len(lost), num_added + len(new), handles, lost)
