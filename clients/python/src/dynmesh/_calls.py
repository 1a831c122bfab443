"""How every call is made: a deadline, errors as `DynmeshError`, and retries where they are harmless."""

from __future__ import annotations

import random
import time
from collections.abc import Callable, Iterable, Iterator
from typing import Any, TypeVar

import grpc

from .arguments import as_int64, as_seconds, as_text
from .errors import DynmeshError, ResourceExhaustedError, UnavailableError, from_rpc_error
from .v1 import types_pb2

Reply = TypeVar("Reply")

# What dynmeshd's flag of that name is by default; gRPC refuses messages that are larger by this factor.
DEFAULT_MAX_MESSAGE_BYTES = 4 << 20
HARD_MESSAGE_FACTOR = 4

_FIRST_BACKOFF_S = 0.05
_MAX_BACKOFF_S = 2.0
_NO_LIMIT_S = 1e9  # decades; what gRPC takes for the past is far beyond


class Backoff:
    """Growing pauses between attempts, with jitter so that many clients do not return in step."""

    def __init__(self) -> None:
        self._next_s = _FIRST_BACKOFF_S

    def reset(self) -> None:
        """Starts again with the shortest pause."""
        self._next_s = _FIRST_BACKOFF_S

    def next_s(self) -> float:
        """Seconds to wait before the next attempt."""
        pause = self._next_s * random.uniform(0.75, 1.25)
        self._next_s = min(2 * self._next_s, _MAX_BACKOFF_S)
        return pause


class Caller:
    """Makes the calls of one client.

    Parameters
    ----------
    timeout : float
        Seconds that a call may take unless it says otherwise; ``math.inf`` for no limit.
    retries : int
        How often a call that may be repeated is repeated when nobody answers.
    max_message_bytes : int
        The server's limit of that name.
    author : str, optional
        Who makes revisions, where a call does not say otherwise.
    """

    def __init__(
        self,
        timeout: float,
        retries: int,
        max_message_bytes: int = DEFAULT_MAX_MESSAGE_BYTES,
        author: str | None = None,
    ) -> None:
        self._timeout = as_seconds(timeout)
        self._retries = as_int64(retries, "retries", 0)
        self._max_message_bytes = as_int64(max_message_bytes, "max_message_bytes", 1)
        self._author = "" if author is None else as_text(author, "author")

    def note(self, author: str | None, message: str | None) -> types_pb2.RevisionNote:
        """What is said of a revision; without an author it is the client's."""
        return types_pb2.RevisionNote(
            author=self._author if author is None else as_text(author, "author"),
            message="" if message is None else as_text(message, "message"),
        )

    def check_size(self, request: Any) -> None:
        """Refuses a message that gRPC would refuse at the other end without saying why.

        Raises `ResourceExhaustedError` LIMIT_EXCEEDED (max_message_bytes).
        """
        size = request.ByteSize()
        if size <= HARD_MESSAGE_FACTOR * self._max_message_bytes:
            return  # what is a little too large the server refuses by name, and knows its limit better
        limit = self._max_message_bytes
        raise ResourceExhaustedError(
            f"max_message_bytes is limited to {limit}, and {size} was asked for",
            reason="LIMIT_EXCEEDED",
            metadata={"limit": "max_message_bytes", "value": str(limit), "requested": str(size)},
        )

    def unary(
        self, method: Callable[..., Reply], request: Any, timeout: float | None, *, repeatable: bool
    ) -> Reply:
        """One request, one reply. `repeatable`: doing it twice is the same as doing it once."""
        self.check_size(request)
        deadline = time.monotonic() + self._seconds(timeout)
        backoff = Backoff()
        for left in reversed(range(self._retries + 1 if repeatable else 1)):
            try:
                return _once(method, request, deadline)
            except UnavailableError:
                pause = backoff.next_s()
                if left == 0 or time.monotonic() + pause >= deadline:
                    raise
                time.sleep(pause)
        raise AssertionError("the last attempt returns or raises")

    def stream(
        self, method: Callable[..., Iterable[Reply]], request: Any, timeout: float | None
    ) -> Iterator[Reply]:
        """The replies of a streaming call; cancelled when the iterator is dropped early."""
        broken: list[Exception] = []
        if hasattr(request, "ByteSize"):
            self.check_size(request)
        else:
            request = self._checked(request, broken)
        call = method(request, timeout=_grpc_timeout(self._seconds(timeout)))
        try:
            yield from call
        except grpc.RpcError as error:
            raise broken[0] if broken else from_rpc_error(error) from None
        finally:
            call.cancel()  # type: ignore[attr-defined]

    def upload(self, method: Any, requests: Iterable[Any], timeout: float | None) -> Any:
        """The reply to a stream of requests; cancelled when that is interrupted. Errors of `requests` pass through."""
        broken: list[Exception] = []
        call = method.future(self._checked(requests, broken), timeout=_grpc_timeout(self._seconds(timeout)))
        try:
            return call.result()
        except (grpc.RpcError, grpc.FutureCancelledError) as error:
            if broken:
                raise broken[0] from None
            raise from_rpc_error(call if isinstance(error, grpc.FutureCancelledError) else error) from None
        finally:
            call.cancel()

    def _checked(self, requests: Iterable[Any], broken: list[Exception]) -> Iterator[Any]:
        """`requests` up to one that is too large or cannot be made, which breaks the call; `broken` gets the error."""
        try:
            for request in requests:
                self.check_size(request)
                yield request
        except Exception as error:
            broken.append(error)
            raise

    def _seconds(self, timeout: float | None) -> float:
        return self._timeout if timeout is None else as_seconds(timeout)


def _once(method: Callable[..., Reply], request: Any, deadline: float) -> Reply:
    try:
        return method(request, timeout=_grpc_timeout(max(deadline - time.monotonic(), 0.0)))
    except grpc.RpcError as error:
        raise from_rpc_error(error) from None


def _grpc_timeout(seconds: float) -> float | None:
    return None if seconds > _NO_LIMIT_S else seconds
