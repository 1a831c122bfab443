"""Backups of sessions in files: written whole or not at all, and read again into sessions."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

from .arguments import bad_argument
from .errors import InternalError
from .files import PathLike
from .info import SessionInfo, info_from_proto
from .progress import Progress
from .v1 import backups_pb2

if TYPE_CHECKING:
    from .session import Session

_PIECE_BYTES = 1 << 20


@dataclass(frozen=True)
class BackupResult:
    """What a backup holds.

    Attributes
    ----------
    info : SessionInfo
        The session as of the backup.
    file_bytes : int
        Size of the file.
    """

    info: SessionInfo
    file_bytes: int

    @property
    def revision(self) -> int:
        """That was backed up."""
        return self.info.revision


@dataclass(frozen=True)
class RestoredBackup:
    """What was made of a backup.

    Attributes
    ----------
    session : Session
        The new session. With ``validate_only`` there is none of that name.
    info : SessionInfo
        As it was right after.
    source_name, source_uid : str
        Of the session that was backed up.
    """

    session: Session
    info: SessionInfo
    source_name: str
    source_uid: str

    @property
    def revision(self) -> int:
        """At which the new session begins: that of the backup."""
        return self.info.revision


def write_backup(replies: Iterable[backups_pb2.BackupSessionResponse], path: PathLike, bar: Progress) -> BackupResult:
    """Writes a backup to a file; one that was there stays as it is unless the new one is whole and on disk.

    Raises `OSError` when the file cannot be written.
    """
    target = Path(_as_path(path))
    if not target.parent.is_dir():
        raise FileNotFoundError(f"no such folder: {target.parent}")
    with tempfile.TemporaryDirectory(prefix=f".{target.name}.", dir=target.parent) as folder:
        draft = Path(folder) / target.name
        with open(draft, "wb") as file:
            info = _write_replies(replies, file, bar)
            file.flush()
            os.fsync(file.fileno())
            size = file.tell()
        os.replace(draft, target)
    return BackupResult(info, size)


def open_backup(path: PathLike) -> BinaryIO:
    """The file of a backup. Raises `OSError` when it cannot be opened."""
    return open(_as_path(path), "rb")


def restore_requests(
    header: backups_pb2.RestoreHeader, file: BinaryIO, bar: Progress
) -> Iterator[backups_pb2.RestoreBackupRequest]:
    """The messages of a restore: `header`, then the file in pieces."""
    size = os.fstat(file.fileno()).st_size
    yield backups_pb2.RestoreBackupRequest(header=header)
    while piece := file.read(_PIECE_BYTES):
        yield backups_pb2.RestoreBackupRequest(data=piece)
        bar.set("restoring", file.tell(), size)


def read_restore(session: Session, reply: backups_pb2.RestoreBackupResponse) -> RestoredBackup:
    """What the daemon answered; `session` is the new one."""
    return RestoredBackup(session, info_from_proto(reply.session), reply.source_name, reply.source_uid)


def _write_replies(
    replies: Iterable[backups_pb2.BackupSessionResponse], file: BinaryIO, bar: Progress
) -> SessionInfo:
    info = None
    for reply in replies:
        if reply.HasField("session"):
            info = info_from_proto(reply.session)
        file.write(reply.data)
        bar.set("backing up", reply.done, reply.total)
    if info is None:
        raise InternalError("the backup ended without a session")
    return info


def _as_path(path: Any) -> str:
    if isinstance(path, (str, bytes, os.PathLike)):
        return os.fsdecode(path)
    raise bad_argument("path", f"path is no file name: {path!r}")
