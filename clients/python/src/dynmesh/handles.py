"""Handles of vertices that a batch adds: they stand for ids that nobody knows before the batch is applied."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .arrays import Ids, as_integers
from .errors import InvalidArgumentError

# On the wire, vertex id NEW_VERTEX | k is the k-th vertex that the batch adds. A handle is that, and the number of its
# batch in the upper half of an int64.
NEW_VERTEX = 0x80000000
_WIRE_MASK = 0xFFFFFFFF
NUMBER_MASK = 0x7FFFFFFF
NO_BATCH = 0  # that of ids which no batch is to take: all handles are foreign there


def handles_from(batch_number: int, first: int, count: int) -> Ids:
    """Handles of the vertices `first`, `first` + 1, ... that a batch adds."""
    start = batch_number << 32 | NEW_VERTEX + first
    return np.arange(start, start + count, dtype=np.int64)


def to_wire(vertices: ArrayLike, batch_number: int) -> Any:
    """`vertices` with handles as they are on the wire; what holds none is left to be checked as it is."""
    array = as_integers(vertices)
    if array is None:
        return vertices
    handles = array > _WIRE_MASK
    if not handles.any():
        return array
    foreign = array[handles] >> 32 != batch_number
    if foreign.any():
        index = int(np.flatnonzero(handles)[np.flatnonzero(foreign)[0]])
        raise InvalidArgumentError(
            "a vertex handle of another batch, or no id at all: `EditResult.resolve` of the batch that gave it out "
            "turns it into an id",
            reason="FOREIGN_HANDLE",
            metadata={"index": str(index)},
        )
    return np.where(handles, array & _WIRE_MASK, array)
