"""Whole meshes on the wire: the streams of ImportMesh and ExportMesh."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .arrays import CHUNK_BYTES, Ids, concatenate, f64_bytes, from_bytes, u32_bytes
from .attribute_types import row_from_bytes
from .columns import Column, values_bytes, values_from_proto
from .errors import InternalError
from .info import MeshWarning, SessionInfo, info_from_proto, warning_from_proto
from .kinds import ElementType, EntityKind, as_kind
from .meshes import MeshData
from .progress import Progress
from .snapshot import Attribute, Block, Snapshot
from .v1 import sessions_pb2, types_pb2


@dataclass(frozen=True)
class ImportResult:
    """What an import made: the session as it was right after, and what deserves a look.

    Attributes
    ----------
    slots : dict of EntityKind to uint32[n]
        With ``slot_order="hilbert"``: ``slots["vertex"][i]`` is the id that the i-th vertex got, and so on for the
        kinds of elements; `EntityKind` and its name both serve. Else empty: item i got id i.
    """

    revision: int
    info: SessionInfo
    warnings: tuple[MeshWarning, ...]
    slots: dict[EntityKind, Ids]


class _ByKind(dict[EntityKind, Ids]):
    """Takes names of kinds, too."""

    def __missing__(self, kind: Any) -> Ids:
        if isinstance(kind, str):
            return self[as_kind(kind)]
        raise KeyError(kind)


def import_requests(
    header: sessions_pb2.ImportHeader, mesh: MeshData
) -> Iterator[sessions_pb2.ImportMeshRequest]:
    """The messages of an import: `header` with the counts, then points, elements and attributes in chunks."""
    header.num_vertices = len(mesh.points)
    header.num_elements = mesh.num_elements
    yield sessions_pb2.ImportMeshRequest(header=header)
    for rows in _chunks(mesh.points):
        yield sessions_pb2.ImportMeshRequest(positions=f64_bytes(rows))
    for element_type, vertices in mesh.blocks:
        for rows in _chunks(vertices):
            block = types_pb2.ElementBlock(type=int(element_type), vertices=u32_bytes(rows))
            yield sessions_pb2.ImportMeshRequest(elements=block)
    for column in mesh.columns:
        for rows in _chunks(column.values):
            yield sessions_pb2.ImportMeshRequest(attribute=_attribute_rows(column, rows))


def read_import(replies: Iterable[sessions_pb2.ImportMeshResponse], progress: Progress) -> ImportResult:
    """Follows an import to its result."""
    pieces: dict[EntityKind, list[NDArray[Any]]] = defaultdict(list)
    for reply in replies:
        part = reply.WhichOneof("part")
        if part == "progress":
            progress.set(reply.progress.phase, reply.progress.done, reply.progress.total)
        elif part == "ids":
            pieces[EntityKind(reply.ids.kind)].append(from_bytes(reply.ids.ids, "<u4"))
        elif part == "result":
            result = reply.result
            warnings = tuple(warning_from_proto(w) for w in result.warnings)
            slots = _ByKind({kind: concatenate(ids, np.uint32) for kind, ids in pieces.items()})
            return ImportResult(result.revision, info_from_proto(result.session), warnings, slots)
    raise InternalError("the import ended without a result")


class ExportReader:
    """Gathers the chunks of an export into a `Snapshot`."""

    def __init__(self) -> None:
        self._revision = 0
        self._vertex_ids: list[NDArray[Any]] = []
        self._positions: list[NDArray[Any]] = []
        self._ids: dict[ElementType, list[NDArray[Any]]] = defaultdict(list)
        self._vertices: dict[ElementType, list[NDArray[Any]]] = defaultdict(list)
        self._attributes: dict[tuple[EntityKind, str], list[types_pb2.AttributeValues]] = defaultdict(list)

    def add(self, reply: sessions_pb2.ExportMeshResponse) -> int:
        """Takes the next chunk; returns how many vertices or elements it held."""
        self._revision = reply.revision
        part = reply.WhichOneof("part")
        if part == "vertices":
            self._vertex_ids.append(from_bytes(reply.vertices.ids, "<u4"))
            self._positions.append(from_bytes(reply.vertices.positions, "<f8"))
            return len(self._vertex_ids[-1])
        if part == "elements":
            return self._add_elements(reply.elements)
        if part == "attribute":
            spec = reply.attribute.spec
            self._attributes[EntityKind(spec.kind), spec.name].append(reply.attribute)
        return 0

    def snapshot(self) -> Snapshot:
        """Everything taken so far."""
        return Snapshot(
            revision=self._revision,
            vertex_ids=concatenate(self._vertex_ids, np.uint32),
            positions=concatenate(self._positions, np.float64, width=3),
            blocks=tuple(self._block(t) for t in sorted(self._ids)),
            attributes=tuple(_attribute(*key, chunks) for key, chunks in self._attributes.items()),
        )

    def _add_elements(self, chunk: sessions_pb2.ElementChunk) -> int:
        element_type = ElementType(chunk.block.type)
        self._ids[element_type].append(from_bytes(chunk.ids, "<u4"))
        self._vertices[element_type].append(from_bytes(chunk.block.vertices, "<u4"))
        return len(self._ids[element_type][-1])

    def _block(self, element_type: ElementType) -> Block:
        width = element_type.num_vertices
        vertices = concatenate(self._vertices[element_type], np.uint32, width)
        return Block(element_type, concatenate(self._ids[element_type], np.uint32), vertices)


def _attribute(kind: EntityKind, name: str, chunks: list[types_pb2.AttributeValues]) -> Attribute:
    ids = concatenate([from_bytes(chunk.ids, "<u4") for chunk in chunks], np.uint32)
    spec = chunks[0].spec
    default = row_from_bytes(spec.default_row, spec.type, spec.components or 1)
    return Attribute(name, kind, ids, np.concatenate([values_from_proto(chunk) for chunk in chunks]), default)


def _attribute_rows(column: Column, rows: NDArray[Any]) -> types_pb2.AttributeValues:
    return types_pb2.AttributeValues(spec=column.spec(), values=values_bytes(rows))


def _chunks(rows: NDArray[Any]) -> Iterator[NDArray[Any]]:
    """Runs of rows that fill a message; none for no rows."""
    if not len(rows):
        return
    step = max(1, CHUNK_BYTES // rows[:1].nbytes)
    for begin in range(0, len(rows), step):
        yield rows[begin : begin + step]
