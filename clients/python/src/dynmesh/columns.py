"""Attribute columns: named values for the entities of one kind, of five scalar types.

Nothing is rounded or truncated on the way in: what cannot be kept exactly is refused by name.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from .arguments import as_int64, as_text
from .arrays import as_array
from .attribute_types import DTYPE_NAMES, POLICIES, SCALARS, exactly, policy_number, type_number
from .errors import InvalidArgumentError
from .kinds import EntityKind
from .v1 import types_pb2

# Name under which exports hold ids; not an attribute, so imports leave it out.
SLOT_COLUMN = "dynmesh:slot"

_MAX_COMPONENTS = 16
# What to do about values that no column can hold: of one that is set, and of one of many that are imported.
_CONVERT = "convert it"
_LEAVE_OUT = "convert it, or leave it out by naming the others in `attributes`"
_NOT_IN_NAMES = re.compile(r"[^A-Za-z0-9_.-]")


@dataclass(frozen=True)
class Column:
    """Values of all entities of `kind`, in order: [n, components] of one of the five types."""

    name: str
    kind: EntityKind
    values: NDArray[Any]

    def spec(self) -> types_pb2.AttributeSpec:
        """The column's description for the wire."""
        return make_spec(self.name, self.kind, self.values.dtype, self.values.shape[1])


def make_spec(
    name: str,
    kind: EntityKind,
    dtype: DTypeLike,
    components: int,
    *,
    default: ArrayLike | None = None,
    policy: str | None = None,
) -> types_pb2.AttributeSpec:
    """AttributeSpec of a column.

    Raises `InvalidArgumentError` for other types than the five, for what is no policy, and for a default that
    is neither a number nor one for each component, or that the type cannot hold exactly.
    """
    number, of_policy = type_number(dtype), policy_number(policy)
    if number is None:
        raise _bad_field(name, "type", f"is {getattr(dtype, '__name__', dtype)}; columns are {DTYPE_NAMES}")
    if of_policy is None:
        raise _bad_field(name, "policy", f"has policy {policy!r}, none of {', '.join(POLICIES.values())}")
    return types_pb2.AttributeSpec(
        name=as_text(name, "name"),
        kind=int(kind),
        type=number,
        components=as_int64(components, "components", 1, _MAX_COMPONENTS),
        default_row=b"" if default is None else _default_row(name, default, SCALARS[number], components),
        policy=of_policy,
    )


def values_bytes(values: NDArray[Any]) -> bytes:
    """Rows as the wire has them. `values` must come from `as_values`."""
    return values.astype(values.dtype.newbyteorder("<"), copy=False).tobytes()


def values_from_proto(message: types_pb2.AttributeValues) -> NDArray[Any]:
    """Rows of an AttributeValues as [n, components]."""
    flat = np.frombuffer(message.values, dtype=SCALARS[message.spec.type])
    return flat.reshape(-1, message.spec.components or 1)


def as_values(values: ArrayLike, name: str, advice: str = _CONVERT) -> NDArray[Any]:
    """`values` as [n, components], exactly, in the nearest type that columns can have.

    float16 becomes float32; booleans uint8; int8, int16 and uint16 int32; uint32 int64, and uint64 if every
    value fits. Raises `InvalidArgumentError` with `advice` otherwise, and for more than 16 components.
    """
    array = as_array(values, "values")
    rows = array.reshape(-1, 1) if array.ndim == 1 else array
    if rows.ndim != 2 or not 1 <= rows.shape[1] <= _MAX_COMPONENTS:
        raise _unfit(name, f"has shape {array.shape}; columns have shape (n,) or (n, 1 to {_MAX_COMPONENTS})", advice)
    dtype = _nearest(rows.dtype)
    if dtype is None:
        raise _unfit(name, f"is {rows.dtype}; columns are {DTYPE_NAMES}", advice)
    if rows.dtype == np.uint64 and rows.size and int(rows.max()) > np.iinfo(np.int64).max:
        raise _unfit(name, "is uint64 with values that int64 cannot hold", advice)
    return rows.astype(dtype, copy=False)


def point_columns(data: dict[str, ArrayLike], wanted: Collection[str] | None) -> list[Column]:
    """A mesh's point_data as columns; `wanted`: names of those to take, None for all."""
    names = _names(data, wanted)
    return [Column(names[key], EntityKind.VERTEX, as_values(data[key], key, _LEAVE_OUT)) for key in names]


def cell_columns(
    data: dict[str, Sequence[ArrayLike]], kinds: Sequence[EntityKind | None], wanted: Collection[str] | None
) -> list[Column]:
    """A mesh's cell_data as columns, one for each kind of element that the mesh has.

    `kinds[i]` is that of block i; None for a block that is left out.
    """
    columns = []
    for key, name in _names(data, wanted).items():
        for kind in sorted({kind for kind in kinds if kind is not None}):
            blocks = [as_values(v, key, _LEAVE_OUT) for v, k in zip(data[key], kinds, strict=True) if k == kind]
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
    """Blocks one below the other, in a type that holds the values of all exactly."""
    if len({block.shape[1] for block in blocks}) > 1:
        raise _unfit(name, "has different numbers of components from block to block")
    dtype = np.result_type(*blocks)
    joined = [block if block.dtype == dtype else exactly(block, dtype) for block in blocks]
    if any(block is None for block in joined):
        raise _unfit(name, f"has values in one block that {dtype}, which others need, cannot hold")
    return np.concatenate([block for block in joined if block is not None])


def _nearest(dtype: np.dtype[Any]) -> DTypeLike | None:
    """The narrowest type of columns that holds every value of `dtype` (of uint64: nearly every)."""
    if dtype.kind == "f":
        return {2: np.float32, 4: np.float32, 8: np.float64}.get(dtype.itemsize)
    if dtype.kind == "b" or dtype == np.uint8:
        return np.uint8
    if dtype.kind not in "iu":
        return None
    return np.int32 if np.can_cast(dtype, np.int32) else np.int64


def _default_row(name: str, default: ArrayLike, scalar: np.dtype[Any], components: int) -> bytes:
    row = as_array(default, "default")
    if row.shape not in ((), (components,)):
        what = f"has a default of shape {row.shape} for {components} components"
        raise _bad_field(name, "default_row", what)
    exact = exactly(row, scalar)
    if exact is None:
        raise _bad_field(name, "default_row", f"has a default that {scalar.name} cannot hold: {default!r}")
    return np.broadcast_to(exact, components).tobytes()


def _bad_field(name: str, field: str, what: str) -> InvalidArgumentError:
    metadata = {"attribute": name, "field": field}
    return InvalidArgumentError(f"column {name!r} {what}", reason="BAD_ARGUMENT", metadata=metadata)


def _unfit(name: str, what: str, advice: str = _LEAVE_OUT) -> InvalidArgumentError:
    return InvalidArgumentError(
        f"column {name!r} {what}: {advice}",
        reason="BAD_ARGUMENT",
        metadata={"attribute": name},
    )
