"""Attaching to a daemon."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from types import MappingProxyType, TracebackType

import grpc

from ._calls import DEFAULT_MAX_MESSAGE_BYTES, Caller
from .arguments import as_int64, as_request_id, as_text, as_word
from .backups import RestoredBackup, open_backup, read_restore, restore_requests
from .checks import CheckSettings, checks_to_proto
from .durability import durability_to_proto
from .files import PathLike
from .info import SessionInfo, info_from_proto
from .progress import Progress
from .relations import RelationLike, relations_to_proto
from .retention import Retention, retention_to_proto
from .session import Session
from .session_reader import FOREVER
from .v1 import backups_pb2, backups_pb2_grpc, sessions_pb2, sessions_pb2_grpc

DEFAULT_TARGET = "127.0.0.1:7447"
DEFAULT_TIMEOUT_S = 60.0

_PAGE_SIZE = 1000
_LEAST_WINDOW = 64 << 10
_POLICIES = {"keep": sessions_pb2.DUPLICATE_POLICY_KEEP, "refuse": sessions_pb2.DUPLICATE_POLICY_REFUSE}
_CHANNEL_OPTIONS = (
    ("grpc.max_receive_message_length", -1),  # deltas are as large as the server's own limit allows
    ("grpc.max_send_message_length", -1),  # Caller.check_size and the server refuse what is too large
    ("grpc.keepalive_time_ms", 30_000),  # a mirror learns of a peer that vanished; the server allows it
    ("grpc.keepalive_timeout_ms", 10_000),
    ("grpc.http2.max_pings_without_data", 0),
    ("grpc.initial_reconnect_backoff_ms", 100),
    ("grpc.max_reconnect_backoff_ms", 2000),
    ("grpc.use_local_subchannel_pool", 1),  # clients of one process have connections of their own
)


class Client:
    """A connection to a daemon; made by `dynmesh.connect`.

    Thread safety: everything may be called from any thread.
    """

    def __init__(self, target: str, caller: Caller, read_ahead_bytes: int | None) -> None:
        self.target = as_text(target, "target")
        options = (*_CHANNEL_OPTIONS, *_window_options(read_ahead_bytes))
        self._caller = caller
        self._channel = grpc.insecure_channel(target, options=options)
        self._sessions = sessions_pb2_grpc.SessionServiceStub(self._channel)
        self._backups = backups_pb2_grpc.BackupServiceStub(self._channel)

    def __repr__(self) -> str:
        return f"<dynmesh.Client {self.target!r}>"

    def __enter__(self) -> Client:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Closes the connection; mirrors that use it end."""
        self._channel.close()

    def session(self, name: str) -> Session:
        """The session `name`, which need not exist yet. No call."""
        return Session(name, self._channel, self._caller)

    def create_session(
        self,
        name: str,
        *,
        duplicates: str = "keep",
        durability: str | None = None,
        stored_relations: Iterable[RelationLike] = (),
        checks: CheckSettings = MappingProxyType({}),
        retention: Retention | None = None,
        request_id: str | None = None,
        timeout: float | None = None,
    ) -> Session:
        """Makes an empty session at revision 0.

        Parameters
        ----------
        name : str
            1-64 characters of [A-Za-z0-9_.-], beginning with a letter or digit.
        duplicates : "keep" or "refuse"
            What happens to an element that equals a live one (same type, same vertices up to symmetry).
        durability : "none", "async" or "sync", optional
            When edits are acknowledged: at once, and the session ends with the daemon; once written, which a
            loss of power may undo for a moment; once on disk. Default: "sync" where the daemon has a data
            directory, else "none".
        stored_relations : iterable of (kind, kind)
            Relations to keep as tables: as in `Session.store_relations`.
        checks : mapping of str to severity, or to (severity, threshold)
            Made on each batch of edits: as in `Session.set_checks`.
        retention : Retention, optional
            Which earlier revisions stay: as in `Session.set_retention`. Default: what the daemon says.
        request_id : str, optional
            A retry with the same id gets the first answer. Default: a new one.

        Raises
        ------
        AlreadyExistsError, InvalidArgumentError
        FailedPreconditionError
            NO_STORE: the daemon has no data directory.
        """
        made = self.session(name)
        settings = sessions_pb2.SessionSettings(
            duplicate_policy=_POLICIES[as_word(duplicates, _POLICIES, "duplicates")],
            durability=durability_to_proto(durability),
            stored_relations=relations_to_proto(stored_relations),
            checks=checks_to_proto(checks),
            retention=None if retention is None else retention_to_proto(retention),
        )
        request = sessions_pb2.CreateSessionRequest(
            name=name,
            settings=settings,
            request_id=as_request_id(request_id),
        )
        self._caller.unary(self._sessions.CreateSession, request, timeout, repeatable=True)
        return made

    def restore_backup(
        self,
        path: PathLike,
        name: str | None = None,
        *,
        durability: str | None = None,
        validate_only: bool = False,
        request_id: str | None = None,
        progress: bool | None = None,
        timeout: float | None = None,
    ) -> RestoredBackup:
        """Makes a session of a file that `Session.backup` wrote, on any daemon.

        It begins at the revision that was backed up, with all ids and stamps. But it is another session than that
        was: mirrors begin anew, and there is nothing to undo. Nobody sees it before it is whole.

        Parameters
        ----------
        path : str or path
        name : str, optional
            Of the new session. Default: that of the one that was backed up.
        durability : "none", "async" or "sync", optional
            As in `create_session`. Default: that of the one that was backed up.
        validate_only : bool
            The backup is checked and the result computed, but no session is made.
        request_id : str, optional
            As in `create_session`.
        timeout : float, optional
            Default: none, as it takes as long as it takes.

        Raises
        ------
        DataLossError
            BACKUP_DAMAGED: ``metadata["byte"]`` is where in the file.
        AlreadyExistsError
            SESSION_EXISTS.
        FailedPreconditionError
            BACKUP_FORMAT_NEWER; NO_STORE: the daemon has no data directory.
        OSError
            The file cannot be read.
        """
        header = backups_pb2.RestoreHeader(
            name="" if name is None else as_text(name, "name"),
            durability=durability_to_proto(durability),
            request_id=as_request_id(request_id),
            validate_only=bool(validate_only),
        )
        seconds = FOREVER if timeout is None else timeout
        with open_backup(path) as file, Progress("restoring", progress) as bar:
            requests = restore_requests(header, file, bar)
            reply = self._caller.upload(self._backups.RestoreBackup, requests, seconds)
        return read_restore(self.session(reply.session.name), reply)

    def sessions(self, *, timeout: float | None = None) -> Iterator[SessionInfo]:
        """All sessions by name, fetched in pages; `timeout` is that of each page."""
        token = ""
        while True:
            request = sessions_pb2.ListSessionsRequest(page_size=_PAGE_SIZE, page_token=token)
            page = self._caller.unary(self._sessions.ListSessions, request, timeout, repeatable=True)
            yield from map(info_from_proto, page.sessions)
            token = page.next_page_token
            if not token:
                return

    def delete_session(self, name: str, *, etag: str = "", timeout: float | None = None) -> int:
        """Deletes a session: as `Session.delete`."""
        return self.session(name).delete(etag=etag, timeout=timeout)


def connect(
    target: str = DEFAULT_TARGET,
    *,
    timeout: float = DEFAULT_TIMEOUT_S,
    retries: int = 2,
    max_message_bytes: int = DEFAULT_MAX_MESSAGE_BYTES,
    read_ahead_bytes: int | None = None,
    author: str | None = None,
) -> Client:
    """Attaches to a daemon. Returns at once: the first call finds out whether one is there.

    Parameters
    ----------
    target : str
        "host:port" or "unix:/path".
    timeout : float
        Seconds that a call may take unless it says otherwise; ``float("inf")`` for no limit.
    retries : int
        How often reading calls, and edits by their request ids, are repeated when nobody answers.
    max_message_bytes : int
        The server's flag of that name, where it is not the default. A request of more than four times that is
        not sent, because gRPC would refuse it at the other end without saying why.
    read_ahead_bytes : int, optional
        How much of each answer the server may send ahead of what has been read, 64 KiB at least. By default as
        much as keeps the line busy, up to some megabytes; what a slow mirror has not read yet is that much out
        of date. Over a line that is both fast and far, a small number makes answers slow.
    author : str, optional
        Who makes the revisions of this client, at most 256 bytes: `Session.revisions` tells it again, and nobody
        checks it. Default: nobody is named.
    """
    return Client(target, Caller(timeout, retries, max_message_bytes, author), read_ahead_bytes)


def _window_options(read_ahead_bytes: int | None) -> tuple[tuple[str, int], ...]:
    if read_ahead_bytes is None:
        return ()
    window = as_int64(read_ahead_bytes, "read_ahead_bytes", _LEAST_WINDOW, 2**31 - 1)
    return ("grpc.http2.bdp_probe", 0), ("grpc.http2.lookahead_bytes", window)
