"""The part of a session's reading half that asks about places."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain
from typing import Any

from numpy.typing import ArrayLike

from ._calls import Caller
from .arguments import as_count, as_number
from .arrays import Ids, as_point_rows
from .errors import InvalidArgumentError
from .kinds import KindLike, as_kind
from .places import (
    Located,
    NearestVertices,
    RayHits,
    box_message,
    parts_of,
    ray_options,
    read_hits,
    read_in_box,
    read_located,
    read_nearest,
)
from .v1 import queries_pb2, queries_pb2_grpc


class PlaceReader:
    """Asks one session about places. Its server makes an index of what is asked about, and keeps it current.

    Answers hold where coordinates, and the differences between them, are 0 or from 1e-140 to 1e140 in
    absolute value. Beyond that rays may miss what they meet.
    """

    name: str
    _caller: Caller
    _queries: queries_pb2_grpc.QueryServiceStub

    def in_box(self, kind: KindLike, box: ArrayLike, *, timeout: float | None = None) -> Ids:
        """Ids of the entities in a box, uint32[n], ascending.

        Vertices: inside of it or on its sides. Edges, faces and cells: whose bounding box meets it.

        Parameters
        ----------
        box : float64[2, 3]
            Low and high corner, finite.

        Raises
        ------
        InvalidArgumentError
            BAD_ARGUMENT (low above high), NON_FINITE_VALUE, BAD_ARRAY_LENGTH.
        ResourceExhaustedError
            LIMIT_EXCEEDED, also when there is no room for the index.
        """
        return self._in_box(kind, box, timeout)[0]

    def _in_box(self, kind: KindLike, box: ArrayLike, timeout: float | None = None) -> tuple[Ids, int]:
        """Ids, and the revision that they are of."""
        request = queries_pb2.FindInBoxRequest(session=self.name, kind=int(as_kind(kind)), box=box_message(box))
        return read_in_box(self._caller.stream(self._queries.FindInBox, request, timeout))

    def nearest_vertices(
        self, points: ArrayLike, count: int = 1, *, timeout: float | None = None
    ) -> NearestVertices:
        """For each point the nearest vertices, by ascending distance; equal distances by id.

        Parameters
        ----------
        points : float64[n, 3]
            Finite. One point may stand alone: float64[3].
        count : int
            1 to 10000 for each point; fewer come where there are fewer.

        Raises
        ------
        InvalidArgumentError
            NON_FINITE_VALUE with ``metadata["index"]``, BAD_ARGUMENT (count), BAD_ARRAY_LENGTH.
        ResourceExhaustedError, AbortedError
            As in `locate`.
        """
        number = as_count(count, "count")
        requests = [
            queries_pb2.FindNearestVerticesRequest(session=self.name, points=part, count=number)
            for part in parts_of(as_point_rows(points, "points"))
        ]
        return read_nearest(self._replies(self._queries.FindNearestVertices, requests, timeout))

    def locate(
        self,
        points: ArrayLike,
        kind: KindLike = "cell",
        *,
        tolerance: float = 0.0,
        timeout: float | None = None,
    ) -> Located:
        """For each point the cell that contains it, or the face that it lies on; the lowest id of several.

        A cell is the solid between its faces, which belong to it; a quad face is cut along the diagonal of its
        first vertex. So no point falls between the cells of a conforming mesh, however warped they are.

        Parameters
        ----------
        points : float64[n, 3]
            Finite. One point may stand alone: float64[3].
        kind : "cell" or "face"
        tolerance : float
            For faces: how far a point may lie from one. 0: a billionth of the diagonal of the face's bounding
            box.

        Raises
        ------
        InvalidArgumentError
            NON_FINITE_VALUE with ``metadata["index"]``, BAD_ENTITY_KIND, BAD_ARGUMENT, BAD_ARRAY_LENGTH.
        ResourceExhaustedError
            LIMIT_EXCEEDED, also when there is no room for the index.
        AbortedError
            The session changed while more points than a message holds were asked about.
        """
        of_kind, reach = int(as_kind(kind)), as_number(tolerance, "tolerance")
        requests = [
            queries_pb2.LocatePointsRequest(session=self.name, kind=of_kind, points=part, tolerance=reach)
            for part in parts_of(as_point_rows(points, "points"))
        ]
        return read_located(self._replies(self._queries.LocatePoints, requests, timeout))

    def cast_rays(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        *,
        hits: str = "first",
        targets: str = "surface",
        timeout: float | None = None,
    ) -> RayHits:
        """For each ray ``origin + t * direction``, t >= 0, the faces that it hits.

        A ray through an edge or a vertex hits all faces there, and never slips between them. Faces that it lies
        in are not hit. A warped quad may be hit twice.

        Parameters
        ----------
        origins, directions : float64[n, 3]
            Finite; directions of any length but zero. One of each may stand alone: float64[3].
        hits : "first" or "all"
        targets : "surface" or "any"
            Faces with exactly one cell and faces that are elements, or all faces.

        Raises
        ------
        InvalidArgumentError
            NON_FINITE_VALUE or BAD_ARGUMENT with ``metadata["index"]``, BAD_ARRAY_LENGTH.
        ResourceExhaustedError, AbortedError
            As in `locate`.
        """
        options = ray_options(hits, targets)
        starts, ways = as_point_rows(origins, "origins"), as_point_rows(directions, "directions")
        if len(starts) != len(ways):
            raise InvalidArgumentError(
                f"there are {len(starts)} origins and {len(ways)} directions", reason="BAD_ARRAY_LENGTH"
            )
        requests = [
            queries_pb2.CastRaysRequest(session=self.name, origins=start, directions=way, **options)
            for start, way in zip(parts_of(starts), parts_of(ways))
        ]
        return read_hits(self._replies(self._queries.CastRays, requests, timeout))

    def _replies(self, method: Any, requests: list[Any], timeout: float | None) -> Iterator[Any]:
        return chain.from_iterable(self._caller.stream(method, request, timeout) for request in requests)
