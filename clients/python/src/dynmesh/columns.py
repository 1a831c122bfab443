"""Attribute columns: named values for the entities of one kind, float64 or int32.

Nothing is rounded or truncated on the way in: what cannot be kept exactly is refused by name.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import InvalidArgumentError
from .kinds import EntityKind
from .v1 import types_pb2

# Name under which exports hold ids; not an attribute, so imports leave it out.
SLOT_COLUMN = "dynmesh:slot"

_MAX_COMPONENTS = 16
_NOT_IN_NAMES = re.compile(r"[^A-Za-z0-9_.-]")
_WIRE_TYPES = {
    np.dtype(np.float64): (types_pb2.ATTRIBUTE_TYPE_FLOAT64, "<f8"),
    np.dtype(np.int32): (types_pb2.ATTRIBUTE_TYPE_INT32, "<i4"),
}
_DTYPES = {number: wire for number, wire in _WIRE_TYPES.values()}


@dataclass(frozen=True)
class Column:
    """Values of all entities of `kind`, in order: float64 or int32 [n, components]."""

    name: str
    kind: EntityKind
    values: NDArray[Any]

    def spec(self) -> types_pb2.AttributeSpec:
        """The column's description for the wire."""
        return make_spec(self.name, self.kind, self.values.dtype, self.values.shape[1])


def make_spec(name: str, kind: EntityKind, dtype: Any, components: int) -> types_pb2.AttributeSpec:
    """AttributeSpec of a column. Raises `InvalidArgumentError` unless `dtype` is float64 or int32."""
    wire = _WIRE_TYPES.get(np.dtype(dtype))
    if wire is None:
        raise _unfit(name, f"is {np.dtype(dtype)}; columns are float64 or int32")
    return types_pb2.AttributeSpec(name=name, kind=int(kind), type=wire[0], components=components)


def values_bytes(values: NDArray[Any]) -> bytes:
    """Rows as the wire has them. `values` must come from `as_values`."""
    return values.astype(_WIRE_TYPES[values.dtype][1], copy=False).tobytes()


def values_from_proto(message: types_pb2.AttributeValues) -> NDArray[Any]:
    """Rows of an AttributeValues as [n, components]."""
    flat = np.frombuffer(message.values, dtype=_DTYPES[message.spec.type])
    return flat.reshape(-1, message.spec.components or 1)


def as_values(values: ArrayLike, name: str) -> NDArray[Any]:
    """`values` as float64 or int32 [n, components], exactly.

    float16 and float32 become float64; booleans and integers become int32 if every value fits.
    Raises `InvalidArgumentError` otherwise, and for more than 16 components.
    """
    array = np.asarray(values)
    rows = array.reshape(-1, 1) if array.ndim == 1 else array
    if rows.ndim != 2 or not 1 <= rows.shape[1] <= _MAX_COMPONENTS:
        raise _unfit(name, f"has shape {array.shape}; columns have shape (n,) or (n, 1 to {_MAX_COMPONENTS})")
    if rows.dtype.kind == "f" and rows.dtype.itemsize <= 8:
        return rows.astype(np.float64, copy=False)
    if rows.dtype.kind in "biu":
        return _as_int32(rows, name)
    raise _unfit(name, f"is {rows.dtype}; columns are float64 or int32")


def point_columns(data: dict[str, ArrayLike], wanted: Collection[str] | None) -> list[Column]:
    """A mesh's point_data as columns; `wanted`: names of those to take, None for all."""
    names = _names(data, wanted)
    return [Column(names[key], EntityKind.VERTEX, as_values(data[key], key)) for key in names]


def cell_columns(
    data: dict[str, Sequence[ArrayLike]], kinds: Sequence[EntityKind | None], wanted: Collection[str] | None
) -> list[Column]:
    """A mesh's cell_data as columns, one for each kind of element that the mesh has.

    `kinds[i]` is that of block i; None for a block that is left out.
    """
    columns = []
    for key, name in _names(data, wanted).items():
        for kind in sorted({kind for kind in kinds if kind is not None}):
            blocks = [as_values(v, key) for v, k in zip(data[key], kinds, strict=True) if k == kind]
            columns.append(Column(name, kind, _join(blocks, key)))
    return columns


def _names(data: Iterable[str], wanted: Collection[str] | None) -> dict[str, str]:
    """The columns to take, by the mesh's name: under which name."""
    names = {}
    for key in data:
        if key == SLOT_COLUMN or (wanted is not None and key not in wanted):
            continue
        names[key] = _NOT_IN_NAMES.sub("_", key)
        if names[key] != key:
            warnings.warn(f"column {key!r} becomes attribute {names[key]!r}", stacklevel=2)
    if len(set(names.values())) < len(names):
        raise InvalidArgumentError(f"columns {sorted(names)} share a name", reason="ATTRIBUTE_EXISTS")
    return names


def _join(blocks: list[NDArray[Any]], name: str) -> NDArray[Any]:
    """Blocks one below the other; int32 next to float64 becomes float64, which holds every int32."""
    if len({block.shape[1] for block in blocks}) > 1:
        raise _unfit(name, "has different numbers of components from block to block")
    return np.concatenate(blocks)


def _as_int32(rows: NDArray[Any], name: str) -> NDArray[np.int32]:
    limits = np.iinfo(np.int32)
    if rows.size and not (limits.min <= rows.min() and rows.max() <= limits.max):
        raise _unfit(name, f"is {rows.dtype} with values that int32 cannot hold")
    return rows.astype(np.int32, copy=False)


def _unfit(name: str, what: str) -> InvalidArgumentError:
    return InvalidArgumentError(
        f"column {name!r} {what}: convert it, or leave it out by naming the others in `attributes`",
        reason="BAD_ARGUMENT",
        metadata={"attribute": name},
    )
