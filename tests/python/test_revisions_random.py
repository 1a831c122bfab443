"""Random edits, forks and ways back, over restarts: whatever can be had again is what it was."""

from __future__ import annotations

import random

import dynmesh
import pytest
from shapes import grid_tets
from waiting import PATIENCE_S

Contents = tuple[dynmesh.Checksum, dynmesh.Counts]


class Sessions:
    """Sessions, and what each of their revisions held."""

    def __init__(self, seed: int) -> None:
        self.dice = random.Random(seed)
        self.contents: dict[str, dict[int, Contents]] = {}
        self.client: dynmesh.Client

    def begin(self) -> None:
        session = self.client.create_session("s0", durability=self.dice.choice(["sync", "async"]))
        self.contents["s0"] = {0: held(session)}
        session.import_mesh(grid_tets(2), progress=False)
        self.contents["s0"][1] = held(session)

    def step(self) -> None:
        name = self.dice.choice(list(self.contents))
        move = self.dice.choice([self._edit, self._edit, self._edit, self._undo, self._go_back, self._look, self._fork])
        try:
            move(self.client.session(name), self.contents[name])
        except dynmesh.OutOfRangeError as gone:
            assert gone.reason == "REVISION_GONE"
            assert int(gone.metadata["requested"]) < int(gone.metadata["oldest"])
        except dynmesh.FailedPreconditionError as refused:
            assert refused.reason in ("NOTHING_TO_UNDO", "NOTHING_TO_REDO")

    def check(self) -> None:
        for name, contents in self.contents.items():
            session = self.client.session(name)
            assert session.validate() == []
            with session.mirror() as mirror:
                mirror.wait(session.revision, PATIENCE_S)
                assert mirror.checksum == contents[session.revision][0]

    def _edit(self, session: dynmesh.Session, contents: dict[int, Contents]) -> None:
        edges = session.entities("edge").ids.tolist()
        with session.edit(skip_refused=True) as tx:
            tx.add_vertices([[self.dice.random(), 0.0, 0.0]])
            if edges:
                operator = self.dice.choice([tx.split_edges, tx.collapse_edges, tx.swap_edges])
                operator(self.dice.sample(edges, min(3, len(edges))))
        contents[tx.result.revision] = (tx.result.checksum, tx.result.counts)

    def _undo(self, session: dynmesh.Session, contents: dict[int, Contents]) -> None:
        result = self.dice.choice([session.undo, session.redo])(self.dice.randint(1, 2))
        contents[result.revision] = (result.checksum, result.counts)

    def _go_back(self, session: dynmesh.Session, contents: dict[int, Contents]) -> None:
        target = self.dice.choice(list(contents))
        result = session.restore(target)
        assert (result.checksum, result.counts) == contents[target] == held(session)
        contents[result.revision] = contents[target]

    def _look(self, session: dynmesh.Session, contents: dict[int, Contents]) -> None:
        listed = [revision.revision for revision in session.revisions()]
        assert listed == sorted(set(listed), reverse=True)
        for target in self.dice.sample(listed, min(2, len(listed))):
            would_be = session.restore(target, validate_only=True)
            assert (would_be.checksum, would_be.counts) == contents[target]

    def _fork(self, session: dynmesh.Session, contents: dict[int, Contents]) -> None:
        if len(self.contents) == 4:
            return
        source, name = self.dice.choice(list(contents)), f"s{len(self.contents)}"
        made = session.fork(name, source)
        assert (made.revision, held(made)) == (source, contents[source])
        self.contents[name] = {source: contents[source]}


def held(session: dynmesh.Session) -> Contents:
    info = session.info()
    return info.checksum, info.counts


@pytest.mark.parametrize("seed", range(4))
def test_whatever_can_be_had_again_is_what_it_was(tmp_path, seed):
    sessions = Sessions(seed)
    for life in range(3):
        flags = [f"--checkpoint_bytes={sessions.dice.choice([1000, 20_000])}"]
        retained = sessions.dice.choice([5, 50])
        with dynmesh.launch(data_dir=tmp_path, retain_revisions=retained, flags=flags) as daemon:
            sessions.client = daemon.client
            if life == 0:
                sessions.begin()
            for _ in range(40):
                sessions.step()
            sessions.check()
