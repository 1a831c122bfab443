"""Pipelined edits: batches follow each other without waiting for answers."""

from __future__ import annotations

import queue
import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from types import TracebackType
from typing import Any

import grpc

from .arguments import as_count
from .edit import EditBatch, as_batch
from .edit_result import EditResult
from .errors import CancelledError, DynmeshError, from_rpc_error, make_error
from .v1 import edits_pb2

_Pending = tuple[EditBatch, "Future[EditResult]"]


class EditStream:
    """Sends batches through one stream, which costs about a third of a call for each.

    >>> with session.edit_stream() as stream:
    ...     futures = [stream.submit(batch) for batch in batches]
    >>> [future.result().revision for future in futures]

    A refused batch fails its own future and the stream goes on; a broken stream fails all that are open, of
    which some may have been applied. Leaving the block waits for the answers.
    Thread safety: one thread submits.
    """

    def __init__(
        self,
        method: Callable[..., Any],
        make_request: Callable[[EditBatch, str | None], edits_pb2.ApplyEditsRequest],
        window: int,
        check_size: Callable[[Any], None],
    ) -> None:
        self._make_request = make_request
        self._check_size = check_size
        self._requests: queue.SimpleQueue[edits_pb2.StreamEditsRequest | None] = queue.SimpleQueue()
        self._pending: deque[_Pending] = deque()
        self._room = threading.Semaphore(as_count(window, "window"))
        self._lock = threading.Lock()
        self._broken: DynmeshError | None = None
        self._call = method(iter(self._requests.get, None))
        self._reader = threading.Thread(target=self._read, name="dynmesh-edit-stream", daemon=True)
        self._reader.start()

    def __enter__(self) -> EditStream:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is not None:
            self._call.cancel()
        self.close()

    def submit(self, batch: EditBatch, *, message: str | None = None) -> Future[EditResult]:
        """Sends a batch; its future holds the result or the error. Waits while the window is full.

        `message` says why, in place of the stream's.
        Raises `ResourceExhaustedError` LIMIT_EXCEEDED for a batch so large that it would end the stream.
        """
        future: Future[EditResult] = Future()
        future.set_running_or_notify_cancel()  # sent is sent
        request = edits_pb2.StreamEditsRequest(batch=self._make_request(as_batch(batch), message))
        self._check_size(request)
        self._room.acquire()
        with self._lock:
            if self._broken is not None:
                self._room.release()
                raise self._broken
            self._pending.append((batch, future))
        self._requests.put(request)
        return future

    def close(self) -> None:
        """Waits for the answers to all batches, and ends the stream. Futures hold what went wrong."""
        self._requests.put(None)
        self._reader.join()

    def _read(self) -> None:
        error: DynmeshError = CancelledError("the edit stream has ended")
        try:
            for reply in self._call:
                _answer(*self._next_pending(), reply)
        except grpc.RpcError as failure:
            error = from_rpc_error(failure)
        self._break(error)

    def _next_pending(self) -> _Pending:
        with self._lock:
            pending = self._pending.popleft()
        self._room.release()
        return pending

    def _break(self, error: DynmeshError) -> None:
        with self._lock:
            self._broken = error
            left = list(self._pending)
            self._pending.clear()
        for _, future in left:
            future.set_exception(error)
        self._room.release()  # a submit that waits learns of it
        self._requests.put(None)  # so does gRPC's thread that waits for requests


def _answer(batch: EditBatch, future: Future[EditResult], reply: edits_pb2.StreamEditsResponse) -> None:
    if reply.HasField("applied"):
        future.set_result(batch.read(reply.applied))
    else:
        error = reply.error
        future.set_exception(make_error(error.code, error.message, error.reason, dict(error.metadata)))
