"""Batches of edits: collected in a ``with`` block, committed as one revision or not at all."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from types import TracebackType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike

from .arguments import as_count, as_number, as_word, bad_argument
from .arrays import (
    Ids,
    as_id_rows,
    as_ids,
    as_numbers,
    as_points,
    concatenate,
    f64_bytes,
    from_bytes,
    u32_bytes,
)
from .attribute_types import Policy
from .columns import as_values, make_spec, values_bytes
from .edit_result import EditResult, lineage_from_proto, refusal_from_proto
from .errors import InvalidArgumentError
from .handles import NUMBER_MASK, handles_from, to_wire
from .info import checksum_from_proto, counts_from_proto, warning_from_proto
from .kinds import KindLike, TypeLike, as_element_type, as_kind
from .v1 import edits_pb2, types_pb2

_batch_numbers = itertools.count(1)


class EditBatch:
    """Collects edits in order. Nothing is sent; the methods check shapes and types only."""

    def __init__(self) -> None:
        self._number = next(_batch_numbers) & NUMBER_MASK
        self._edits: list[edits_pb2.Edit] = []
        self._num_new_vertices = 0
        self._adds_vertices: list[int] = []

    def __len__(self) -> int:
        return len(self._edits)

    def add_vertices(self, positions: ArrayLike) -> Ids:
        """Adds vertices.

        Parameters
        ----------
        positions : float[n, 3]

        Returns
        -------
        int64[n]
            Handles: they serve as vertex ids in later edits of this batch, and of no other: those refuse them
            with `InvalidArgumentError` FOREIGN_HANDLE. `EditResult.resolve` turns them into ids.
        """
        points = as_points(positions)
        return self._append_vertices(len(points), add_vertices=edits_pb2.AddVertices(positions=f64_bytes(points)))

    def remove_vertices(self, ids: ArrayLike) -> int:
        """Removes vertices (uint32[n]) that have no incident edges any more; returns the edit's index."""
        return self._append(remove_vertices=edits_pb2.RemoveVertices(ids=u32_bytes(as_ids(self._wire(ids)))))

    def move_vertices(self, ids: ArrayLike, positions: ArrayLike) -> int:
        """Moves vertices (uint32[n]) to positions (float[n, 3]); returns the edit's index. Attributes stay."""
        slots, points = as_ids(self._wire(ids)), as_points(positions)
        _check_same_length("positions", len(points), len(slots))
        move = edits_pb2.MoveVertices(ids=u32_bytes(slots), positions=f64_bytes(points))
        return self._append(move_vertices=move)

    def add_elements(self, element_type: TypeLike, vertices: ArrayLike) -> int:
        """Adds elements of one type.

        Parameters
        ----------
        element_type : ElementType or str
            By meshio's name ("tetra") or ours ("tetrahedron").
        vertices : uint32[n, k]
            Vertex ids or handles, in VTK's order.

        Returns
        -------
        int
            The edit's index: ``tx.result.new_ids[index]`` are the ids of the elements.
        """
        of_type = as_element_type(element_type)
        rows = as_id_rows(self._wire(vertices), of_type.num_vertices, f"vertices of {of_type} elements")
        block = types_pb2.ElementBlock(type=int(of_type), vertices=u32_bytes(rows))
        return self._append(add_elements=block)

    def remove_elements(self, kind: KindLike, ids: ArrayLike) -> int:
        """Removes elements (uint32[n]) of a kind; returns the edit's index.

        Faces and edges that only they needed go with them, vertices stay.
        """
        remove = edits_pb2.RemoveElements(kind=int(as_kind(kind)), ids=u32_bytes(as_ids(ids)))
        return self._append(remove_elements=remove)

    def add_attribute(
        self,
        name: str,
        kind: KindLike,
        dtype: DTypeLike = np.float64,
        components: int = 1,
        *,
        default: ArrayLike | None = None,
        policy: Policy | None = None,
    ) -> int:
        """Adds a column for all entities of a kind; returns the edit's index.

        Parameters
        ----------
        dtype : float64, float32, int64, int32 or uint8
        components : int
            1 to 16.
        default : number or [components], optional
            The row of entities for which none is set, finite and exactly of `dtype`. Default: zeros.
        policy : "interpolate", "copy", "max" or "drop", optional
            Which row a vertex, edge, face or cell takes that an operator makes of others: theirs by weight
            (integers to the nearest), that of the one that weighs most, the greatest of each component, or the
            default.
            Default: "interpolate" for floating-point numbers, "copy" for integers.
        """
        return self._append(
            add_attribute=make_spec(name, as_kind(kind), dtype, components, default=default, policy=policy)
        )

    def set_attribute(self, name: str, kind: KindLike, ids: ArrayLike, values: ArrayLike) -> int:
        """Sets rows of an attribute; returns the edit's index.

        Parameters
        ----------
        ids : uint32[n]
        values : float[n], int[n], float[n, components] or int[n, components]
            Of any type: the batch is refused (INEXACT_VALUE) if the column's type cannot hold one of them
            exactly. So 0.1 is ``np.float32(0.1)`` for a column of float32.
        """
        slots, rows = as_ids(self._wire(ids)), as_values(values, name)
        _check_same_length("values", len(rows), len(slots))
        spec = make_spec(name, as_kind(kind), rows.dtype, rows.shape[1])
        message = types_pb2.AttributeValues(spec=spec, ids=u32_bytes(slots), values=values_bytes(rows))
        return self._append(set_attribute=message)

    def split_edges(
        self,
        edges: ArrayLike | None = None,
        *,
        ends: ArrayLike | None = None,
        parameters: ArrayLike | None = None,
        positions: ArrayLike | None = None,
        allow_inversion: bool = False,
        min_quality: float = 0.0,
    ) -> Ids:
        """Puts a vertex on each edge and replaces all elements at it.

        Wires, triangles and tetrahedra become two, quads three triangles, other cells tetrahedra and pyramids.

        Parameters
        ----------
        edges : uint32[n], optional
            Ids of edges.
        ends : uint32[n, 2], optional
            In place of `edges`: their vertices, ids or handles of this batch.
        parameters : float[n] or float, optional
            Where on the edge, between 0 (its first vertex) and 1. Default 0.5.
        positions : float[n, 3], optional
            Where else the vertices go. Attributes are weighed by `parameters` in any case.
        allow_inversion : bool
            Let elements be flat, or turned over against those whose place they take.
        min_quality : float
            Least quality of each new element, 0 to 1 (regular).

        Returns
        -------
        int64[n]
            Handles of the new vertices, as of `add_vertices`. For items that are passed over with
            ``skip_refused``, `EditResult.resolve` gives 0xffffffff.
        """
        names, count = self._edges(edges, ends)
        places = _places(parameters, positions, count)
        message = edits_pb2.SplitEdges(edges=names, limits=_limits(allow_inversion, min_quality), **places)
        return self._append_vertices(count, split_edges=message)

    def collapse_edges(
        self,
        edges: ArrayLike | None = None,
        *,
        ends: ArrayLike | None = None,
        parameters: ArrayLike | None = None,
        positions: ArrayLike | None = None,
        allow_inversion: bool = False,
        min_quality: float = 0.0,
    ) -> int:
        """Draws each edge together; returns the edit's index. The nearer end keeps its id, the other one goes.

        Parameters are those of `split_edges`. ``parameters`` may also be 0 or 1; at 0.5 the first vertex keeps its
        id. The default is 0.5, but where just one end is on the boundary that end, so that the boundary stays.
        """
        names, count = self._edges(edges, ends)
        places = _places(parameters, positions, count)
        message = edits_pb2.CollapseEdges(edges=names, limits=_limits(allow_inversion, min_quality), **places)
        return self._append(collapse_edges=message)

    def swap_edges(
        self,
        edges: ArrayLike | None = None,
        *,
        ends: ArrayLike | None = None,
        allow_inversion: bool = False,
        min_quality: float = 0.0,
    ) -> int:
        """Flips edges between two triangles, and removes edges inside of tetrahedra (3-2, 4-4 and beyond).

        Parameters are those of `split_edges`. Returns the edit's index.
        """
        names, _ = self._edges(edges, ends)
        message = edits_pb2.SwapEdges(edges=names, limits=_limits(allow_inversion, min_quality))
        return self._append(swap_edges=message)

    def swap_faces(self, faces: ArrayLike, *, allow_inversion: bool = False, min_quality: float = 0.0) -> int:
        """Replaces faces (uint32[n]) between two tetrahedra by edges (2-3); returns the edit's index."""
        limits = _limits(allow_inversion, min_quality)
        return self._append(swap_faces=edits_pb2.SwapFaces(ids=u32_bytes(as_ids(faces)), limits=limits))

    def split_elements(
        self,
        kind: KindLike,
        elements: ArrayLike,
        *,
        positions: ArrayLike | None = None,
        allow_inversion: bool = False,
        min_quality: float = 0.0,
    ) -> Ids:
        """Puts a vertex into each element and replaces it by one for each of its faces (of a face: edges).

        Parameters
        ----------
        elements : uint32[n]
        positions : float[n, 3], optional
            Where the vertices go; by default the means of the elements' vertices.

        Returns
        -------
        int64[n]
            Handles of the new vertices, as of `split_edges`.
        """
        slots = as_ids(elements)
        message = edits_pb2.SplitElements(
            kind=int(as_kind(kind)),
            ids=u32_bytes(slots),
            positions=_positions(positions, len(slots)),
            limits=_limits(allow_inversion, min_quality),
        )
        return self._append_vertices(len(slots), split_elements=message)

    def merge_vertices(
        self,
        pairs: ArrayLike,
        *,
        positions: ArrayLike | None = None,
        allow_inversion: bool = False,
        min_quality: float = 0.0,
    ) -> int:
        """Welds pairs of vertices that no edge joins; returns the edit's index.

        Edges and faces that have the same vertices then are one: two meshes that touch grow together.

        Parameters
        ----------
        pairs : uint32[n, 2]
            The vertex that stays, and the one that goes: ids or handles of this batch.
        positions : float[n, 3], optional
            Where they meet; by default where the first one is.
        """
        rows = as_id_rows(self._wire(pairs), 2, "pairs of vertices")
        message = edits_pb2.MergeVertices(
            pairs=u32_bytes(rows),
            positions=_positions(positions, len(rows)),
            limits=_limits(allow_inversion, min_quality),
        )
        return self._append(merge_vertices=message)

    def dissolve_vertices(
        self, ids: ArrayLike, *, allow_inversion: bool = False, min_quality: float = 0.0
    ) -> int:
        """Removes vertices and fills the gaps anew, without new ones; returns the edit's index.

        Triangles round a vertex: the best triangulation of the ring of their other corners. Two wires become one.
        Tetrahedra: the best collapse onto a neighbour. See `remove_vertices` for vertices that nothing uses.

        Parameters
        ----------
        ids : uint32[n]
            Ids or handles of this batch.
        """
        message = edits_pb2.DissolveVertices(
            ids=u32_bytes(as_ids(self._wire(ids))), limits=_limits(allow_inversion, min_quality)
        )
        return self._append(dissolve_vertices=message)

    def smooth_vertices(
        self,
        vertices: ArrayLike,
        *,
        method: str = "guarded",
        factor: float = 1.0,
        iterations: int = 1,
        move_boundary: bool = False,
        tangential: bool = False,
        allow_inversion: bool = False,
        min_quality: float = 0.0,
    ) -> int:
        """Moves vertices to where the elements at them are better; returns the edit's index.

        A move that the limits or the method do not permit is halved, up to four times; then the vertex stays.
        ``tx.result.num_moved[index]`` says how many moved. Attributes stay what they are.

        Parameters
        ----------
        vertices : uint32[n]
            Ids or handles of this batch, moved in this order.
        method : {"guarded", "laplacian", "optimizing"}
            Towards the mean of the adjacent vertices unless the least quality of an element there would get worse;
            towards it in any case; or uphill in that least quality, by small steps.
        factor : float
            Of the way to the mean that is tried first, above 0 and at most 1. Of "optimizing": of the first step, a
            quarter of the mean length of the vertex's edges.
        iterations : int
            How often all are gone through, 1 to 1000. A million vertices, and 200,000,000 entities that are looked
            at (``max_batch_work``), are what a batch may have of all iterations together: of larger meshes take a
            batch for each iteration, or for parts of the vertices.
        move_boundary : bool
            Vertices on the boundary move too, towards their neighbours along it.
        tangential : bool
            Vertices of surfaces and of the boundary stay in the plane across their mean normal, and those of the
            boundary of a surface on the line between their neighbours; those at sharp edges and corners stay.
        allow_inversion, min_quality
            As of `split_edges`.
        """
        message = edits_pb2.SmoothVertices(
            ids=u32_bytes(as_ids(self._wire(vertices))),
            method=_smooth_method(method),
            factor=as_number(factor, "factor"),
            iterations=as_count(iterations, "iterations"),
            move_boundary=bool(move_boundary),
            tangential=bool(tangential),
            limits=_limits(allow_inversion, min_quality),
        )
        return self._append(smooth_vertices=message)

    def edits(self) -> list[edits_pb2.Edit]:
        """The edits so far, as messages."""
        return list(self._edits)

    def read(self, reply: edits_pb2.ApplyEditsResponse) -> EditResult:
        """The server's answer to this batch."""
        new_ids = tuple(from_bytes(result.new_ids, "<u4") for result in reply.results)
        return EditResult(
            revision=reply.revision,
            new_ids=new_ids,
            new_vertices=concatenate([new_ids[i] for i in self._adds_vertices], np.uint32),
            checksum=checksum_from_proto(reply.checksum),
            counts=counts_from_proto(reply.counts),
            warnings=tuple(warning_from_proto(w) for w in reply.warnings),
            batch_number=self._number,
            skipped=tuple(from_bytes(result.skipped, "<u4") for result in reply.results),
            refusals=tuple(tuple(map(refusal_from_proto, result.refusals)) for result in reply.results),
            lineage=tuple(map(lineage_from_proto, reply.results)),
            num_moved=tuple(result.num_moved for result in reply.results),
            durable_revision=reply.durable_revision,
        )

    def _append_vertices(self, count: int, **kind: Any) -> Ids:
        """Appends an edit that adds vertices; returns their handles."""
        handles = handles_from(self._number, self._num_new_vertices, count)
        self._adds_vertices.append(self._append(**kind))
        self._num_new_vertices += count
        return handles

    def _edges(self, edges: ArrayLike | None, ends: ArrayLike | None) -> tuple[edits_pb2.EdgeNames, int]:
        if (edges is None) == (ends is None):
            raise InvalidArgumentError("name edges by their ids or by their ends", reason="BAD_ARGUMENT")
        if edges is not None:
            slots = as_ids(edges)
            return edits_pb2.EdgeNames(ids=u32_bytes(slots)), len(slots)
        rows = as_id_rows(self._wire(ends), 2, "ends of edges")
        return edits_pb2.EdgeNames(ends=u32_bytes(rows)), len(rows)

    def _wire(self, vertices: ArrayLike) -> ArrayLike:
        return to_wire(vertices, self._number)

    def _append(self, **kind: Any) -> int:
        self._edits.append(edits_pb2.Edit(**kind))
        return len(self._edits) - 1


class Transaction(EditBatch):
    """A batch that is sent when its ``with`` block ends, and forgotten if an exception ends it.

    >>> with session.edit() as tx:
    ...     v = tx.add_vertices(points)
    ...     tets = tx.add_elements("tetra", [v[:4]])
    >>> tx.result.revision, tx.result.resolve(v), tx.result.new_ids[tets]

    Attributes
    ----------
    result : EditResult
        Set when the batch was accepted. RuntimeError before.
    """

    def __init__(self, commit: Callable[[EditBatch], EditResult]) -> None:
        super().__init__()
        self._commit = commit
        self._result: EditResult | None = None
        self._ended = False

    @property
    def result(self) -> EditResult:
        """What the batch did. Raises RuntimeError while it has not been accepted."""
        if self._result is None:
            raise RuntimeError(
                "the batch has not been committed: its with block has not ended without an error"
            )
        return self._result

    def __enter__(self) -> Transaction:
        self._check_open()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ended = True
        if kind is None:
            self._result = self._commit(self)

    def _append(self, **kind: Any) -> int:
        self._check_open()
        return super()._append(**kind)

    def _check_open(self) -> None:
        if self._ended:
            raise RuntimeError("the batch has ended with its with block: begin another with session.edit()")


def as_batch(batch: EditBatch) -> EditBatch:
    """`batch`, if it is one. Raises `InvalidArgumentError`."""
    if isinstance(batch, EditBatch):
        return batch
    raise bad_argument("batch", f"batch is no EditBatch: {batch!r}")


def _limits(allow_inversion: bool, min_quality: float) -> edits_pb2.OperatorLimits:
    quality = as_number(min_quality, "min_quality")
    return edits_pb2.OperatorLimits(allow_inversion=bool(allow_inversion), min_quality=quality)


def _smooth_method(name: str) -> int:
    method = as_word(name, ("guarded", "laplacian", "optimizing"), "method")
    return edits_pb2.SmoothMethod.Value(f"SMOOTH_METHOD_{method.upper()}")


def _places(parameters: ArrayLike | None, positions: ArrayLike | None, count: int) -> dict[str, bytes]:
    """The fields that say where on, or off, each edge."""
    on_edge = b"" if parameters is None else f64_bytes(as_numbers(parameters, count, "parameters"))
    return {"parameters": on_edge, "positions": _positions(positions, count)}


def _positions(positions: ArrayLike | None, count: int) -> bytes:
    if positions is None:
        return b""
    points = as_points(positions)
    _check_same_length("positions", len(points), count)
    return f64_bytes(points)


def _check_same_length(what: str, length: int, wanted: int) -> None:
    if length != wanted:
        raise InvalidArgumentError(f"{length} {what} for {wanted} ids", reason="BAD_ARRAY_LENGTH")
