"""A local daemon that belongs to this process."""

from __future__ import annotations

import os
import queue
import shutil
import subprocess
import tempfile
import threading
import time
import weakref
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType

from ._calls import DEFAULT_MAX_MESSAGE_BYTES
from .client import DEFAULT_TIMEOUT_S, Client, connect
from .errors import LaunchError
from .files import PathLike

_POLL_S = 0.01
_LOG_TAIL_LINES = 20
_MAX_SOCKET_PATH = 100  # the kernel's limit is 107 bytes


class Daemon:
    """A running dynmeshd; made by `launch`. Closing it, or the end of this process, ends it.

    Attributes
    ----------
    target : str
        Its unix socket, for `connect`.
    addresses : tuple of str
        All addresses on which it serves.
    """

    def __init__(
        self, process: subprocess.Popen[bytes], directory: Path, grace_s: float, author: str | None = None
    ) -> None:
        self._process = process
        self._directory = directory
        self._author = author
        self._client: Client | None = None
        self.target = f"unix:{directory / 'socket'}"
        self.addresses: tuple[str, ...] = ()
        self._end = weakref.finalize(self, _end, process, directory, grace_s)

    def __repr__(self) -> str:
        return f"<dynmesh.Daemon pid={self.pid} {self.target}>"

    @property
    def pid(self) -> int:
        """Process id."""
        return self._process.pid

    @property
    def running(self) -> bool:
        """Whether the process is alive."""
        return self._process.poll() is None

    @property
    def client(self) -> Client:
        """A client of this daemon, made when first asked for."""
        if self._client is None:
            self._client = self.connect()
        return self._client

    def connect(
        self,
        *,
        timeout: float = DEFAULT_TIMEOUT_S,
        retries: int = 2,
        max_message_bytes: int = DEFAULT_MAX_MESSAGE_BYTES,
        read_ahead_bytes: int | None = None,
        author: str | None = None,
    ) -> Client:
        """Another client of this daemon: as `dynmesh.connect`; without an author that of `launch`."""
        return connect(
            self.target,
            timeout=timeout,
            retries=retries,
            max_message_bytes=max_message_bytes,
            read_ahead_bytes=read_ahead_bytes,
            author=self._author if author is None else author,
        )

    def log_tail(self, lines: int = _LOG_TAIL_LINES) -> str:
        """The last lines of the daemon's log."""
        log = self._directory / "log"
        text = log.read_text(errors="replace") if log.exists() else ""
        return "\n".join(text.splitlines()[-lines:])

    def close(self) -> None:
        """Ends the daemon: it may finish what it is doing, then it is killed. May be called again."""
        if self._client is not None:
            self._client.close()
            self._client = None
        self._end()

    def __enter__(self) -> Daemon:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _wait_until_ready(self, ready_file: Path, timeout: float) -> None:
        deadline = time.monotonic() + timeout
        while not ready_file.exists():
            if not self.running:
                raise self._failure(f"dynmeshd ended with status {self._process.returncode}")
            if time.monotonic() > deadline:
                raise self._failure(f"dynmeshd was not ready within {timeout} s")
            time.sleep(_POLL_S)
        self.addresses = tuple(ready_file.read_text().split())

    def _failure(self, what: str) -> LaunchError:
        tail = self.log_tail()
        return LaunchError(f"{what}; its log ends:\n{tail}" if tail else f"{what} and wrote no log")


def launch(
    binary: PathLike | None = None,
    *,
    listen: str | None = None,
    data_dir: PathLike | None = None,
    idle_timeout: float | None = None,
    max_loaded_bytes: int | None = None,
    retain_revisions: int | None = None,
    retain_age: float | None = None,
    retain_bytes: int | None = None,
    author: str | None = None,
    flags: Sequence[str] = (),
    timeout: float = 30.0,
    grace: float = 10.0,
) -> Daemon:
    """Starts a dynmeshd of this process's own, on a unix socket in a private directory.

    >>> with dynmesh.launch() as daemon:
    ...     session = daemon.client.create_session("part")

    Parameters
    ----------
    binary : path, optional
        Default: the environment variable DYNMESHD, else the daemon of the build that this package belongs to,
        else ``dynmeshd`` in PATH.
    listen : str, optional
        Serve at "host:port" as well; port 0 means any free one (see `Daemon.addresses`).
    data_dir : path, optional
        Keep sessions there, made if it is not there: whoever launches with the same one has them again.
    idle_timeout : float, optional
        Seconds after which sessions in `data_dir` that nobody uses or follows are unloaded, until somebody uses
        them; their undo history is lost then. 0: never. Default: the daemon's own, half an hour.
    max_loaded_bytes : int, optional
        Memory of the sessions in `data_dir` that are loaded: beyond it the least recently used ones are unloaded.
        0 and default: however much.
    retain_revisions : int, optional
        Last revisions of a session in `data_dir` that can be gone back to (`Session.restore`), unless the session
        says otherwise (`Session.set_retention`). 0: all. Default: the daemon's own, 4096.
    retain_age : float, optional
        The same by their age in seconds. 0 and default: of any age.
    retain_bytes : int, optional
        The same by the disk that their records take. 0: however much. Default: the daemon's own, 256 MiB.
    author : str, optional
        Who makes the revisions of this daemon's clients: as in `dynmesh.connect`.
    flags : sequence of str
        Further flags of dynmeshd.
    timeout : float
        Seconds until it must serve.
    grace : float
        Seconds that it may take to end when closed.

    Raises
    ------
    LaunchError
        No binary, or it did not start; the message holds the end of its log.
    """
    command = find_daemon(binary)
    directory = _private_directory()
    ready_file = directory / "ready"
    arguments = [
        command,
        f"--unix_socket={directory / 'socket'}",
        f"--ready_file={ready_file}",
        f"--listen={listen or ''}",
        "--exit_with_parent",
        *([] if data_dir is None else [f"--data_dir={Path(data_dir).absolute()}"]),
        *([] if idle_timeout is None else [f"--idle_timeout={idle_timeout:.9f}s"]),
        *([] if max_loaded_bytes is None else [f"--max_loaded_bytes={max_loaded_bytes:d}"]),
        *([] if retain_revisions is None else [f"--retain_revisions={retain_revisions:d}"]),
        *([] if retain_age is None else [f"--retain_age={retain_age:f}s"]),
        *([] if retain_bytes is None else [f"--retain_bytes={retain_bytes:d}"]),
        *flags,
    ]
    daemon = Daemon(_start(arguments, directory), directory, grace, author)
    try:
        daemon._wait_until_ready(ready_file, timeout)
    except BaseException:
        daemon.close()
        raise
    return daemon


def find_daemon(binary: PathLike | None = None) -> str:
    """Path of dynmeshd, looked for as `launch` says. Raises `LaunchError`."""
    for candidate in (binary, os.environ.get("DYNMESHD"), _built_daemon(), "dynmeshd"):
        if candidate:
            found = shutil.which(candidate)
            if found:
                return found
            if candidate is binary:
                break
    raise LaunchError(
        f"no dynmeshd at {binary}"
        if binary
        else "no dynmeshd: build it, or name it by the environment variable DYNMESHD, or put it into PATH",
        reason="NO_DAEMON",
    )


def _built_daemon() -> str | None:
    try:
        from . import _build  # written by the build
    except ImportError:
        return None
    return _build.DAEMON


def _private_directory() -> Path:
    directory = tempfile.mkdtemp(prefix="dynmesh-")
    if len(directory) < _MAX_SOCKET_PATH - len("/socket"):
        return Path(directory)
    os.rmdir(directory)
    return Path(tempfile.mkdtemp(prefix="dynmesh-", dir="/tmp"))


def _start(arguments: Sequence[str], directory: Path) -> subprocess.Popen[bytes]:
    """Starts the process from a thread that lives as long as it does.

    The kernel tells a child of the end of the thread that made it, not of its process (prctl(2),
    PR_SET_PDEATHSIG); so the thread that calls `launch` may end before the daemon.
    """
    started: queue.SimpleQueue[subprocess.Popen[bytes] | OSError] = queue.SimpleQueue()

    def run() -> None:
        try:
            with open(directory / "log", "wb") as log:
                process = subprocess.Popen(arguments, stdin=subprocess.DEVNULL, stdout=log, stderr=log)
        except OSError as error:
            started.put(error)
        else:
            started.put(process)
            process.wait()

    threading.Thread(target=run, name="dynmesh-daemon", daemon=True).start()
    outcome = started.get()
    if isinstance(outcome, OSError):
        shutil.rmtree(directory, ignore_errors=True)
        raise LaunchError(f"cannot start {arguments[0]}: {outcome}") from outcome
    return outcome


def _end(process: subprocess.Popen[bytes], directory: Path, grace_s: float) -> None:
    """SIGTERM, and SIGKILL after `grace_s` seconds."""
    if process.poll() is None:
        process.terminate()
        try:
            process.wait(grace_s)
        except subprocess.TimeoutExpired:
            process.kill()
    process.wait()
    shutil.rmtree(directory, ignore_errors=True)
