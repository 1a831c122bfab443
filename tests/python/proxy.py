"""A TCP proxy in front of a unix socket whose connections can be cut."""

from __future__ import annotations

import contextlib
import socket
import threading


class Proxy:
    """Forwards 127.0.0.1:port to a unix socket; `cut` breaks what is open, `refuse` what comes."""

    def __init__(self, unix_socket: str) -> None:
        self._unix_socket = unix_socket
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._open: list[socket.socket] = []
        self._lock = threading.Lock()
        self._refuse = False
        self.target = "127.0.0.1:%d" % self._listener.getsockname()[1]
        threading.Thread(target=self._accept, daemon=True).start()

    def cut(self, *, refuse: bool = False) -> None:
        """Breaks all connections; with `refuse` new ones are closed at once until `heal`."""
        with self._lock:
            self._refuse = refuse
            victims, self._open = self._open, []
        for victim in victims:
            _close(victim)

    def heal(self) -> None:
        """Accepts again."""
        with self._lock:
            self._refuse = False

    def close(self) -> None:
        """Ends it."""
        _close(self._listener)
        self.cut(refuse=True)

    def _accept(self) -> None:
        while True:
            try:
                near, _ = self._listener.accept()
            except OSError:
                return
            with self._lock:
                if self._refuse:
                    _close(near)
                    continue
                far = socket.socket(socket.AF_UNIX)
                far.connect(self._unix_socket)
                self._open += [near, far]
            for source, sink in ((near, far), (far, near)):
                threading.Thread(target=_pump, args=(source, sink), daemon=True).start()


def _pump(source: socket.socket, sink: socket.socket) -> None:
    with contextlib.suppress(OSError):
        while data := source.recv(1 << 16):
            sink.sendall(data)
    _close(source)
    _close(sink)


def _close(victim: socket.socket) -> None:
    with contextlib.suppress(OSError):
        victim.shutdown(socket.SHUT_RDWR)
    victim.close()
