"""Answers about places: nearest vertices, located points, hits of rays."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .arguments import as_word
from .arrays import CHUNK_BYTES, Ids, Points, as_point_rows, f64_bytes
from .errors import InvalidArgumentError
from .queries import joined, joined_offsets, revision_of
from .v1 import queries_pb2, types_pb2

_POINTS_PER_CALL = CHUNK_BYTES // 24
_NOTHING = 0xFFFFFFFF
_HITS = {"first": queries_pb2.RAY_HITS_FIRST, "all": queries_pb2.RAY_HITS_ALL}
_TARGETS = {"surface": queries_pb2.RAY_TARGETS_SURFACE, "any": queries_pb2.RAY_TARGETS_ANY_FACE}


class NearestVertices(NamedTuple):
    """Vertices near points: those of point i are ``ids[offsets[i]:offsets[i + 1]]``, the nearest first.

    Attributes
    ----------
    offsets : int64[n + 1]
    ids : uint32[offsets[n]]
    distances : float64[offsets[n]]
        In the mesh's length unit.
    revision : int
        Of the session that this was read at.
    """

    offsets: NDArray[np.int64]
    ids: Ids
    distances: NDArray[np.float64]
    revision: int


class Located(NamedTuple):
    """Where points are.

    Attributes
    ----------
    ids : int64[n]
        The cell or face of each point, -1 where there is none.
    revision : int
    """

    ids: NDArray[np.int64]
    revision: int


class RayHits(NamedTuple):
    """What rays hit: ray i hits ``faces[offsets[i]:offsets[i + 1]]``, in this order.

    Attributes
    ----------
    offsets : int64[n + 1]
    faces : uint32[offsets[n]]
    t : float64[offsets[n]]
        The hits are at ``origins[i] + t * directions[i]``; t >= 0.
    revision : int
    """

    offsets: NDArray[np.int64]
    faces: Ids
    t: NDArray[np.float64]
    revision: int


def box_message(box: ArrayLike) -> types_pb2.Box:
    """``(low, high)`` for the wire. Raises `InvalidArgumentError` for other than float64[2, 3]."""
    corners = as_point_rows(box, "box")
    if len(corners) != 2:
        raise InvalidArgumentError(
            f"a box is a low and a high corner, not {len(corners)} points", reason="BAD_ARRAY_LENGTH"
        )
    return types_pb2.Box(low=f64_bytes(corners[0]), high=f64_bytes(corners[1]))


def parts_of(points: Points) -> list[bytes]:
    """Points for the wire, in as many pieces as messages take; one piece at least."""
    starts = range(0, max(len(points), 1), _POINTS_PER_CALL)
    return [f64_bytes(points[start : start + _POINTS_PER_CALL]) for start in starts]


def ray_options(hits: str, targets: str) -> dict[str, Any]:
    """Fields of a CastRaysRequest. Raises `InvalidArgumentError` for unknown words."""
    return {"hits": _HITS[as_word(hits, _HITS, "hits")], "targets": _TARGETS[as_word(targets, _TARGETS, "targets")]}


def read_in_box(replies: Iterable[queries_pb2.FindInBoxResponse]) -> tuple[Ids, int]:
    """Joins the chunks of an answer: ids and revision."""
    chunks = list(replies)
    return joined(chunks, "ids"), revision_of(chunks)


def read_nearest(replies: Iterable[queries_pb2.FindNearestVerticesResponse]) -> NearestVertices:
    """Joins the chunks of an answer."""
    chunks = list(replies)
    return NearestVertices(
        offsets=joined_offsets(chunks, "offsets"),
        ids=joined(chunks, "ids"),
        distances=joined(chunks, "distances", "<f8"),
        revision=revision_of(chunks),
    )


def read_located(replies: Iterable[queries_pb2.LocatePointsResponse]) -> Located:
    """Joins the chunks of an answer."""
    chunks = list(replies)
    ids = joined(chunks, "ids").astype(np.int64)
    ids[ids == _NOTHING] = -1
    return Located(ids, revision_of(chunks))


def read_hits(replies: Iterable[queries_pb2.CastRaysResponse]) -> RayHits:
    """Joins the chunks of an answer."""
    chunks = list(replies)
    return RayHits(
        offsets=joined_offsets(chunks, "offsets"),
        faces=joined(chunks, "ids"),
        t=joined(chunks, "parameters", "<f8"),
        revision=revision_of(chunks),
    )
