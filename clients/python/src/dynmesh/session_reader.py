"""The reading half of a session: what it is, neighbourhoods, entities, boundary, and all of it."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import grpc
from numpy.typing import ArrayLike

from ._calls import Caller
from .arguments import INT32, as_count, as_int64, as_text, bad_argument
from .arrays import Ids, Points
from .backups import BackupResult, write_backup
from .files import PathLike
from .info import Counts, SessionInfo, info_from_proto
from .kinds import KindLike, as_kind
from .place_reader import PlaceReader
from .places import box_message
from .progress import Progress
from .queries import (
    Csr,
    Entities,
    Selection,
    Surface,
    read_boundary,
    read_entities,
    read_neighbors,
    read_surface,
    selections_of,
)
from .snapshot import Snapshot
from .transfer import ExportReader
from .v1 import (
    backups_pb2,
    backups_pb2_grpc,
    queries_pb2,
    queries_pb2_grpc,
    sessions_pb2,
    sessions_pb2_grpc,
    types_pb2,
)

if TYPE_CHECKING:
    import meshio

# Transfers of whole meshes take as long as they take.
FOREVER = float("inf")


class SessionReader(PlaceReader):
    """Reads one session. Every method is one call, and every answer speaks of one revision."""

    def __init__(self, name: str, channel: grpc.Channel, caller: Caller) -> None:
        self.name = as_text(name, "name")
        self._caller = caller
        self._sessions = sessions_pb2_grpc.SessionServiceStub(channel)
        self._queries = queries_pb2_grpc.QueryServiceStub(channel)
        self._backups = backups_pb2_grpc.BackupServiceStub(channel)

    def info(self, *, timeout: float | None = None) -> SessionInfo:
        """What the session is and holds now."""
        request = sessions_pb2.GetSessionRequest(name=self.name)
        reply = self._caller.unary(self._sessions.GetSession, request, timeout, repeatable=True)
        return info_from_proto(reply.session)

    @property
    def revision(self) -> int:
        """Number of committed batches. One call."""
        return self.info().revision

    @property
    def counts(self) -> Counts:
        """Live entities of each kind. One call."""
        return self.info().counts

    def neighbors(
        self,
        from_kind: KindLike,
        to_kind: KindLike,
        ids: Selection = None,
        *,
        rings: int = 1,
        boundary_only: bool = False,
        box: ArrayLike | None = None,
        as_of_revision: int = 0,
        timeout: float | None = None,
    ) -> Csr:
        """One of the 16 neighbour relations for many entities.

        The same kind twice means adjacent: vertices through an edge, edges through a vertex, faces through an
        edge, cells through a face. Lower dimension asked of higher comes in template order, everything else
        ascending.

        Parameters
        ----------
        from_kind, to_kind : "vertex", "edge", "face" or "cell"
        ids : uint32[n], slice or None
            Entities of `from_kind`; a slice means all live ones in that range, None all live ones.
        rings : int
            What lies in at most so many steps to an adjacent entity: 1 to 1000; more than 1 only from a kind to
            itself.
        boundary_only : bool
            Leave out entities of `from_kind` that are not on the boundary. Not for cells.
        box : float64[2, 3] or None
            Low and high corner: leave out entities of `from_kind` whose bounding box does not meet this one.
        as_of_revision : int
            The revision at which `ids` were read: an id whose occupant was born later is refused with
            `NotFoundError` ENTITY_REMOVED. 0: the current one.

        Raises
        ------
        NotFoundError
            ENTITY_REMOVED, UNKNOWN_ENTITY: `ids` that are not live.
        InvalidArgumentError
            For what makes no sense: a box with low above high, rings between kinds, ...
        ResourceExhaustedError
            LIMIT_EXCEEDED: more work or a larger answer than the server allows.
        """
        asked = {"from": int(as_kind(from_kind)), "to": int(as_kind(to_kind)), "rings": as_count(rings, "rings")}
        requests = [
            queries_pb2.GetNeighborsRequest(**asked, **self._selected(part, as_of_revision))
            for part in selections_of(ids, **_filters(boundary_only, box))
        ]
        return read_neighbors(self._replies(self._queries.GetNeighbors, requests, timeout))

    def entities(
        self,
        kind: KindLike,
        ids: Selection = None,
        *,
        boundary_only: bool = False,
        box: ArrayLike | None = None,
        as_of_revision: int = 0,
        timeout: float | None = None,
    ) -> Entities:
        """Vertices, types and flags of entities; positions of vertices. Parameters as in `neighbors`."""
        of_kind = as_kind(kind)
        requests = [
            queries_pb2.GetEntitiesRequest(kind=int(of_kind), **self._selected(part, as_of_revision))
            for part in selections_of(ids, **_filters(boundary_only, box))
        ]
        return read_entities(of_kind, self._replies(self._queries.GetEntities, requests, timeout))

    def positions(
        self, ids: Selection = None, *, as_of_revision: int = 0, timeout: float | None = None
    ) -> Points:
        """Positions of vertices: float64[n, 3], in order of `ids`."""
        return self.entities("vertex", ids, as_of_revision=as_of_revision, timeout=timeout).positions

    def boundary(self, kind: KindLike, *, timeout: float | None = None) -> Ids:
        """Ids of the entities on the boundary, uint32[n], ascending.

        Faces: with exactly one cell. Edges: of those, and with exactly one face. Vertices: of those.
        """
        request = queries_pb2.GetBoundaryRequest(session=self.name, kind=int(as_kind(kind)))
        return read_boundary(self._caller.stream(self._queries.GetBoundary, request, timeout))[0]

    def boundary_surface(self, position_bits: int = 14, *, timeout: float | None = None) -> Surface:
        """The boundary for viewers, as a Draco mesh with `position_bits` (1-30) for each axis."""
        bits = as_int64(position_bits, "position_bits", *INT32)
        request = queries_pb2.GetBoundarySurfaceRequest(session=self.name, position_bits=bits)
        return read_surface(self._caller.stream(self._queries.GetBoundarySurface, request, timeout))

    def snapshot(self, *, progress: bool | None = None, timeout: float | None = None) -> Snapshot:
        """Everything at one revision. `progress`: whether to show a bar; default: on a terminal."""
        reader = ExportReader()
        request = sessions_pb2.ExportMeshRequest(session=self.name)
        with Progress("exporting", progress) as bar:
            if bar.shown:
                info = self.info()
                bar.set("exporting", 0, info.counts.vertices + sum(info.element_counts))
            for reply in self._caller.stream(
                self._sessions.ExportMesh, request, FOREVER if timeout is None else timeout
            ):
                bar.add(reader.add(reply))
        return reader.snapshot()

    def to_meshio(
        self, *, slots: bool = True, progress: bool | None = None, timeout: float | None = None
    ) -> meshio.Mesh:
        """Everything at one revision, for meshio: see `Snapshot.to_meshio`."""
        return self.snapshot(progress=progress, timeout=timeout).to_meshio(slots=slots)

    def export(
        self,
        path: PathLike,
        file_format: str | None = None,
        *,
        slots: bool = True,
        progress: bool | None = None,
        timeout: float | None = None,
    ) -> Snapshot:
        """Writes everything to a file, in the format that its name implies; returns what was written."""
        if not isinstance(path, (str, os.PathLike)):
            raise bad_argument("path", f"path is no file name: {path!r}")
        snapshot = self.snapshot(progress=progress, timeout=timeout)
        snapshot.write(path, file_format, slots=slots)
        return snapshot

    def backup(
        self, path: PathLike, *, progress: bool | None = None, timeout: float | None = None
    ) -> BackupResult:
        """Writes the session as it is now to a file, from which `Client.restore_backup` makes a session.

        Others go on editing; the file holds one revision, to the last id and stamp, attributes and settings. A file
        of that name is replaced when the backup is whole and on disk, and else stays as it is.

        Parameters
        ----------
        path : str or path
        timeout : float, optional
            Default: none, as it takes as long as it takes.

        Raises
        ------
        ResourceExhaustedError
            LIMIT_EXCEEDED ``max_backup_bytes``: other backups have not been read yet.
        DeadlineExceededError
            IMPORT_IDLE: the file was not written for so long (a minute by default) that the server let go.
        OSError
            The file cannot be written.
        """
        request = backups_pb2.BackupSessionRequest(session=self.name)
        seconds = FOREVER if timeout is None else timeout
        with Progress("backing up", progress) as bar:
            return write_backup(self._caller.stream(self._backups.BackupSession, request, seconds), path, bar)

    def _selected(self, selection: types_pb2.Selection, as_of_revision: int) -> dict[str, Any]:
        return {"session": self.name, "selection": selection, "as_of_revision": as_int64(as_of_revision, "as_of_revision")}


def _filters(boundary_only: bool, box: ArrayLike | None) -> dict[str, Any]:
    return {"boundary_only": bool(boundary_only), "box": None if box is None else box_message(box)}
