"""A daemon that is killed again and again while edits stream in: nothing acknowledged is lost, nothing done twice.

DYNMESH_TORTURE_KILLS says how often (20; ``make torture``: 200), DYNMESH_TORTURE_SEED with which choices.
"""

from __future__ import annotations

import os
import random
import subprocess
import threading
import time
from pathlib import Path

import dynmesh
import meshio
import numpy as np
import pytest
from dynmesh.daemon import find_daemon
from waiting import PATIENCE_S, await_serving

KILLS = int(os.environ.get("DYNMESH_TORTURE_KILLS", "20"))
SEED = int(os.environ.get("DYNMESH_TORTURE_SEED", "1"))
CHECKPOINT_BYTES = 30_000  # some dozens of batches: kills fall into checkpoints, too


class KilledDaemon:
    """A dynmeshd on a socket and a directory that stay, however often it is killed."""

    def __init__(self, directory: Path) -> None:
        self._directory = directory
        self._process: subprocess.Popen[bytes] | None = None
        self.target = f"unix:{directory / 'socket'}"

    def start(self) -> None:
        ready = self._directory / "ready"
        ready.unlink(missing_ok=True)
        command = [
            find_daemon(),
            "--listen=",
            f"--unix_socket={self._directory / 'socket'}",
            f"--data_dir={self._directory / 'data'}",
            f"--ready_file={ready}",
            f"--checkpoint_bytes={CHECKPOINT_BYTES}",
            "--exit_with_parent",
        ]
        with open(self._directory / "log", "ab") as log:
            self._process = subprocess.Popen(command, stderr=log)
        deadline = time.monotonic() + PATIENCE_S
        while not ready.exists():
            assert self._process.poll() is None, "it did not start: " + self.log_tail()
            assert time.monotonic() < deadline, "it does not serve"
            time.sleep(0.005)

    def kill(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            self._process = None

    def log_tail(self) -> str:
        return (self._directory / "log").read_text(errors="replace")[-2000:]


class RandomEdit:
    """One batch, the same for whoever makes it."""

    def __init__(self, rng: random.Random) -> None:
        self.what = rng.choice(["split", "split", "collapse", "swap", "move", "add", "remove", "smooth"])
        self._ids = [rng.randrange(400) for _ in range(rng.randrange(1, 8))]
        self._points = np.array([[rng.uniform(-1, 9) for _ in range(3)] for _ in range(4)])

    def apply(self, session: dynmesh.Session, request_id: str | None) -> tuple[int, dynmesh.Checksum] | None:
        """Revision and checksum that it led to; None when it was refused."""
        try:
            with session.edit(skip_refused=True, request_id=request_id) as batch:
                self._fill(batch)
            return batch.result.revision, batch.result.checksum
        except dynmesh.UnavailableError:
            raise
        except dynmesh.DynmeshError as error:
            assert error.reason and error.reason != "INTERNAL", error
            return None

    def _fill(self, batch: dynmesh.Transaction) -> None:
        if self.what == "split":
            batch.split_edges(self._ids)
        elif self.what == "collapse":
            batch.collapse_edges(self._ids)
        elif self.what == "swap":
            batch.swap_edges(self._ids)
        elif self.what == "smooth":
            batch.smooth_vertices(self._ids)
        elif self.what == "move":
            batch.move_vertices(self._ids[:1], self._points[:1])
        elif self.what == "remove":
            batch.remove_elements("cell", self._ids[:1])
        else:
            batch.add_elements("tetra", batch.add_vertices(self._points).reshape(1, 4))


def grid_of_tets(n: int) -> meshio.Mesh:
    """n x n x n cubes of six tetrahedra each."""
    number = np.arange((n + 1) ** 3).reshape(n + 1, n + 1, n + 1)
    points = np.argwhere(number >= 0).astype(float)
    corners = [number[i : i + n, j : j + n, k : k + n].ravel() for i in (0, 1) for j in (0, 1) for k in (0, 1)]
    paths = [(1, 3), (1, 5), (2, 3), (2, 6), (4, 5), (4, 6)]  # from corner 0 to corner 7
    tets = np.concatenate([np.stack([corners[0], corners[a], corners[b], corners[7]], axis=1) for a, b in paths])
    return meshio.Mesh(points, [("tetra", tets)])


class Writer:
    """Streams random edits into a session that may vanish, and makes the same in one that does not."""

    def __init__(self, reference: dynmesh.Session, rng: random.Random) -> None:
        self._reference = reference
        self._rng = rng
        self._number = 0
        self._pending: tuple[str, RandomEdit] | None = None
        self.revision = reference.info().revision  # the last one that was acknowledged
        self.accepted = 0

    def run(self, session: dynmesh.Session) -> None:
        """Until the daemon is gone."""
        while True:
            if self._pending is None:
                self._number += 1
                self._pending = (f"request-{self._number}", RandomEdit(self._rng))
            request_id, edit = self._pending
            try:
                answer = edit.apply(session, request_id)
            except dynmesh.UnavailableError:
                return
            self._acknowledged(edit, answer)

    def check_after_restart(self, session: dynmesh.Session) -> None:
        """Nothing acknowledged is missing; what was under way is there as a whole, or not at all."""
        info = session.info()
        assert info.revision in (self.revision, self.revision + 1), "revisions were lost, or done twice"
        assert info.durable_revision == info.revision
        assert session.validate() == []
        if info.revision == self.revision:
            assert info.checksum == self._reference.info().checksum
        if self._pending is not None:
            request_id, edit = self._pending
            answer = edit.apply(session, request_id)
            if info.revision > self.revision:
                assert answer == (info.revision, info.checksum), "the retry was not given the first answer"
            self._acknowledged(edit, answer)
        assert session.info().checksum == self._reference.info().checksum

    def _acknowledged(self, edit: RandomEdit, answer: tuple[int, dynmesh.Checksum] | None) -> None:
        self._pending = None
        if answer is None:
            assert edit.apply(self._reference, None) is None
            return
        assert edit.apply(self._reference, None) == answer
        assert answer[0] == self.revision + 1
        self.revision = answer[0]
        self.accepted += 1


@pytest.mark.parametrize("durability", ["sync", "async"])
def test_nothing_acknowledged_is_lost_and_nothing_is_done_twice(tmp_path, daemon, durability):
    rng = random.Random(f"{SEED} {durability}")
    reference = daemon.client.create_session(f"reference-{durability}", durability="none")
    killed = KilledDaemon(tmp_path)
    killed.start()
    with dynmesh.connect(killed.target, retries=0, timeout=PATIENCE_S) as client:
        session = client.create_session("tortured", durability=durability)
        for each in (session, reference):
            each.import_mesh(grid_of_tets(3), progress=False)
        writer = Writer(reference, rng)
        mirror = session.mirror()
        for _ in range((KILLS + 1) // 2):
            thread = threading.Thread(target=writer.run, args=[session])
            thread.start()
            time.sleep(rng.uniform(0.05, 0.4))  # the moment of the kill: nothing waits for it
            killed.kill()
            thread.join(PATIENCE_S)
            assert not thread.is_alive()
            seen = mirror.revision
            killed.start()
            assert await_serving(session).revision >= seen, "a follower was told of what is gone"
            writer.check_after_restart(session)
            mirror.wait(writer.revision, PATIENCE_S)
            assert mirror.checksum == reference.info().checksum
        mirror.close()
        assert writer.accepted > KILLS
    killed.kill()
    reference.delete()
