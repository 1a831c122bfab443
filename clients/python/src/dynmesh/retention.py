"""How many earlier revisions of a session stay."""

from __future__ import annotations

from typing import NamedTuple

from google.protobuf import duration_pb2

from .arguments import as_int64, as_number, bad_argument
from .v1 import sessions_pb2

_MAX_AGE_S = 315_576_000_000  # what the message holds; the server allows less


class Retention(NamedTuple):
    """Which of a session's last revisions can be gone back to. Each field of 0 is as the daemon says.

    Those that any of the limits lets go are deleted some time later; those that have a snapshot are not.
    """

    max_revisions: int = 0
    max_age: float = 0.0  # seconds
    max_bytes: int = 0  # on disk, of their records

    def __str__(self) -> str:
        limits = [f"{self.max_revisions} revisions"] if self.max_revisions else []
        limits += [f"{self.max_age:g} s"] if self.max_age else []
        limits += [f"{self.max_bytes / 2**20:.1f} MiB"] if self.max_bytes else []
        return f"at most {', '.join(limits)}" if limits else "as the daemon says"


def retention_to_proto(retention: Retention) -> sessions_pb2.Retention:
    """The message."""
    if not isinstance(retention, Retention):
        raise bad_argument("retention", f"retention is no dynmesh.Retention: {retention!r}")
    message = sessions_pb2.Retention(
        max_revisions=as_int64(retention.max_revisions, "max_revisions", 0, 2**32 - 1),
        max_bytes=as_int64(retention.max_bytes, "max_bytes", 0),
    )
    if age := as_number(retention.max_age, "max_age"):
        message.max_age.CopyFrom(_duration(age))
    return message


def retention_from_proto(message: sessions_pb2.Retention) -> Retention:
    """The message as `Retention`."""
    age = message.max_age
    return Retention(message.max_revisions, age.seconds + age.nanos / 1e9, message.max_bytes)


def _duration(seconds: float) -> duration_pb2.Duration:
    if not 0 <= seconds <= _MAX_AGE_S:  # NaN too
        raise bad_argument("max_age", f"max_age is from 0 to {_MAX_AGE_S} seconds, not {seconds}")
    whole = int(seconds)
    return duration_pb2.Duration(seconds=whole, nanos=int((seconds - whole) * 1e9))
