"""Decoding of deltas whose sections are all raw, in numpy alone: for installations without the native module.

core/codec/FORMAT.md describes the bytes. The seal (XXH64) is compared where the package xxhash is installed;
without it damage shows when the mirror compares its checksum.
"""

from __future__ import annotations

import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .arrays import Ids, Points
from .attribute_types import POLICIES, SCALARS, row_from_bytes
from .errors import DataLossError, UnimplementedError
from .kinds import NUM_VERTICES, ElementType

_HEADER = struct.Struct("<4sBBBBqqQQ")
_GRID = struct.Struct("<dddd")
_SEAL_BYTES = 8
_VERSIONS = (1, 2)
_RAW = 1
_PADDING, _REMOVED_VERTICES, _VERTICES, _POSITIONS, _GRID_X, _COLUMNS = 0, 1, 2, 3, 4, 64
_POLICY_OF_KIND = {"f": 1, "i": 2}  # of version 1, which names none
_MAX_SLOT = 2**32 - 2


def decode_raw(payload: bytes) -> dict[str, Any]:
    """The delta in `payload`, in the form of ``dynmesh._native.decode``.

    Raises
    ------
    DataLossError
        CORRUPT_PAYLOAD.
    UnimplementedError
        UNSUPPORTED_FORMAT: a newer version. NO_NATIVE_MODULE: sections that are packed.
    """
    try:
        return _decode(memoryview(payload))
    except (struct.error, IndexError, ValueError, KeyError, UnicodeDecodeError) as error:
        raise _corrupt(str(error)) from None


def _decode(payload: memoryview) -> dict[str, Any]:
    magic, version, flags, bits, _, from_revision, to_revision, *checksum = _HEADER.unpack_from(payload)
    if magic != b"DYNM":
        raise _corrupt("it does not begin like a delta")
    if version not in _VERSIONS:
        raise UnimplementedError(f"deltas of version {version} are too new", reason="UNSUPPORTED_FORMAT")
    _check_seal(payload)
    at = _HEADER.size
    grid = _GRID.unpack_from(payload, at) if bits else None
    sections = _sections(payload[:-_SEAL_BYTES], at + (_GRID.size if bits else 0))
    vertex_slots = _slots(sections, _VERTICES)
    return {
        "from_revision": from_revision,
        "to_revision": to_revision,
        "consistent": bool(flags & 1),
        "removed_vertices": _slots(sections, _REMOVED_VERTICES),
        "vertex_slots": vertex_slots,
        "positions": _positions(sections, vertex_slots.size, grid),
        "elements": [_elements(sections, dimension) for dimension in (1, 2, 3)],
        "attributes": _attributes(sections, version),
        "checksum": tuple(checksum),
        "position_bits": bits,
    }


def _check_seal(payload: memoryview) -> None:
    try:
        import xxhash
    except ImportError:
        return
    (seal,) = struct.unpack("<Q", payload[-_SEAL_BYTES:])
    if xxhash.xxh64_intdigest(payload[:-_SEAL_BYTES]) != seal:
        raise _corrupt("its seal is broken")


def _sections(payload: memoryview, at: int) -> dict[int, memoryview]:
    """Payloads by id."""
    count, at = _varint(payload, at)
    entries = []
    for _ in range(count):
        section, at = _varint(payload, at)
        packing = payload[at]
        _, at = _varint(payload, at + 1)
        size, at = _varint(payload, at)
        entries.append((section, packing, size))
    sections = {}
    for section, packing, size in entries:
        if packing != _RAW:
            raise UnimplementedError(
                "packed sections need dynmesh's native module", reason="NO_NATIVE_MODULE"
            )
        if at + size > len(payload):
            raise _corrupt("a section runs past the end")
        sections[section] = payload[at : at + size]
        at += size
    return sections


def _symbols(sections: dict[int, memoryview], section: int) -> Ids:
    return np.frombuffer(sections.get(section, b""), dtype="<u4").astype(np.uint32, copy=False)


def _slots(sections: dict[int, memoryview], section: int) -> Ids:
    """Ascending slots from their gaps."""
    slots = np.cumsum(_symbols(sections, section).astype(np.uint64) + np.uint64(1)) - np.uint64(1)
    if slots.size and int(slots[-1]) > _MAX_SLOT:
        raise _corrupt("slots run past the last")
    return slots.astype(np.uint32)


def _positions(sections: dict[int, memoryview], count: int, grid: tuple[float, ...] | None) -> Points:
    if grid is None:
        positions = np.frombuffer(sections.get(_POSITIONS, b""), dtype="<f8").reshape(-1, 3)
    else:
        axes = [_undo_differences(_symbols(sections, _GRID_X + axis)) for axis in range(3)]
        positions = np.stack(axes, axis=1) * grid[3] + np.array(grid[:3])
    if len(positions) != count or not np.isfinite(positions).all():
        raise _corrupt("positions are not one finite point for each slot")
    return positions


def _undo_differences(symbols: Ids) -> NDArray[np.float64]:
    differences = (symbols >> 1) ^ (np.uint32(0) - (symbols & 1))
    return np.cumsum(differences, dtype=np.uint32).astype(np.float64)


def _elements(sections: dict[int, memoryview], dimension: int) -> tuple[Ids, Ids, NDArray[np.uint8], Ids]:
    base = 16 * dimension
    if base + 3 in sections or base + 4 in sections:
        raise UnimplementedError("packed corners need dynmesh's native module", reason="NO_NATIVE_MODULE")
    slots, runs = _slots(sections, base + 1), _symbols(sections, base + 2)
    lengths = (runs >> 3).astype(np.int64) + 1
    if int(lengths.sum()) != slots.size:
        raise _corrupt("types are not one for each element")
    types = np.repeat((runs & 7).astype(np.uint8), lengths)
    if any(ElementType(int(value)).kind.dimension != dimension for value in np.unique(types)):
        raise _corrupt("types are not all of their dimension")
    vertices = _symbols(sections, base + 6)
    if int(NUM_VERTICES[types].sum()) != vertices.size:
        raise _corrupt("corners are not as many as the types ask for")
    return _slots(sections, base), slots, types, vertices


def _attributes(
    sections: dict[int, memoryview], version: int
) -> list[tuple[str, int, Ids, NDArray[Any], NDArray[Any], int]]:
    columns = []
    base = _COLUMNS
    while base in sections:
        name, dimension, scalar, default, policy = _description(bytes(sections[base]), version)
        values = np.frombuffer(sections.get(base + 2, b""), dtype=SCALARS[scalar]).reshape(-1, default.size)
        slots = _slots(sections, base + 1)
        if len(values) != slots.size:
            raise _corrupt("rows are not one for each slot")
        if not (np.isfinite(values).all() and np.isfinite(default).all()):
            raise _corrupt("rows are not all finite")
        columns.append((name, dimension, slots, values, default, policy))
        base += 4
    return columns


def _description(description: bytes, version: int) -> tuple[str, int, int, NDArray[Any], int]:
    """Name, dimension, number of the type, default row and number of the policy of a column."""
    dimension, scalar, components = description[:3]
    if version == 1:
        default = row_from_bytes(b"", scalar, components)
        return description[3:].decode(), dimension, scalar, default, _POLICY_OF_KIND[default.dtype.kind]
    policy, name_bytes = description[3:5]
    end = 5 + name_bytes
    if policy not in POLICIES or end > len(description):
        raise _corrupt("a column's description is not valid")
    default = row_from_bytes(description[end:], scalar, components)
    return description[5:end].decode(), dimension, scalar, default, policy


def _varint(payload: memoryview, at: int) -> tuple[int, int]:
    value = shift = 0
    while True:
        byte = payload[at]
        value |= (byte & 0x7F) << shift
        shift += 7
        at += 1
        if byte < 0x80:
            return value, at


def _corrupt(what: str) -> DataLossError:
    return DataLossError(f"the delta is damaged: {what}", reason="CORRUPT_PAYLOAD")
