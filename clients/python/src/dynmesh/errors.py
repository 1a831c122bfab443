"""Errors of dynmesh: one class for each gRPC status code, each of them also the fitting builtin.

Match on the class or on ``reason`` (``"ENTITY_REMOVED"``, ``"REVISION_MISMATCH"``, ...), never on the text:

>>> try:
...     session.positions([7])
... except dynmesh.NotFoundError as error:
...     error.reason, error.ids
('ENTITY_REMOVED', (7,))
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import grpc

_DETAILS_KEY = "grpc-status-details-bin"
_ERROR_INFO = "google.rpc.ErrorInfo"


class DynmeshError(Exception):
    """Root of everything that dynmesh raises on purpose.

    Attributes
    ----------
    message : str
        What went wrong, for humans.
    reason : str
        Stable and machine-readable; empty if the error did not come from dynmesh itself.
    metadata : dict of str to str
        What offended: ``"ids"``, ``"index"``, ``"edit"``, ``"limit"``, ...
    """

    def __init__(self, message: str, *, reason: str = "", metadata: Mapping[str, str] | None = None) -> None:
        super().__init__(message)
        self.message = message
        self.reason = reason
        self.metadata = dict(metadata or {})

    def __str__(self) -> str:
        where = ", ".join(f"{key} {self.metadata[key]}" for key in ("edit", "index") if key in self.metadata)
        text = f"{self.message} ({where})" if where else self.message
        return f"{text} [{self.reason}]" if self.reason else text

    def __reduce__(self) -> tuple[Any, ...]:
        return _rebuild, (type(self), self.message, self.reason, self.metadata)

    @property
    def ids(self) -> tuple[int, ...]:
        """Ids that offended: the first 16 of them at most, of a conflict the first 100."""
        return tuple(int(part) for part in self.metadata.get("ids", "").split(",") if part.isdigit())

    @property
    def revision(self) -> int | None:
        """Revision that the error speaks of, where it names one."""
        text = self.metadata.get("revision", "")
        return int(text) if text.isdigit() else None


def _rebuild(kind: type[DynmeshError], message: str, reason: str, metadata: dict[str, str]) -> DynmeshError:
    return kind(message, reason=reason, metadata=metadata)


class InvalidArgumentError(DynmeshError, ValueError):
    """Wrong whatever the state of the session."""


class NotFoundError(DynmeshError, LookupError):
    """No such session, or no such live entity."""


class AlreadyExistsError(DynmeshError, ValueError):
    """The name is taken."""


class FailedPreconditionError(DynmeshError, RuntimeError):
    """The state of the mesh forbids it."""


class AbortedError(DynmeshError, RuntimeError):
    """Somebody else changed it first."""


class ConflictError(AbortedError):
    """Somebody else changed what the batch touches: ``conflict_policy="touched"``. Read again, and try again."""

    @property
    def changed_revision(self) -> int | None:
        """The latest revision that changed one of `ids`."""
        text = self.metadata.get("changed_revision", "")
        return int(text) if text.isdigit() else None


class OutOfRangeError(DynmeshError, IndexError):
    """A revision that lies in the future."""


class ResourceExhaustedError(DynmeshError, RuntimeError):
    """A limit of the server; ``metadata["limit"]`` names it."""


class UnavailableError(DynmeshError, ConnectionError):
    """Nobody answers at the target, or the server is shutting down."""


class DeadlineExceededError(DynmeshError, TimeoutError):
    """No answer within ``timeout``."""


class DataLossError(DynmeshError, RuntimeError):
    """A damaged payload or store."""


class CancelledError(DynmeshError, RuntimeError):
    """The call was cancelled."""


class UnauthenticatedError(DynmeshError, PermissionError):
    """The server wants to know who calls."""


class PermissionDeniedError(DynmeshError, PermissionError):
    """The caller may not do that."""


class UnimplementedError(DynmeshError, NotImplementedError):
    """The server, or this installation, cannot do that."""


class InternalError(DynmeshError, RuntimeError):
    """A bug in the server."""


class MirrorError(DataLossError):
    """A mirror differs from its session and could not be repaired."""


class LaunchError(DynmeshError, RuntimeError):
    """A local daemon could not be started; the message holds the end of its log."""


class FileFormatError(InvalidArgumentError):
    """A mesh file that meshio cannot read or write."""


_BY_REASON: dict[str, type[DynmeshError]] = {"CONFLICT": ConflictError}

_BY_CODE: dict[int, type[DynmeshError]] = {
    1: CancelledError,
    3: InvalidArgumentError,
    4: DeadlineExceededError,
    5: NotFoundError,
    6: AlreadyExistsError,
    7: PermissionDeniedError,
    8: ResourceExhaustedError,
    9: FailedPreconditionError,
    10: AbortedError,
    11: OutOfRangeError,
    12: UnimplementedError,
    14: UnavailableError,
    15: DataLossError,
    16: UnauthenticatedError,
}


def make_error(
    code: int, message: str, reason: str = "", metadata: Mapping[str, str] | None = None
) -> DynmeshError:
    """The error of a reason or google.rpc.Code; codes that have no class of their own give `InternalError`."""
    kind = _BY_REASON.get(reason) or _BY_CODE.get(code, InternalError)
    return kind(message, reason=reason, metadata=metadata)


def from_rpc_error(error: grpc.RpcError) -> DynmeshError:
    """The same failure as a `DynmeshError`, with the reason and metadata of its google.rpc.ErrorInfo."""
    code = error.code() if isinstance(error, grpc.Call) else grpc.StatusCode.UNKNOWN
    message = (error.details() if isinstance(error, grpc.Call) else None) or str(error)
    reason, metadata = "", {}
    for key, value in _trailing_metadata(error):
        if key == _DETAILS_KEY:
            reason, metadata = parse_error_info(value)
    return make_error(code.value[0], message, reason, metadata)


def parse_error_info(status: bytes) -> tuple[str, dict[str, str]]:
    """Reason and metadata of the ErrorInfo in a serialised google.rpc.Status; ``("", {})`` if it has none.

    Read by hand, because neither grpcio-status nor googleapis-common-protos is everywhere.
    """
    try:
        for number, detail in _fields(status):
            if number != 3:  # Status.details
                continue
            packed = dict(_fields(detail))
            if packed.get(1, b"").endswith(_ERROR_INFO.encode()):
                return _read_error_info(packed.get(2, b""))
    except (IndexError, UnicodeDecodeError):  # somebody else's bytes: the code and message still stand
        pass
    return "", {}


def _trailing_metadata(error: grpc.RpcError) -> Any:
    return (error.trailing_metadata() if isinstance(error, grpc.Call) else None) or ()


def _read_error_info(message: bytes) -> tuple[str, dict[str, str]]:
    reason, metadata = "", dict[str, str]()
    for number, value in _fields(message):
        if number == 1:
            reason = value.decode()
        elif number == 3:
            entry = dict(_fields(value))
            metadata[entry.get(1, b"").decode()] = entry.get(2, b"").decode()
    return reason, metadata


def _fields(message: bytes) -> Iterator[tuple[int, bytes]]:
    """Length-delimited fields of a protobuf message; varints are passed over. IndexError if it is cut off."""
    at = 0
    while at < len(message):
        tag, at = _varint(message, at)
        value, at = _varint(message, at)
        if tag & 7 == 2:
            if at + value > len(message):
                raise IndexError("field runs past the end")
            yield tag >> 3, message[at : at + value]
            at += value
        elif tag & 7 != 0:
            raise IndexError("fixed-width fields are not used here")


def _varint(message: bytes, at: int) -> tuple[int, int]:
    value = shift = 0
    while True:
        byte = message[at]
        value |= (byte & 0x7F) << shift
        shift += 7
        at += 1
        if byte < 0x80:
            return value, at
