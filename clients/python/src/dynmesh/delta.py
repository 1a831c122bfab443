"""A delta: the difference between two revisions as after-images, and its decoding."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .arrays import Ids, Points
from .attribute_types import POLICIES, Policy
from .checksum import Checksum
from .errors import make_error
from .kinds import NUM_VERTICES, ElementType, EntityKind
from .raw_delta import decode_raw

try:
    from . import _native
except ImportError:  # installed without the native module
    _native = None

HAS_NATIVE = _native is not None


@dataclass(frozen=True)
class ElementChanges:
    """Elements of one kind that a delta writes or removes; slots ascend strictly."""

    removed: Ids
    slots: Ids
    types: NDArray[np.uint8]
    vertices: Ids  # concatenated, as many for each element as its type has

    def rows(self, width: int) -> Ids:
        """`vertices` as uint32[n, width], padded with zeros."""
        return element_rows(self.types, self.vertices, width)

    @property
    def width(self) -> int:
        """Vertices of the largest element written; 0 if there is none."""
        return int(NUM_VERTICES[self.types.max()]) if self.types.size else 0


@dataclass(frozen=True)
class AttributeChanges:
    """Rows of one attribute that a delta writes."""

    name: str
    kind: EntityKind
    slots: Ids
    values: NDArray[Any]  # [n, components] of the column's type
    default: NDArray[Any]  # [components]: the row of slots that no delta has written
    policy: Policy


@dataclass(frozen=True)
class Delta:
    """The change from `from_revision` to `to_revision`; applying it twice is harmless.

    Attributes
    ----------
    consistent : bool
        False: a chunk of a longer answer; the copy is exact again after the next consistent delta.
    removed_vertices : uint32[r]
    vertex_slots : uint32[n]
        New or moved.
    positions : float64[n, 3]
    elements : dict of EntityKind to ElementChanges
        For EDGE, FACE and CELL: wire edges, dangling faces, cells.
    attributes : tuple of AttributeChanges
    checksum : Checksum
        Of the session at `to_revision`; meaningful when `consistent`.
    position_bits : int
        0: positions are lossless; else bits for each axis of the grid that they lie on.
    """

    from_revision: int
    to_revision: int
    consistent: bool
    removed_vertices: Ids
    vertex_slots: Ids
    positions: Points
    elements: dict[EntityKind, ElementChanges]
    attributes: tuple[AttributeChanges, ...]
    checksum: Checksum
    position_bits: int = 0

    @property
    def num_written(self) -> int:
        """Elements written, of all kinds."""
        return sum(changes.slots.size for changes in self.elements.values())

    @property
    def num_removed(self) -> int:
        """Elements removed, of all kinds."""
        return sum(changes.removed.size for changes in self.elements.values())


def decode_delta(payload: bytes) -> Delta:
    """The delta that `payload` (core/codec/FORMAT.md) holds. Its arrays may be read-only.

    Raises
    ------
    DataLossError
        Damaged or hostile bytes (CORRUPT_PAYLOAD).
    UnimplementedError
        A newer format (UNSUPPORTED_FORMAT), or packed sections without the native module (NO_NATIVE_MODULE).
    """
    if _native is None:
        return _delta(decode_raw(payload))
    try:
        return _delta(_native.decode(payload))
    except _native.DecodeError as error:
        code, message, reason, metadata = error.args
        raise make_error(code, message, reason, dict(metadata)) from None


def _delta(parts: dict[str, Any]) -> Delta:
    return Delta(
        from_revision=parts["from_revision"],
        to_revision=parts["to_revision"],
        consistent=parts["consistent"],
        removed_vertices=parts["removed_vertices"],
        vertex_slots=parts["vertex_slots"],
        positions=parts["positions"],
        elements={EntityKind(2 + i): ElementChanges(*lists) for i, lists in enumerate(parts["elements"])},
        attributes=tuple(_attribute(*column) for column in parts["attributes"]),
        checksum=Checksum(*parts["checksum"]),
        position_bits=parts["position_bits"],
    )


def _attribute(
    name: str, dimension: int, slots: Ids, values: NDArray[Any], default: NDArray[Any], policy: int
) -> AttributeChanges:
    return AttributeChanges(name, EntityKind(dimension + 1), slots, values, default, POLICIES[policy])


def element_rows(types: NDArray[np.uint8], vertices: Ids, width: int) -> Ids:
    """Concatenated vertices as uint32[n, width], padded with zeros.

    Parameters
    ----------
    types : uint8[n]
        Values of `ElementType`.
    vertices : uint32[sum of vertices of all types]
    width : int
        At least that of the widest type.
    """
    rows = np.zeros((types.size, width), dtype=np.uint32)
    sizes = NUM_VERTICES[types]
    starts = np.cumsum(sizes) - sizes
    for value in np.flatnonzero(np.bincount(types, minlength=1)):
        size = ElementType(int(value)).num_vertices
        index = np.flatnonzero(types == value)
        rows[index, :size] = vertices[starts[index, None] + np.arange(size)]
    return rows
