"""Between numpy and the wire: little-endian fixed-width arrays in `bytes` fields."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import InvalidArgumentError

Ids = NDArray[np.uint32]
Points = NDArray[np.float64]

# Bytes of an array in one message: the API's own limit for chunks.
CHUNK_BYTES = 1 << 20


def as_array(values: ArrayLike, what: str) -> NDArray[Any]:
    """`values` as they are. Raises `InvalidArgumentError` for rows of different lengths."""
    try:
        return np.asarray(values)
    except ValueError:  # ragged rows
        raise InvalidArgumentError(
            f"{what} must be rows of equal length", reason="BAD_ARRAY_LENGTH", metadata={"field": what}
        ) from None


def as_ids(values: ArrayLike, what: str = "ids") -> Ids:
    """`values` as uint32[n]. Raises `InvalidArgumentError` for anything but a row of such integers."""
    return _as_uint32(values, what, ndim=1)


def as_id_rows(values: ArrayLike, width: int, what: str) -> Ids:
    """`values` as uint32[n, width]; an empty list is no rows."""
    rows = _as_uint32(values, what, ndim=None, width=width)
    if rows.size == 0 and rows.ndim <= 2:
        return rows.reshape(0, width)
    if rows.ndim != 2 or rows.shape[1] != width:
        raise InvalidArgumentError(
            f"{what} must have shape (n, {width}), not {rows.shape}", reason="BAD_ARRAY_LENGTH"
        )
    return rows


def as_points(values: ArrayLike, what: str = "positions") -> Points:
    """`values` as float64[n, 3]. Single precision and integers are widened; an empty list is no points."""
    points = as_array(values, what)
    if points.size == 0 and points.ndim <= 2:
        return np.zeros((0, 3))
    if points.ndim != 2 or points.shape[1] != 3:
        raise InvalidArgumentError(
            f"{what} must have shape (n, 3), not {points.shape}", reason="BAD_ARRAY_LENGTH"
        )
    if points.dtype.kind not in "iuf" or points.dtype.itemsize > 8:
        raise InvalidArgumentError(f"{what} must be real numbers, not {points.dtype}", reason="BAD_ARGUMENT")
    return points.astype(np.float64, copy=False)


def as_point_rows(values: ArrayLike, what: str) -> Points:
    """`values` as float64[n, 3], where one point alone is one row."""
    array = as_array(values, what)
    return as_points(array[np.newaxis] if array.shape == (3,) else array, what)


def as_numbers(values: ArrayLike, count: int, what: str) -> Points:
    """`values` as float64[count]; one number stands for all. Raises `InvalidArgumentError` for anything else."""
    numbers = as_array(values, what)
    if numbers.dtype.kind not in "iuf":
        raise InvalidArgumentError(f"{what} must be real numbers, not {numbers.dtype}", reason="BAD_ARGUMENT")
    if numbers.ndim > 0 and numbers.shape != (count,):
        raise InvalidArgumentError(f"{what} must have shape ({count},), not {numbers.shape}", reason="BAD_ARRAY_LENGTH")
    return np.broadcast_to(numbers, count).astype(np.float64)


def as_integers(values: ArrayLike) -> NDArray[np.int64] | None:
    """`values` as int64 of any shape; None for what are no such integers."""
    array = as_array(values, "ids")
    if array.size == 0 or array.dtype.kind not in "iu" or (array.dtype == np.uint64 and (array >> 63).any()):
        return None
    return array.astype(np.int64, copy=False)


def u32_bytes(values: Ids) -> bytes:
    """Bytes of a u32[n] field."""
    return values.astype("<u4", copy=False).tobytes()


def f64_bytes(values: Points) -> bytes:
    """Bytes of an f64[...] field."""
    return values.astype("<f8", copy=False).tobytes()


def from_bytes(data: bytes, dtype: str) -> NDArray[Any]:
    """A bytes field as a read-only array, without a copy. `dtype` is little-endian, e.g. "<u4"."""
    return np.frombuffer(data, dtype=dtype)


def concatenate(parts: list[NDArray[Any]], dtype: Any, width: int | None = None) -> NDArray[Any]:
    """The chunks of one array as one array that is the caller's own; `width`: columns of each row."""
    whole = np.concatenate(parts).astype(dtype, copy=False) if parts else np.zeros(0, dtype)
    return whole if width is None else whole.reshape(-1, width)


def frozen(array: NDArray[Any]) -> NDArray[Any]:
    """A view of `array` that cannot be written through."""
    view = array.view()
    view.flags.writeable = False
    return view


def _as_uint32(values: ArrayLike, what: str, ndim: int | None, width: int = 1) -> Ids:
    array = as_array(values, what)
    if array.size == 0:
        array = array.astype(np.uint32)
    if array.dtype.kind not in "iu":
        raise InvalidArgumentError(f"{what} must be integers, not {array.dtype}", reason="BAD_ARGUMENT")
    if ndim is not None and array.ndim != ndim:
        raise InvalidArgumentError(
            f"{what} must have {ndim} dimension(s), not shape {array.shape}", reason="BAD_ARRAY_LENGTH"
        )
    _check_range(array, what, width)
    return array.astype(np.uint32, copy=False)


def _check_range(array: NDArray[Any], what: str, width: int) -> None:
    if array.size == 0 or (array.min() >= 0 and array.max() <= 0xFFFFFFFF):
        return
    index = int(np.flatnonzero((array < 0) | (array > 0xFFFFFFFF))[0])
    raise InvalidArgumentError(
        f"{what}: {int(array.flat[index])} is not between 0 and 2^32 - 1",
        reason="BAD_ARGUMENT",
        metadata={"index": str(index // width)},
    )
