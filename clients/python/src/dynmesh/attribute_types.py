"""Scalar types and policies of attributes, numbered as on the wire, and conversions that change no value."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

Policy = Literal["interpolate", "copy", "max", "drop"]

SCALARS = {
    1: np.dtype("<f8"),
    2: np.dtype("<i4"),
    3: np.dtype("<f4"),
    4: np.dtype("<i8"),
    5: np.dtype("u1"),
}
POLICIES: dict[int, Policy] = {1: "interpolate", 2: "copy", 3: "max", 4: "drop"}
DTYPE_NAMES = "float64, float32, int64, int32 or uint8"


def type_number(dtype: DTypeLike) -> int | None:
    """Number of a scalar type; None for one that columns cannot have, or that is none."""
    try:
        wanted = np.dtype(dtype)
    except TypeError:
        return None
    return next((number for number, scalar in SCALARS.items() if scalar == wanted), None)


def policy_number(policy: str | None) -> int | None:
    """Number of a policy, 0 for None, which means that of the type; None for what is no policy."""
    if policy is None:
        return 0
    return next((number for number, name in POLICIES.items() if name == policy), None)


def default_policy(type_number: int) -> Policy:
    """The policy of a column that names none."""
    return "interpolate" if SCALARS[type_number].kind == "f" else "copy"


def row_from_bytes(row: bytes, type_number: int, components: int) -> NDArray[Any]:
    """A default row from the wire as [components]; zeros for no bytes."""
    scalar = SCALARS[type_number]
    values = np.frombuffer(row, scalar) if row else np.zeros(components, scalar)
    if values.shape != (components,):
        raise ValueError(f"a default row of {len(row)} bytes is none of {components} components")
    return values


def exactly(values: ArrayLike, dtype: DTypeLike) -> NDArray[Any] | None:
    """`values` as `dtype` if each stays what it is; else None. Real numbers and booleans only."""
    array = np.asarray(values)
    if array.dtype.kind not in "biuf":
        return None
    with np.errstate(invalid="ignore", over="ignore"):
        converted = array.astype(dtype)
    # Long double holds every value of every type.
    same = converted.astype(np.longdouble) == array.astype(np.longdouble)
    return converted if same.all() else None
