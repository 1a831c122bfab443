"""The two order-free hashes by which a copy proves that it equals its session.

Each is the sum modulo 2^64 of one term for each live entity, so a change subtracts old terms and adds new
ones (core/mesh/checksum.h is the definition). The functions here return partial sums over many entities;
those of the native module are faster and equal.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .arrays import Ids, Points
from .kinds import NUM_VERTICES, ElementType

try:
    from . import _native
except ImportError:  # installed without the native module
    _native = None

MASK = (1 << 64) - 1


class Checksum(NamedTuple):
    """Hashes of one state: equal states have equal checksums, whatever the order of edits that led there."""

    topology: int
    geometry: int

    def __str__(self) -> str:
        return f"{self.topology:016x}-{self.geometry:016x}"


def vertex_sum(slots: Ids) -> int:
    """Topology terms of live vertices.

    Parameters
    ----------
    slots : uint32[n]
    """
    return _sum(_mix(slots.astype(np.uint64)))


def position_sum(slots: Ids, positions: Points) -> int:
    """Geometry terms of live vertices.

    Parameters
    ----------
    slots : uint32[n]
    positions : float64[n, 3]
    """
    if _native is not None:
        return int(_native.position_sum(slots, positions))
    return position_sum_numpy(slots, positions)


def element_sum(types: NDArray[np.uint8], slots: Ids, rows: Ids) -> int:
    """Topology terms of elements.

    Parameters
    ----------
    types : uint8[n]
        Values of `ElementType`.
    slots : uint32[n]
    rows : uint32[n, k]
        Vertices of each element; columns beyond those of its type are ignored.
    """
    if _native is not None:
        return int(_native.element_sum(types, slots, rows))
    return element_sum_numpy(types, slots, rows)


def position_sum_numpy(slots: Ids, positions: Points) -> int:
    """As `position_sum`, in numpy alone."""
    bits = np.ascontiguousarray(positions, dtype=np.float64).view(np.uint64).reshape(-1, 3)
    hashes = _mix(slots.astype(np.uint64))
    for axis in range(3):
        hashes = _mix(hashes ^ bits[:, axis])
    return _sum(hashes)


def element_sum_numpy(types: NDArray[np.uint8], slots: Ids, rows: Ids) -> int:
    """As `element_sum`, in numpy alone."""
    total = 0
    for value in np.flatnonzero(np.bincount(types, minlength=1)):
        of_type = types == value
        total += _sum(_element_terms(ElementType(int(value)), slots[of_type], rows[of_type]))
    return total & MASK


def _element_terms(element_type: ElementType, slots: Ids, rows: Ids) -> NDArray[np.uint64]:
    head = element_type.kind.dimension << 40 | element_type.value << 32
    hashes = _mix(slots.astype(np.uint64) | np.uint64(head))
    for column in range(NUM_VERTICES[element_type]):
        hashes = _mix(hashes ^ rows[:, column].astype(np.uint64))
    return hashes


def _mix(z: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """The finaliser of SplitMix64."""
    z = z + np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


def _sum(hashes: NDArray[Any]) -> int:
    return int(np.add.reduce(hashes, dtype=np.uint64))
