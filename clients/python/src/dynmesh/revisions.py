"""What a session was before: its revisions, those that have a name, and what going back to one did."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from datetime import datetime, timezone
from typing import Any

from .arguments import as_int64, as_text, bad_argument
from .checksum import Checksum
from .info import Counts, checksum_from_proto, counts_from_proto
from .v1 import history_pb2


@dataclass(frozen=True)
class Revision:
    """A revision that a session can go back to, and how it was made.

    Attributes
    ----------
    revision : int
    kind : str
        "edit", "undo", "redo", "repair", "adaptation" (a step of one), "import", "restoration" or "creation" (what a
        fork, or a session that comes from a backup, began with).
    author, message : str
        What was said of it; nobody checked that. Empty if nothing was said.
    commit_time : datetime
    size_bytes : int
        On disk: of its record; of an import or a creation of all that it holds.
    request_id : str
        Of the request that made it; empty if that had none.
    """

    revision: int
    kind: str
    author: str
    message: str
    commit_time: datetime
    size_bytes: int
    request_id: str

    def to_dict(self) -> dict[str, Any]:
        """The same in the types of JSON."""
        return asdict(self) | {"commit_time": self.commit_time.isoformat()}


@dataclass(frozen=True)
class SnapshotInfo:
    """A revision that is kept under a name until `Session.delete_snapshot`.

    Attributes
    ----------
    name : str
    revision : int
    create_time : datetime
        Of the snapshot, not of the revision.
    author, message : str
        What was said of it when it was made.
    """

    name: str
    revision: int
    create_time: datetime
    author: str
    message: str

    def to_dict(self) -> dict[str, Any]:
        """The same in the types of JSON."""
        return asdict(self) | {"create_time": self.create_time.isoformat()}


@dataclass(frozen=True)
class RestoreResult:
    """What going back did or, if it was only validated, would have done.

    Attributes
    ----------
    revision : int
        After it; of ``validate_only`` the revision before.
    target_revision : int
        What was gone back to.
    checksum, counts : Checksum, Counts
        Of the session then; of ``validate_only`` what they would be.
    undoable_batches, redoable_batches, durable_revision : int
        As in `HistoryResult`.
    """

    revision: int
    target_revision: int
    checksum: Checksum
    counts: Counts
    undoable_batches: int
    redoable_batches: int
    durable_revision: int

    def to_dict(self) -> dict[str, Any]:
        """The same in the types of JSON; the checksum is a hexadecimal string."""
        return asdict(self) | {"checksum": str(self.checksum), "counts": self.counts._asdict()}


def revision_from_proto(message: history_pb2.Revision) -> Revision:
    """Revision message as `Revision`."""
    return Revision(
        revision=message.revision,
        kind=_kind_name(message.kind),
        author=message.note.author,
        message=message.note.message,
        commit_time=message.commit_time.ToDatetime(timezone.utc),
        size_bytes=message.size_bytes,
        request_id=message.request_id,
    )


def snapshot_from_proto(message: history_pb2.Snapshot) -> SnapshotInfo:
    """Snapshot message as `SnapshotInfo`."""
    return SnapshotInfo(
        name=message.name,
        revision=message.revision,
        create_time=message.create_time.ToDatetime(timezone.utc),
        author=message.note.author,
        message=message.note.message,
    )


def restoration_from_proto(reply: history_pb2.RestoreSessionResponse) -> RestoreResult:
    """The answer to RestoreSession."""
    return RestoreResult(
        revision=reply.revision,
        target_revision=reply.target_revision,
        checksum=checksum_from_proto(reply.checksum),
        counts=counts_from_proto(reply.counts),
        undoable_batches=reply.undoable_batches,
        redoable_batches=reply.redoable_batches,
        durable_revision=reply.durable_revision,
    )


def revision_or_snapshot(field: str, revision: int | None, snapshot: str | None) -> dict[str, Any]:
    """The field of a request that says which revision: `field`, ``snapshot``, or none of them."""
    if revision is not None and snapshot is not None:
        raise bad_argument("snapshot", "say either a revision or a snapshot, not both")
    if snapshot is not None:
        return {"snapshot": as_text(snapshot, "snapshot")}
    return {} if revision is None else {field: as_int64(revision, "revision", 0)}


def _kind_name(kind: history_pb2.RevisionKind.ValueType) -> str:
    try:
        name = history_pb2.RevisionKind.Name(kind)
    except ValueError:  # of a newer server
        name = f"kind_{kind}"
    return name.removeprefix("REVISION_KIND_").lower()
