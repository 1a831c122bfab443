"""Answers about neighbourhoods and entities, as CSR arrays."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .arguments import as_int64, bad_argument
from .arrays import CHUNK_BYTES, Ids, Points, as_ids, concatenate, from_bytes, u32_bytes
from .errors import AbortedError, UnimplementedError, make_error
from .handles import NO_BATCH, to_wire
from .kinds import EntityKind
from .v1 import queries_pb2, types_pb2

try:
    from . import _native
except ImportError:  # installed without the native module
    _native = None

# What ids a query speaks of: None for all live ones, slice(begin, end) for all live ones in between.
Selection = slice | ArrayLike | None

_END_OF_IDS = 0xFFFFFFFF
_IS_ELEMENT, _ON_BOUNDARY, _IS_DUPLICATE = 1, 2, 4


class Csr(NamedTuple):
    """Lists of neighbours: those of ``ids[i]`` are ``neighbors[offsets[i]:offsets[i + 1]]``.

    Attributes
    ----------
    ids : uint32[n]
    offsets : int64[n + 1]
    neighbors : uint32[offsets[n]]
    revision : int
        Of the session that this was read at.
    """

    ids: Ids
    offsets: NDArray[np.int64]
    neighbors: Ids
    revision: int

    def row(self, index: int) -> Ids:
        """Neighbours of ``ids[index]``; negative indices count from the end. Raises IndexError."""
        if not -len(self.ids) <= index < len(self.ids):
            raise IndexError(f"row {index} of {len(self.ids)}")
        index %= len(self.ids)
        return self.neighbors[self.offsets[index] : self.offsets[index + 1]]

    def to_dict(self) -> dict[int, list[int]]:
        """Lists by id: for small answers and tests."""
        return {int(entity): self.row(i).tolist() for i, entity in enumerate(self.ids)}


@dataclass(frozen=True)
class Entities:
    """What entities are.

    Attributes
    ----------
    kind : EntityKind
    ids : uint32[n]
        In order of the request.
    positions : float64[n, 3]
        Of vertices; empty for other kinds.
    types : uint8[n]
        `ElementType`; empty for vertices.
    vertex_offsets, vertices : int64[n + 1], uint32[...]
        Vertices of entity i are ``vertices[vertex_offsets[i]:vertex_offsets[i + 1]]``; empty for vertices.
    is_element, on_boundary, is_duplicate : bool[n]
    born_revisions : int64[n]
        Revision at which each came to be.
    revision : int
    """

    kind: EntityKind
    ids: Ids
    positions: Points
    types: NDArray[np.uint8]
    vertex_offsets: NDArray[np.int64]
    vertices: Ids
    is_element: NDArray[np.bool_]
    on_boundary: NDArray[np.bool_]
    is_duplicate: NDArray[np.bool_]
    born_revisions: NDArray[np.int64]
    revision: int


@dataclass(frozen=True)
class Surface:
    """The boundary as a Draco mesh (.drc), which any Draco decoder opens.

    Positions are quantised, degenerate triangles stripped, order changed: match vertices by slot.
    """

    drc: bytes
    revision: int

    def decode(self) -> tuple[Ids, Points, Ids]:
        """Vertex ids uint32[n], positions float64[n, 3], triangles uint32[m, 3] (indices into both)."""
        if _native is None:
            raise UnimplementedError("decoding needs dynmesh's native module", reason="NO_NATIVE_MODULE")
        try:
            return _native.decode_surface(self.drc)
        except _native.DecodeError as error:
            code, message, reason, metadata = error.args
            raise make_error(code, message, reason, dict(metadata)) from None


def selections_of(ids: Selection, **filters: Any) -> list[types_pb2.Selection]:
    """`ids` for the wire: one selection, or several where a single message could not hold the list.

    `filters` are the other fields of each.

    Raises `InvalidArgumentError` for anything but ids, FOREIGN_HANDLE for handles of new vertices, and for a slice
    with a step or negative ends.
    """
    if ids is None:
        return [types_pb2.Selection(all=True, **filters)]
    if isinstance(ids, slice):
        return [types_pb2.Selection(range=_range_of(ids), **filters)]
    array = as_ids(to_wire(ids, NO_BATCH))
    step = CHUNK_BYTES // 4
    parts = [array[begin : begin + step] for begin in range(0, max(array.size, 1), step)]
    return [types_pb2.Selection(ids=u32_bytes(part), **filters) for part in parts]


def read_neighbors(replies: Iterable[queries_pb2.GetNeighborsResponse]) -> Csr:
    """Joins the chunks of an answer."""
    chunks = list(replies)
    return Csr(
        ids=joined(chunks, "ids"),
        offsets=joined_offsets(chunks, "offsets"),
        neighbors=joined(chunks, "neighbors"),
        revision=revision_of(chunks),
    )


def read_entities(kind: EntityKind, replies: Iterable[queries_pb2.GetEntitiesResponse]) -> Entities:
    """Joins the chunks of an answer."""
    chunks = list(replies)
    flags = joined(chunks, "flags", "u1")
    return Entities(
        kind=kind,
        ids=joined(chunks, "ids"),
        positions=joined(chunks, "positions", "<f8").reshape(-1, 3),
        types=joined(chunks, "types", "u1"),
        vertex_offsets=joined_offsets(chunks, "vertex_offsets"),
        vertices=joined(chunks, "vertices"),
        is_element=(flags & _IS_ELEMENT) != 0,
        on_boundary=(flags & _ON_BOUNDARY) != 0,
        is_duplicate=(flags & _IS_DUPLICATE) != 0,
        born_revisions=joined(chunks, "born_revisions", "<i8"),
        revision=revision_of(chunks),
    )


def read_boundary(replies: Iterable[queries_pb2.GetBoundaryResponse]) -> tuple[Ids, int]:
    """Ids and revision."""
    chunks = list(replies)
    return joined(chunks, "ids"), revision_of(chunks)


def read_surface(replies: Iterable[queries_pb2.GetBoundarySurfaceResponse]) -> Surface:
    """Joins the chunks of the file."""
    chunks = list(replies)
    return Surface(b"".join(chunk.drc for chunk in chunks), revision_of(chunks))


def _range_of(ids: slice) -> types_pb2.Selection.Range:
    if ids.step is not None and as_int64(ids.step, "step of ids") != 1:
        raise bad_argument("ids", f"{ids} is not a range of ids")
    begin = 0 if ids.start is None else as_int64(ids.start, "start of ids", 0)
    end = _END_OF_IDS if ids.stop is None else min(as_int64(ids.stop, "stop of ids", 0), _END_OF_IDS)
    return types_pb2.Selection.Range(begin=min(begin, end), end=end)


def joined(chunks: list[Any], field: str, dtype: str = "<u4") -> NDArray[Any]:
    """One array of an answer, from its chunks."""
    parts = [from_bytes(getattr(chunk, field), dtype) for chunk in chunks]
    return concatenate(parts, np.dtype(dtype).newbyteorder("="))


def joined_offsets(chunks: list[Any], field: str) -> NDArray[np.int64]:
    """Offsets of all rows, from offsets that begin with 0 in each chunk."""
    offsets = [from_bytes(getattr(chunk, field), "<u4") for chunk in chunks]
    sizes = [np.diff(part.astype(np.int64)) for part in offsets if part.size]
    return (
        np.concatenate([np.zeros(1, np.int64), np.cumsum(np.concatenate(sizes))])
        if sizes
        else np.zeros(1, np.int64)
    )


def revision_of(chunks: list[Any]) -> int:
    """That of all chunks. Only a list of ids that took several calls can have met an edit in between."""
    revisions = {int(chunk.revision) for chunk in chunks}
    if len(revisions) > 1:
        raise AbortedError(
            "the session changed while a long list of ids was read; ask again or for ranges",
            reason="REVISION_MISMATCH",
            metadata={"revision": str(max(revisions))},
        )
    return revisions.pop() if revisions else 0
