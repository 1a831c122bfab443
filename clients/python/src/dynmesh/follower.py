"""The thread behind a mirror: reads a subscription, and takes it up again when it breaks."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from typing import Any, Protocol

import grpc

from ._calls import Backoff
from .delta import Delta, decode_delta
from .errors import CancelledError, DataLossError, DynmeshError, MirrorError, UnavailableError, from_rpc_error
from .v1 import subscriptions_pb2

_log = logging.getLogger(__name__)

Subscribe = Callable[[subscriptions_pb2.SubscribeRequest], Any]


class Sink(Protocol):
    """What a follower fills. All methods are called by the follower's thread."""

    def resume_at(self) -> tuple[int, str]:
        """Revision to follow from, and the uid of the session that it is of; empty when that is not known."""

    def received(self, message: subscriptions_pb2.SubscribeResponse) -> None:
        """A message has arrived: for statistics."""

    def take(self, deltas: tuple[Delta, ...], message: subscriptions_pb2.SubscribeResponse) -> None:
        """Applies chunks that end with a consistent delta, which is that of `message`."""

    def reconnecting(self) -> None:
        """The connection broke and will be taken up again."""

    def start_over(self) -> bool:
        """Forgets everything; False if that has just been done in vain."""

    def failed(self, error: DynmeshError) -> None:
        """Nothing more will come."""


class Follower:
    """Reads deltas into a sink until it is closed or fails.

    Unavailable servers are tried again with growing pauses; damage and contradictions make the sink start
    over; everything else is final.
    """

    def __init__(self, subscribe: Subscribe, request: subscriptions_pb2.SubscribeRequest, sink: Sink) -> None:
        self._subscribe = subscribe
        self._request = request
        self._sink = sink
        self._condition = threading.Condition()
        self._paused = False
        self._closed = False
        self._call: Any = None
        self._thread = threading.Thread(target=self._run, name=f"dynmesh-{request.session}", daemon=True)

    def start(self) -> None:
        """Begins to read."""
        self._thread.start()

    def set_paused(self, paused: bool) -> None:
        """While paused, nothing is read beyond a message that has arrived already, which waits."""
        with self._condition:
            self._paused = paused
            self._condition.notify_all()

    def close(self) -> None:
        """Stops reading, and returns when the sink will not be called any more (but by the caller itself)."""
        with self._condition:
            self._closed = True
            self._condition.notify_all()
            if self._call is not None:
                self._call.cancel()
        if threading.current_thread() is not self._thread:
            self._thread.join()

    def _run(self) -> None:
        backoff = Backoff()
        try:
            while not self._closed:
                self._follow_and_recover(backoff)
        except DynmeshError as error:
            self._fail(error)
        except Exception as error:  # of a callback, or memory: a thread must not take it to its grave
            self._fail(MirrorError(f"the mirror broke: {error!r}", reason="CALLBACK_FAILED"), error)

    def _follow_and_recover(self, backoff: Backoff) -> None:
        try:
            self._follow(backoff)
        except grpc.RpcError as error:
            if not self._closed:
                self._recover(from_rpc_error(error), backoff)
        except DataLossError as error:
            self._start_over(error)

    def _follow(self, backoff: Backoff) -> None:
        """Reads one stream."""
        self._request.from_revision, self._request.session_uid = self._sink.resume_at()
        with self._condition:
            if self._closed:
                return
            call = self._call = self._subscribe(self._request)
        chunks: list[Delta] = []
        for message in call:
            if self._closed_after_pause():
                return
            backoff.reset()
            chunks.append(decode_delta(message.delta))
            self._sink.received(message)
            if message.consistent:
                self._sink.take(tuple(chunks), message)
                chunks.clear()
        self._recover(UnavailableError("the server ended the subscription"), backoff)

    def _closed_after_pause(self) -> bool:
        with self._condition:
            self._condition.wait_for(lambda: not self._paused or self._closed)
            return self._closed

    def _recover(self, error: DynmeshError, backoff: Backoff) -> None:
        # Another session has the name now, or (with a server that tells no uids) the server has lost revisions.
        if error.reason in ("SESSION_RECREATED", "REVISION_IN_FUTURE"):
            self._start_over(error)
        elif isinstance(error, (UnavailableError, CancelledError)):  # nobody here has cancelled it
            _log.info("event=reconnect session=%s cause=%s", self._request.session, error)
            self._sink.reconnecting()
            with self._condition:
                self._condition.wait_for(lambda: self._closed, backoff.next_s())
        else:
            raise error

    def _start_over(self, error: DynmeshError) -> None:
        self._call.cancel()
        if not self._sink.start_over():
            raise error
        _log.warning("event=refollow session=%s cause=%s", self._request.session, error)

    def _fail(self, error: DynmeshError, cause: Exception | None = None) -> None:
        error.__cause__ = cause
        if self._call is not None:
            self._call.cancel()
        self._sink.failed(error)
