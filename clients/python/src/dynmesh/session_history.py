"""The part of a session that knows what it was before: revisions, going back, forks and snapshots."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TypeVar

import grpc
from google.protobuf import field_mask_pb2

from ._calls import Caller
from .arguments import as_count, as_int64, as_request_id, as_revision, as_text, bad_argument
from .durability import durability_to_proto
from .info import SessionInfo, info_from_proto
from .retention import Retention, retention_to_proto
from .revisions import (
    RestoreResult,
    Revision,
    SnapshotInfo,
    restoration_from_proto,
    revision_from_proto,
    revision_or_snapshot,
    snapshot_from_proto,
)
from .session_changes import SessionChanges
from .session_reader import FOREVER
from .v1 import history_pb2, history_pb2_grpc, sessions_pb2

_PAGE_SIZE = 200

_Session = TypeVar("_Session", bound="SessionHistory")


class SessionHistory(SessionChanges):
    """Lists what one session was, goes back to it, and begins other sessions with it.

    For sessions that are kept on disk: those with ``durability="none"`` have no revision but the present one
    (`FailedPreconditionError` NO_HISTORY), which can be forked.
    """

    def __init__(self, name: str, channel: grpc.Channel, caller: Caller) -> None:
        super().__init__(name, channel, caller)
        self._channel = channel
        self._history = history_pb2_grpc.HistoryServiceStub(channel)

    def revisions(self, limit: int | None = None, *, timeout: float | None = None) -> Iterator[Revision]:
        """Revisions that can be gone back to, the last one first: who made them, when and how.

        They are fetched in pages, when they are wanted; `timeout` is that of each page.

        Parameters
        ----------
        limit : int, optional
            No more than so many. Default: all that the session's retention has kept.

        Examples
        --------
        >>> for revision in session.revisions(10):
        ...     print(revision.revision, revision.kind, revision.author, revision.message)
        """
        return self._revisions(None if limit is None else as_count(limit, "limit"), timeout)

    def restore(
        self,
        revision: int | None = None,
        *,
        snapshot: str | None = None,
        if_revision: int | None = None,
        request_id: str | None = None,
        validate_only: bool = False,
        author: str | None = None,
        message: str | None = None,
        timeout: float | None = None,
    ) -> RestoreResult:
        """Puts the session back to what it was, as one new revision that mirrors follow and `undo` takes back.

        Vertices, elements and attributes have the ids that they had; what had ended meanwhile counts as born at the
        new revision (``as_of_revision``). Attributes added since stay, without their rows, and settings stay. Takes
        as long as loading the session, while others go on editing; these wait only while what differs is applied.

        Parameters
        ----------
        revision : int, optional
            One of `revisions`. Either this or `snapshot`.
        snapshot : str, optional
            One of `snapshots`.
        if_revision, request_id, validate_only, author, message
            As in `edit`. With ``validate_only`` the result has the checksum and counts that would be.
        timeout : float, optional
            Default: none, as it takes as long as it takes.

        Raises
        ------
        OutOfRangeError
            REVISION_GONE: ``metadata["oldest"]`` and all later ones can be had. REVISION_IN_FUTURE.
        NotFoundError
            SNAPSHOT_NOT_FOUND.
        """
        target = revision_or_snapshot("target_revision", revision, snapshot)
        if not target:
            raise bad_argument("revision", "say what to go back to: a revision or a snapshot")
        request = history_pb2.RestoreSessionRequest(
            session=self.name,
            if_revision=as_revision(if_revision),
            request_id=as_request_id(request_id),
            validate_only=bool(validate_only),
            note=self._caller.note(author, message),
            **target,
        )
        seconds = FOREVER if timeout is None else timeout
        reply = self._caller.unary(self._history.RestoreSession, request, seconds, repeatable=True)
        return restoration_from_proto(reply)

    def fork(
        self: _Session,
        name: str,
        revision: int | None = None,
        snapshot: str | None = None,
        durability: str | None = None,
        *,
        request_id: str | None = None,
        author: str | None = None,
        message: str | None = None,
        timeout: float | None = None,
    ) -> _Session:
        """Makes a session that begins with what this one is or was, and goes on alone.

        It goes on from the same revision, with the same ids and settings, without snapshots and what can be undone.

        Parameters
        ----------
        name : str
            Of the new session.
        revision : int, optional
            One of `revisions`. Default: as it is now.
        snapshot : str, optional
            Instead: one of `snapshots`.
        durability : "none", "async" or "sync", optional
            Default: as here.
        request_id, author, message
            As in `edit`.
        timeout : float, optional
            Default: none, as it takes as long as it takes.

        Raises
        ------
        OutOfRangeError, NotFoundError
            As `restore`.
        AlreadyExistsError, InvalidArgumentError, FailedPreconditionError
            As `Client.create_session`.
        """
        request = history_pb2.ForkSessionRequest(
            session=self.name,
            name=as_text(name, "name"),
            durability=durability_to_proto(durability),
            request_id=as_request_id(request_id),
            note=self._caller.note(author, message),
            **revision_or_snapshot("source_revision", revision, snapshot),
        )
        seconds = FOREVER if timeout is None else timeout
        self._caller.unary(self._history.ForkSession, request, seconds, repeatable=True)
        return type(self)(name, self._channel, self._caller)

    def create_snapshot(
        self,
        name: str,
        revision: int | None = None,
        *,
        author: str | None = None,
        message: str | None = None,
        timeout: float | None = None,
    ) -> SnapshotInfo:
        """Gives a revision a name, under which it is kept until `delete_snapshot`, whatever the retention.

        Takes no time; what has not changed since is on disk once. For all that the session holds, as arrays, see
        `snapshot`.

        Parameters
        ----------
        name : str
            As those of sessions.
        revision : int, optional
            One of `revisions`. Default: the last one.
        author, message
            As in `edit`: of the snapshot.

        Raises
        ------
        AlreadyExistsError
            SNAPSHOT_EXISTS.
        OutOfRangeError
            As `restore`.
        ResourceExhaustedError
            LIMIT_EXCEEDED max_snapshots: 1000 of a session.
        """
        request = history_pb2.CreateSnapshotRequest(
            session=self.name,
            name=as_text(name, "name"),
            revision=0 if revision is None else as_int64(revision, "revision", 1),
            note=self._caller.note(author, message),
        )
        reply = self._caller.unary(self._history.CreateSnapshot, request, timeout, repeatable=False)
        return snapshot_from_proto(reply.snapshot)

    def snapshots(self, *, timeout: float | None = None) -> list[SnapshotInfo]:
        """All revisions that have a name, by name."""
        request = history_pb2.ListSnapshotsRequest(session=self.name)
        reply = self._caller.unary(self._history.ListSnapshots, request, timeout, repeatable=True)
        return [snapshot_from_proto(snapshot) for snapshot in reply.snapshots]

    def delete_snapshot(self, name: str, *, timeout: float | None = None) -> None:
        """Takes a name from its revision, which stays if the retention keeps it.

        Raises `NotFoundError` SNAPSHOT_NOT_FOUND.
        """
        request = history_pb2.DeleteSnapshotRequest(session=self.name, name=as_text(name, "name"))
        self._caller.unary(self._history.DeleteSnapshot, request, timeout, repeatable=False)

    def set_retention(
        self, retention: Retention, *, etag: str = "", timeout: float | None = None
    ) -> SessionInfo:
        """Keeps just these earlier revisions from now on, besides snapshots; no revision is made.

        >>> session.set_retention(dynmesh.Retention(max_revisions=1000, max_age=7 * 86400))

        Parameters
        ----------
        retention : Retention
            Without arguments: as the daemon says.
        etag : str, optional
            As in `Session.delete`.
        """
        settings = sessions_pb2.SessionSettings(retention=retention_to_proto(retention))
        request = sessions_pb2.UpdateSessionRequest(
            session=sessions_pb2.Session(name=self.name, etag=as_text(etag, "etag"), settings=settings),
            update_mask=field_mask_pb2.FieldMask(paths=["settings.retention"]),
        )
        # As in store_relations: an update changes the etag.
        reply = self._caller.unary(self._sessions.UpdateSession, request, timeout, repeatable=not etag)
        return info_from_proto(reply.session)

    def _revisions(self, left: int | None, timeout: float | None) -> Iterator[Revision]:
        token = ""
        while left is None or left > 0:
            size = _PAGE_SIZE if left is None else min(left, _PAGE_SIZE)
            request = history_pb2.ListRevisionsRequest(session=self.name, page_size=size, page_token=token)
            page = self._caller.unary(self._history.ListRevisions, request, timeout, repeatable=True)
            yield from map(revision_from_proto, page.revisions)
            token = page.next_page_token
            if not token:
                return
            left = None if left is None else left - len(page.revisions)
