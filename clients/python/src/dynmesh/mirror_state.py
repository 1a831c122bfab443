"""The data of a mirror: elements and vertices by slot in numpy arrays that grow, kept equal by deltas."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .arrays import Ids, Points
from .checksum import MASK, Checksum, element_sum, position_sum, vertex_sum
from .delta import AttributeChanges, Delta, ElementChanges
from .errors import MirrorError
from .kinds import ELEMENT_KINDS, ElementType, EntityKind
from .snapshot import Attribute, Block, Snapshot


class MirrorState:
    """A flat copy of a session. Derived faces and edges are not part of it.

    ``apply`` is vectorised and costs time in proportion to the delta.
    Thread safety: none of its own.

    Attributes
    ----------
    revision : int
        Of the last consistent delta.
    session_uid : str
        Of the session that `revision` is of (`SessionInfo.uid`); empty before the first delta.
    quantized : bool
        Whether positions lie on a grid: then only the topology can be verified.
    """

    def __init__(self) -> None:
        self.revision = 0
        self.session_uid = ""
        self.quantized = False
        self.vertices = VertexTable()
        self.elements = {kind: ElementTable() for kind in ELEMENT_KINDS}
        self.attributes: dict[tuple[EntityKind, str], AttributeTable] = {}

    def copy(self) -> MirrorState:
        """An independent copy."""
        return copy.deepcopy(self)

    @property
    def checksum(self) -> Checksum:
        """Of what is held now, kept up with each delta."""
        topology = self.vertices.topology + sum(table.topology for table in self.elements.values())
        return Checksum(topology & MASK, self.vertices.geometry & MASK)

    def apply(self, delta: Delta) -> None:
        """Applies a delta that starts at or before this state, and verifies the result if it is consistent.

        Raises
        ------
        MirrorError
            REVISION_MISMATCH: it starts later, nothing has changed. CHECKSUM_MISMATCH: it has been applied,
            and this copy differs from the session.
        """
        if delta.from_revision > self.revision:
            raise MirrorError(
                f"the delta starts at revision {delta.from_revision}, this copy is at {self.revision}",
                reason="REVISION_MISMATCH",
            )
        for kind, changes in delta.elements.items():
            self.elements[kind].apply(changes)
        self.vertices.apply(delta.removed_vertices, delta.vertex_slots, delta.positions)
        for rows in delta.attributes:
            self._apply_attribute(rows)
        for table in self.attributes.values():
            table.reach(self._size(table.kind))
        self.quantized = self.quantized or delta.position_bits > 0
        if delta.consistent:
            self._verify(delta)

    def snapshot(self) -> Snapshot:
        """A copy of everything live."""
        slots = self.vertices.live_slots()
        blocks = [block for kind in ELEMENT_KINDS for block in self.elements[kind].blocks()]
        attributes = [table.attribute() for table in self.attributes.values()]
        return Snapshot(
            self.revision, slots, self.vertices.positions[slots], tuple(blocks), tuple(attributes)
        )

    def _apply_attribute(self, changes: AttributeChanges) -> None:
        key = (changes.kind, changes.name)
        if key not in self.attributes:
            self.attributes[key] = AttributeTable(changes)
        self.attributes[key].apply(changes)

    def _size(self, kind: EntityKind) -> int:
        """Slots that were ever taken."""
        return self.vertices.size if kind == EntityKind.VERTEX else self.elements[kind].size

    def _verify(self, delta: Delta) -> None:
        self.revision = delta.to_revision
        mine, theirs = self.checksum, delta.checksum
        if mine.topology == theirs.topology and (self.quantized or mine.geometry == theirs.geometry):
            return
        raise MirrorError(
            f"the copy ({mine}) differs from the session ({theirs}) at revision {delta.to_revision}",
            reason="CHECKSUM_MISMATCH",
            metadata={"revision": str(delta.to_revision)},
        )


class VertexTable:
    """Vertices by slot.

    Attributes
    ----------
    live : bool[size]
    positions : float64[size, 3]
        Meaningless where not live.
    count : int
        Live vertices.
    topology, geometry : int
        Their terms in the checksum, modulo 2^64 after masking.
    """

    def __init__(self) -> None:
        self._live = np.zeros(0, dtype=bool)
        self._positions = np.zeros((0, 3))
        self.size = 0
        self.count = 0
        self.topology = 0
        self.geometry = 0

    @property
    def live(self) -> NDArray[np.bool_]:
        """bool[size]"""
        return self._live[: self.size]

    @property
    def positions(self) -> Points:
        """float64[size, 3]"""
        return self._positions[: self.size]

    def live_slots(self) -> Ids:
        """uint32[count], ascending."""
        return np.flatnonzero(self.live).astype(np.uint32)

    def apply(self, removed: Ids, slots: Ids, positions: Points) -> None:
        """Removes vertices, then writes positions (float64[n, 3]) at slots."""
        self._remove(removed)
        self._remove(slots)
        if not slots.size:
            return
        self.size = max(self.size, int(slots[-1]) + 1)
        self._live = _grown(self._live, self.size)
        self._positions = _grown(self._positions, self.size)
        self._live[slots] = True
        self._positions[slots] = positions
        self.count += slots.size
        self.topology += vertex_sum(slots)
        self.geometry += position_sum(slots, positions)

    def _remove(self, slots: Ids) -> None:
        known = slots[: np.searchsorted(slots, self.size)]
        known = known[self._live[known]]
        if not known.size:
            return
        self._live[known] = False
        self.count -= known.size
        self.topology -= vertex_sum(known)
        self.geometry -= position_sum(known, self._positions[known])


class ElementTable:
    """Elements of one kind by slot.

    Attributes
    ----------
    types : uint8[size]
        `ElementType`; 0 where no element stands.
    vertices : uint32[size, width]
        Columns beyond the vertices of the type are meaningless.
    count : int
        Elements.
    topology : int
        Their terms in the checksum, modulo 2^64 after masking.
    """

    def __init__(self) -> None:
        self._types = np.zeros(0, dtype=np.uint8)
        self._vertices = np.zeros((0, 0), dtype=np.uint32)
        self.size = 0
        self.count = 0
        self.topology = 0

    @property
    def types(self) -> NDArray[np.uint8]:
        """uint8[size]"""
        return self._types[: self.size]

    @property
    def vertices(self) -> Ids:
        """uint32[size, width]"""
        return self._vertices[: self.size]

    def apply(self, changes: ElementChanges) -> None:
        """Removes elements, then writes elements."""
        self._remove(changes.removed)
        self._remove(changes.slots)
        slots = changes.slots
        if not slots.size:
            return
        self.size = max(self.size, int(slots[-1]) + 1)
        self._types = _grown(self._types, self.size)
        self._vertices = _widened(_grown(self._vertices, self.size), changes.width)
        rows = changes.rows(self._vertices.shape[1])
        self._types[slots] = changes.types
        self._vertices[slots] = rows
        self.count += slots.size
        self.topology += element_sum(changes.types, slots, rows)

    def blocks(self) -> list[Block]:
        """A copy of the elements, one block for each type."""
        present = np.flatnonzero(np.bincount(self.types, minlength=1)[1:]) + 1
        return [self._block(ElementType(int(value))) for value in present]

    def _block(self, element_type: ElementType) -> Block:
        slots = np.flatnonzero(self.types == element_type)
        rows = self.vertices[slots, : element_type.num_vertices]
        return Block(element_type, slots.astype(np.uint32), rows)

    def _remove(self, slots: Ids) -> None:
        known = slots[: np.searchsorted(slots, self.size)]
        known = known[self._types[known] != 0]
        if not known.size:
            return
        self.count -= known.size
        self.topology -= element_sum(self._types[known], known, self._vertices[known])
        self._types[known] = 0


class AttributeTable:
    """Rows of one attribute by slot; the default where none was ever written."""

    def __init__(self, first: AttributeChanges) -> None:
        self.name = first.name
        self.kind = first.kind
        self.default = first.default
        self._values = np.zeros((0, first.values.shape[1]), dtype=first.values.dtype)
        self.size = 0

    @property
    def values(self) -> NDArray[Any]:
        """[size, components] of the column's type"""
        return self._values[: self.size]

    def apply(self, changes: AttributeChanges) -> None:
        """Writes rows at slots."""
        if not changes.slots.size:
            return
        self.reach(int(changes.slots[-1]) + 1)
        self._values[changes.slots] = changes.values

    def reach(self, size: int) -> None:
        """Has at least so many rows: new ones are the default."""
        self.size = max(self.size, size)
        self._values = _grown(self._values, self.size, self.default)

    def attribute(self) -> Attribute:
        """A copy of the rows that are not the default, for a snapshot."""
        slots = np.flatnonzero((self.values != self.default).any(axis=1))
        return Attribute(self.name, self.kind, slots.astype(np.uint32), self.values[slots], self.default)


def _grown(array: NDArray[Any], size: int, fill: NDArray[Any] | int = 0) -> NDArray[Any]:
    """`array` with room for `size` rows, new ones like `fill`: at least doubled when it has to grow, so that
    growing is rare."""
    if size <= len(array):
        return array
    grown = np.zeros((max(size, 2 * len(array)), *array.shape[1:]), dtype=array.dtype)
    grown[: len(array)] = array
    if np.any(fill):
        grown[len(array) :] = fill
    return grown


def _widened(rows: Ids, width: int) -> Ids:
    if width <= rows.shape[1]:
        return rows
    wide = np.zeros((len(rows), width), dtype=rows.dtype)
    wide[:, : rows.shape[1]] = rows
    return wide
