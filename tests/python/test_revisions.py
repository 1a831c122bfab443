"""What sessions were before: listed, gone back to, forked, and kept under names."""

from __future__ import annotations

import itertools
import time
from datetime import datetime, timedelta, timezone

import dynmesh
import numpy as np
import pytest
from dynmesh.v1 import history_pb2
from shapes import two_tets
from waiting import PATIENCE_S

_numbers = itertools.count()


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    """A daemon that keeps sessions, and whose clients are ann's."""
    with dynmesh.launch(data_dir=tmp_path_factory.mktemp("data"), author="ann") as running:
        yield running


@pytest.fixture
def part(store):
    """Two tetrahedra, imported as revision 1."""
    made = store.client.create_session(f"part-{next(_numbers)}")
    made.import_mesh(two_tets(), message="as drawn", progress=False)
    yield made
    assert made.validate() == []
    made.delete()


def add_vertex(session: dynmesh.Session, x: float = 0.0, **options) -> dynmesh.EditResult:
    with session.edit(**options) as tx:
        tx.add_vertices([[x, 0.0, 0.0]])
    return tx.result


def numbers(session: dynmesh.Session) -> list[int]:
    return [revision.revision for revision in session.revisions()]


def reason_of(refused) -> tuple[type, str]:
    return type(refused.value), refused.value.reason


# ---- Revisions ----


def test_each_revision_says_who_made_it_how_and_why(part):
    began = datetime.now(timezone.utc) - timedelta(minutes=1)
    add_vertex(part, author="bob", message="a vertex", request_id="mine")
    part.undo(message="not that one")
    part.redo(author="")
    part.repair(orient=True, weld=2.0, message="welded")
    part.restore(1, message="as drawn, again")
    told = [(r.revision, r.kind, r.author, r.message) for r in part.revisions()]
    assert told == [
        (6, "restoration", "ann", "as drawn, again"),
        (5, "repair", "ann", "welded"),
        (4, "redo", "", ""),
        (3, "undo", "ann", "not that one"),
        (2, "edit", "bob", "a vertex"),
        (1, "import", "ann", "as drawn"),
    ]
    revisions = list(part.revisions())
    assert revisions[4].request_id == "mine" and all(r.size_bytes > 0 for r in revisions)
    times = [r.commit_time for r in revisions]
    assert times == sorted(times, reverse=True) and began < times[-1] and times[0] - began < timedelta(minutes=2)
    assert revisions[4].to_dict()["commit_time"] == times[4].isoformat()


def test_a_step_of_an_adaptation_and_a_fork_have_kinds_and_notes_too(part):
    result = part.adapt(0.5, max_passes=1, message="finer", progress=False)
    steps = list(part.revisions(result.revision - 1))
    assert steps and {(r.kind, r.message) for r in steps} == {("adaptation", "finer")}
    copy = part.fork(f"{part.name}-copy", message="to try things")
    (only,) = copy.revisions()
    assert (only.revision, only.kind, only.author) == (result.revision, "creation", "ann")
    assert only.message == "to try things"
    copy.delete()


def test_batches_of_a_stream_have_its_message_or_their_own(part):
    with part.edit_stream(author="eve", message="moved") as stream:
        for own in (None, "back"):
            batch = dynmesh.EditBatch()
            batch.move_vertices([0], [[0.0, 0.0, -0.1]])
            future = stream.submit(batch, message=own)
        assert future.result().durable_revision == 3
    told = [(r.author, r.message) for r in part.revisions(2)]
    assert told == [("eve", "back"), ("eve", "moved")]


def test_pages_follow_each_other_and_only_those_that_are_wanted_are_fetched(part, monkeypatch):
    for x in range(9):
        add_vertex(part, x)
    monkeypatch.setattr("dynmesh.session_history._PAGE_SIZE", 3)
    sizes = []
    unary = part._caller.unary

    def watch(method, request, timeout, **options):
        sizes.append(request.page_size)
        return unary(method, request, timeout, **options)

    monkeypatch.setattr(part._caller, "unary", watch)
    assert numbers(part) == list(range(10, 0, -1)) and sizes == [3, 3, 3, 3]
    sizes.clear()
    assert [r.revision for r in part.revisions(5)] == [10, 9, 8, 7, 6] and sizes == [3, 2]
    sizes.clear()
    some = part.revisions()
    assert sizes == []
    assert [next(some).revision for _ in range(3)] == [10, 9, 8] and sizes == [3]
    assert len(list(part.revisions(1000))) == 10


def test_pages_that_make_no_sense_are_refused(part, monkeypatch):
    for limit in (0, -1, 1.5, "all"):
        with pytest.raises(dynmesh.InvalidArgumentError, match="limit"):
            part.revisions(limit)  # at once
    monkeypatch.setattr("dynmesh.session_history._PAGE_SIZE", -1)
    with pytest.raises(dynmesh.InvalidArgumentError):
        list(part.revisions())
    for token in ("nonsense", "-1", "0"):
        request = history_pb2.ListRevisionsRequest(session=part.name, page_token=token)
        with pytest.raises(dynmesh.InvalidArgumentError, match="BAD_PAGE_TOKEN"):
            part._caller.unary(part._history.ListRevisions, request, 30, repeatable=True)


def test_what_is_too_long_or_no_text_is_refused_and_changes_nothing(part):
    for note in ({"author": "a" * 257}, {"message": "m" * 4097}, {"author": 7}, {"message": "\udcff"}):
        for change in (add_vertex, part.undo, part.redo, lambda **said: part.repair(weld=9.0, **said)):
            with pytest.raises(dynmesh.InvalidArgumentError, match="BAD_ARGUMENT") as refused:
                change(part, **note) if change is add_vertex else change(**note)
            assert refused.value.metadata["field"].endswith(next(iter(note)))
        for again in (lambda **said: part.restore(1, **said), lambda **said: part.create_snapshot("no", **said)):
            with pytest.raises(dynmesh.InvalidArgumentError, match="BAD_ARGUMENT"):
                again(**note)
    assert part.revision == 1 and part.snapshots() == []
    assert add_vertex(part, author="\N{GREEK SMALL LETTER ALPHA}" * 128).revision == 2
    with pytest.raises(dynmesh.InvalidArgumentError, match="author"):
        dynmesh.connect(author=7)


def test_results_tell_what_is_on_disk(part):
    assert add_vertex(part).durable_revision == 2
    assert part.undo().durable_revision == 3
    assert part.repair(weld=9.0).durable_revision == 4
    assert part.restore(1).durable_revision == 5
    assert part.undo().to_dict()["durable_revision"] == 6


# ---- Going back ----


def test_going_back_is_a_revision_that_mirrors_follow_and_undo_takes_back(part):
    with part.edit() as tx:
        tx.add_attribute("heat", "cell")
        tx.set_attribute("heat", "cell", [0, 1], [1.5, 2.5])
    then = part.snapshot()
    with part.mirror() as mirror:
        with part.edit() as tx:
            tx.remove_elements("cell", [1])
            tx.split_edges(ends=[[0, 1]])
        before = part.info()
        result = part.restore(2)
        assert (result.revision, result.target_revision, result.undoable_batches) == (4, 2, 3)
        assert result.checksum == then.checksum() == part.info().checksum and result.counts == part.counts
        mirror.wait(4, PATIENCE_S)
        assert mirror.checksum == result.checksum
        assert mirror.attribute("heat", "cell")[:2].ravel().tolist() == [1.5, 2.5]
        after = part.snapshot()
        assert (after.blocks[0].ids == then.blocks[0].ids).all()
        assert (after.blocks[0].vertices == then.blocks[0].vertices).all()
        assert (after.attributes[0].values == then.attributes[0].values).all()
        assert part.undo().checksum == before.checksum
        mirror.wait(5, PATIENCE_S)
        assert mirror.checksum == before.checksum


def test_what_had_ended_is_born_again(part):
    with part.edit() as tx:
        tx.remove_elements("cell", [1])
    part.restore(1)
    assert part.entities("cell", [1]).vertices.tolist() == [1, 2, 3, 4]
    assert part.positions([0], as_of_revision=1).tolist() == [[0, 0, 0]]
    with pytest.raises(dynmesh.NotFoundError, match="ENTITY_REMOVED"):
        part.entities("cell", [1], as_of_revision=1)


def test_going_back_that_is_only_validated_tells_what_would_be(part):
    first = part.info()
    add_vertex(part)
    told = part.restore(1, validate_only=True)
    assert (told.revision, told.target_revision, told.undoable_batches) == (2, 1, 1)
    assert (told.checksum, told.counts) == (first.checksum, first.counts)
    assert part.revision == 2 and numbers(part) == [2, 1]
    assert told.to_dict()["checksum"] == str(first.checksum)


def test_a_retry_goes_back_once_and_nobody_came_in_between(part):
    add_vertex(part)
    first = part.restore(1, request_id="once", if_revision=2)
    assert part.restore(1, request_id="once", if_revision=2) == first
    assert part.revision == 3
    with pytest.raises(dynmesh.InvalidArgumentError, match="REQUEST_ID_REUSED"):
        part.restore(2, request_id="once", if_revision=2)
    with pytest.raises(dynmesh.AbortedError, match="REVISION_MISMATCH"):
        part.restore(1, if_revision=2)


def test_the_empty_session_of_the_beginning_is_a_revision_too(store):
    session = store.client.create_session("young")
    add_vertex(session)
    made = session.fork("younger", 0)
    assert (made.revision, made.counts.vertices) == (0, 0)
    result = session.restore(0)
    assert (result.revision, result.target_revision, result.counts) == (2, 0, (0, 0, 0, 0))
    assert session.counts == (0, 0, 0, 0)
    for each in (session, made):
        each.delete()


def test_what_cannot_be_gone_back_to_is_refused(part):
    for target, error, reason in (
        ({"revision": 2}, dynmesh.OutOfRangeError, "REVISION_IN_FUTURE"),
        ({"revision": 0}, dynmesh.OutOfRangeError, "REVISION_GONE"),  # an import is where history begins
        ({"revision": -1}, dynmesh.InvalidArgumentError, "BAD_ARGUMENT"),
        ({"revision": "first"}, dynmesh.InvalidArgumentError, "BAD_ARGUMENT"),
        ({"snapshot": "nobody"}, dynmesh.NotFoundError, "SNAPSHOT_NOT_FOUND"),
        ({"snapshot": "nobody", "revision": 1}, dynmesh.InvalidArgumentError, "BAD_ARGUMENT"),
    ):
        with pytest.raises(error) as refused:
            part.restore(**target)
        assert reason_of(refused) == (error, reason)
        with pytest.raises(error) as refused:
            part.fork("never", **target)
        assert reason_of(refused) == (error, reason)
    with pytest.raises(dynmesh.InvalidArgumentError, match="a revision or a snapshot"):
        part.restore()
    assert part.revision == 1


def test_sessions_that_are_not_kept_have_no_history_but_can_be_forked(store):
    session = store.client.create_session("scratch", durability="none")
    session.import_mesh(two_tets(), message="said and forgotten", progress=False)
    assert add_vertex(session).durable_revision == 2
    for asked in (
        lambda: list(session.revisions()),
        lambda: session.restore(1),
        lambda: session.fork("never", 1),
        lambda: session.create_snapshot("a"),
        session.snapshots,
        lambda: session.delete_snapshot("a"),
    ):
        with pytest.raises(dynmesh.FailedPreconditionError, match="NO_HISTORY"):
            asked()
    kept = session.fork("kept", durability="sync")
    assert (kept.info().durability, kept.info().checksum) == ("sync", session.info().checksum)
    assert [(r.revision, r.kind) for r in kept.revisions()] == [(2, "creation")]
    for each in (session, kept):
        each.delete()


# ---- Forks ----


def test_a_fork_goes_on_alone_from_the_same_revision(part):
    part.set_checks({"inverted": "reject"})
    add_vertex(part, 1.0)
    then = part.info()
    add_vertex(part, 2.0)
    copy = part.fork(f"{part.name}-copy", 2, durability="async")
    info = copy.info()
    assert isinstance(copy, dynmesh.Session) and copy.name == info.name == f"{part.name}-copy"
    assert (info.revision, info.checksum, info.counts) == (2, then.checksum, then.counts)
    assert (info.durability, info.checks, info.undoable_batches) == ("async", then.checks, 0)
    assert info.uid != then.uid
    with copy.edit(as_of_revision=2) as tx:
        tx.remove_elements("cell", [0])
    assert (copy.revision, part.revision) == (3, 3)
    assert part.counts.cells == 2 and copy.counts.cells == 1
    with copy.mirror() as mirror:
        mirror.wait(3, PATIENCE_S)
        assert mirror.checksum == copy.info().checksum
    part.undo(2)
    assert copy.restore(2).checksum == then.checksum
    assert copy.validate() == []
    copy.delete()


def test_a_fork_has_a_name_of_its_own(part):
    with pytest.raises(dynmesh.AlreadyExistsError, match="SESSION_EXISTS"):
        part.fork(part.name)
    with pytest.raises(dynmesh.InvalidArgumentError, match="BAD_SESSION_NAME"):
        part.fork("no name")
    with pytest.raises(dynmesh.InvalidArgumentError, match="durability"):
        part.fork("never", durability="forever")
    copy = part.fork("once", request_id="r")
    assert part.fork("once", request_id="r").info().uid == copy.info().uid
    copy.delete()


# ---- Snapshots ----


def test_a_snapshot_is_a_revision_with_a_name(part):
    add_vertex(part)
    made = part.create_snapshot("before", 1, author="bob", message="in case")
    assert (made.name, made.revision, made.author, made.message) == ("before", 1, "bob", "in case")
    assert part.create_snapshot("after").revision == 2
    assert [s.name for s in part.snapshots()] == ["after", "before"]
    assert part.snapshots()[1] == made and made.to_dict()["create_time"] == made.create_time.isoformat()
    with pytest.raises(dynmesh.AlreadyExistsError, match="SNAPSHOT_EXISTS"):
        part.create_snapshot("before")
    restored = part.restore(snapshot="before")
    assert (restored.revision, restored.target_revision) == (3, 1)
    copy = part.fork(f"{part.name}-copy", snapshot="after")
    assert copy.revision == 2 and copy.snapshots() == []
    copy.delete()
    part.delete_snapshot("before")
    assert [s.name for s in part.snapshots()] == ["after"]
    with pytest.raises(dynmesh.NotFoundError, match="SNAPSHOT_NOT_FOUND"):
        part.delete_snapshot("before")
    assert numbers(part) == [3, 2, 1]


def test_snapshots_that_make_no_sense_are_refused(part):
    with pytest.raises(dynmesh.InvalidArgumentError, match="BAD_SNAPSHOT_NAME"):
        part.create_snapshot("no name")
    with pytest.raises(dynmesh.OutOfRangeError, match="REVISION_IN_FUTURE"):
        part.create_snapshot("later", 2)
    for revision in (0, -1, "first"):
        with pytest.raises(dynmesh.InvalidArgumentError, match="revision"):
            part.create_snapshot("odd", revision)
    assert part.snapshots() == []


# ---- What stays ----


def test_retention_is_a_setting(store):
    week = dynmesh.Retention(max_age=7 * 86400.5, max_revisions=10)
    session = store.client.create_session("retaining", retention=week)
    assert session.info().retention == week and session.info().to_dict()["retention"]["max_revisions"] == 10
    etag = session.info().etag
    changed = session.set_retention(dynmesh.Retention(max_bytes=1 << 20), etag=etag)
    assert changed.retention == session.info().retention == (0, 0.0, 1 << 20) and changed.revision == 0
    with pytest.raises(dynmesh.AbortedError, match="ETAG_MISMATCH"):
        session.set_retention(week, etag=etag)
    for odd in ((-1, 0.0, 0), (2**32, 0.0, 0), (0, -1.0, 0), (0, float("nan"), 0), (0, 1e11, 0), (0, 0.0, -1)):
        with pytest.raises(dynmesh.InvalidArgumentError, match="BAD_ARGUMENT"):
            session.set_retention(dynmesh.Retention(*odd))
    with pytest.raises(dynmesh.InvalidArgumentError, match="retention"):
        session.set_retention(10)
    assert session.set_retention(dynmesh.Retention()).retention == (0, 0.0, 0)
    assert str(week) == "at most 10 revisions, 604804 s" and str(dynmesh.Retention()) == "as the daemon says"
    session.delete()


def test_revisions_go_and_those_with_a_name_stay(tmp_path):
    with dynmesh.launch(data_dir=tmp_path, retain_revisions=8, flags=["--checkpoint_bytes=4096"]) as daemon:
        session, named = (daemon.client.create_session(name) for name in ("part", "named"))
        for each in (session, named):
            each.import_mesh(two_tets(), progress=False)
            add_vertex(each)
        then = named.info().checksum
        named.create_snapshot("kept")
        gone = edit_until_gone(session, 2, named)
        oldest = int(gone.metadata["oldest"])
        assert gone.metadata["requested"] == "2" and oldest > 2
        assert numbers(session)[-1] >= oldest and session.restore(oldest, validate_only=True)
        with pytest.raises(dynmesh.OutOfRangeError, match="REVISION_GONE"):
            session.fork("never", 2)
        with pytest.raises(dynmesh.OutOfRangeError, match="REVISION_GONE"):
            session.create_snapshot("never", 2)
        assert named.fork("copy", snapshot="kept").info().checksum == then
    with dynmesh.launch(data_dir=tmp_path) as daemon:
        assert daemon.client.session("named").restore(snapshot="kept").checksum == then


def edit_until_gone(session: dynmesh.Session, revision: int, other: dynmesh.Session) -> dynmesh.OutOfRangeError:
    """Edits both until `revision` of the first is gone, which is when a checkpoint is written, in the background."""
    deadline = time.monotonic() + PATIENCE_S
    while time.monotonic() < deadline:
        for each in (session, other):
            with each.edit() as tx:
                tx.add_vertices(np.zeros((20, 3)))
        try:
            session.restore(revision, validate_only=True)
        except dynmesh.OutOfRangeError as error:
            assert error.reason == "REVISION_GONE"
            return error
    raise AssertionError("it is still there")


def test_history_is_there_after_a_restart(tmp_path):
    with dynmesh.launch(data_dir=tmp_path, author="ann") as daemon:
        session = daemon.client.create_session("part", retention=dynmesh.Retention(max_revisions=50))
        session.import_mesh(two_tets(), message="as drawn", progress=False)
        checksums = [session.info().checksum]
        for x in range(3):
            checksums.append(add_vertex(session, x, message=f"x {x}").checksum)
        session.restore(2, request_id="back")
        snapshot = session.create_snapshot("second", 2, message="in case")
        revisions = list(session.revisions())
        session.fork("copy", 3, message="to try things")
    with dynmesh.launch(data_dir=tmp_path) as daemon:
        session, copy = daemon.client.session("part"), daemon.client.session("copy")
        assert list(session.revisions()) == revisions and session.snapshots() == [snapshot]
        assert session.info().retention.max_revisions == 50
        assert session.restore(2, request_id="back").revision == 5, "the first answer"
        assert [(r.revision, r.kind, r.message) for r in copy.revisions()] == [(3, "creation", "to try things")]
        assert (copy.revision, copy.info().checksum) == (3, checksums[2])
        with session.mirror() as mirror:
            for number, checksum in enumerate(checksums, 1):
                result = session.restore(number)
                assert result.checksum == checksum
                mirror.wait(result.revision, PATIENCE_S)
                assert mirror.checksum == checksum
        assert numbers(session)[:4] == [9, 8, 7, 6] and next(session.revisions()).author == ""
        assert session.validate() == copy.validate() == []


def test_a_daemon_is_told_what_to_retain(tmp_path):
    with dynmesh.launch(data_dir=tmp_path, retain_revisions=0, retain_age=0.5, retain_bytes=1 << 30) as daemon:
        with daemon.connect(author="bob") as bobs:
            add_vertex(bobs.create_session("part"))
        (first,) = daemon.client.session("part").revisions()
        assert (first.author, first.message) == ("bob", "")
    with pytest.raises(dynmesh.LaunchError, match="retain_age"):
        dynmesh.launch(data_dir=tmp_path, retain_age=-1)
