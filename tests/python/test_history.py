"""Undo, redo, and editors that must not overwrite each other."""

from __future__ import annotations

import json

import numpy as np
import pytest
from shapes import two_tets

import dynmesh


@pytest.fixture
def session(session):
    """Two tetrahedra, imported as revision 1."""
    session.import_mesh(two_tets())
    return session


def add_vertex(session: dynmesh.Session, x: float) -> None:
    with session.edit() as tx:
        tx.add_vertices([[x, 0.0, 0.0]])


def test_undo_and_redo_make_revisions_and_a_mirror_follows(session):
    checksums = [session.info().checksum]
    with session.mirror() as mirror:
        for x in range(3):
            add_vertex(session, x)
            checksums.append(session.info().checksum)
        undone = session.undo(2)
        assert (undone.revision, undone.count) == (5, 2)
        assert undone.checksum == checksums[1] == session.info().checksum
        assert (undone.undoable_batches, undone.redoable_batches) == (1, 2)
        assert undone.counts.vertices == 6
        mirror.wait(undone.revision)
        assert mirror.checksum == checksums[1]
        redone = session.redo()
        assert redone.checksum == checksums[2]
        mirror.wait(redone.revision)
        assert mirror.checksum == checksums[2]
    info = session.info()
    assert (info.undoable_batches, info.redoable_batches) == (2, 1)
    assert info.history_bytes > 0


def test_what_was_removed_comes_back_with_its_ids_and_attributes(session):
    with session.edit() as tx:
        tx.add_attribute("heat", "cell")
        tx.set_attribute("heat", "cell", [0, 1], [1.5, 2.5])
    before = session.snapshot()
    with session.edit() as tx:
        tx.remove_elements("cell", [1])
    session.undo()
    after = session.snapshot()
    assert (after.blocks[0].ids == before.blocks[0].ids).all()
    assert (after.blocks[0].vertices == before.blocks[0].vertices).all()
    assert (after.attributes[0].values == before.attributes[0].values).all()


def test_fewer_batches_than_asked_for_are_left_alone(session):
    with pytest.raises(dynmesh.FailedPreconditionError) as refused:
        session.undo()  # an import cannot be undone
    assert refused.value.reason == "NOTHING_TO_UNDO"
    add_vertex(session, 1.0)
    with pytest.raises(dynmesh.FailedPreconditionError) as refused:
        session.undo(2)
    assert refused.value.metadata["available"] == "1"
    with pytest.raises(dynmesh.FailedPreconditionError) as refused:
        session.redo()
    assert refused.value.reason == "NOTHING_TO_REDO"
    with pytest.raises(dynmesh.AbortedError):
        session.undo(if_revision=1)
    assert session.undo(validate_only=True).revision == session.info().revision == 2


@pytest.mark.parametrize("count", [0, -1, 2**32, 1.5, "two"])
def test_a_count_is_a_positive_number(session, count):
    with pytest.raises(dynmesh.InvalidArgumentError):
        session.undo(count)


def test_a_retry_is_undone_once(session):
    add_vertex(session, 1.0)
    add_vertex(session, 2.0)
    first = session.undo(request_id="once")
    assert session.undo(request_id="once") == first
    assert session.info().undoable_batches == 1


def test_an_undo_that_is_only_validated_tells_what_would_be(session):
    before = session.info()
    add_vertex(session, 1.0)
    told = session.undo(validate_only=True)
    assert (told.checksum, told.counts) == (before.checksum, before.counts)
    assert (told.revision, told.count, told.undoable_batches, told.redoable_batches) == (2, 1, 1, 0)
    assert session.counts.vertices == before.counts.vertices + 1


def test_editors_in_one_place_do_not_overwrite_each_other(session):
    read_at = session.info().revision
    with session.edit() as tx:
        tx.move_vertices([2], [[0.0, 1.5, 0.0]])
    with pytest.raises(dynmesh.ConflictError) as refused:
        with session.edit(as_of_revision=read_at, conflict_policy="touched") as tx:
            tx.move_vertices([1, 2], np.zeros((2, 3)))
    assert isinstance(refused.value, dynmesh.AbortedError)
    assert refused.value.reason == "CONFLICT"
    assert refused.value.ids == (2,)
    assert refused.value.metadata["kind"] == "vertex"
    assert refused.value.changed_revision == read_at + 1
    with session.edit(as_of_revision=read_at, conflict_policy="touched") as tx:
        tx.move_vertices([1], [[1.5, 0.0, 0.0]])
    assert tx.result.revision == read_at + 2


def test_batches_of_ones_own_conflict_too_and_edges_that_are_gone_are_not_found(session):
    read_at = session.info().revision
    touched = {"as_of_revision": read_at, "conflict_policy": "touched"}
    with session.edit(**touched) as tx:
        tx.move_vertices([0], [[0.0, 0.0, -0.5]])
        tx.remove_elements("cell", [1])
    with pytest.raises(dynmesh.ConflictError):
        with session.edit(**touched) as tx:
            tx.move_vertices([0], [[0.0, 0.0, -1.0]])
    with pytest.raises(dynmesh.NotFoundError, match="UNKNOWN_ENTITY"):
        with session.edit(**touched) as tx:
            tx.split_edges(ends=[[1, 4]])


def test_a_stream_of_edits_tells_conflicts_apart(session):
    read_at = session.info().revision
    with session.edit_stream(as_of_revision=read_at, conflict_policy="touched") as stream:
        futures = []
        for vertex in (0, 1, 0):
            batch = dynmesh.EditBatch()
            batch.move_vertices([vertex], [[0.0, 0.0, -1.0 - vertex]])
            futures.append(stream.submit(batch))
    assert [future.exception() is None for future in futures] == [True, True, False]
    assert isinstance(futures[2].exception(), dynmesh.ConflictError)


def test_a_conflict_policy_has_a_name_and_needs_a_revision(session):
    with pytest.raises(dynmesh.InvalidArgumentError) as refused:
        session.apply(dynmesh.EditBatch(), conflict_policy="always")
    assert refused.value.metadata["field"] == "conflict_policy"
    with pytest.raises(dynmesh.InvalidArgumentError) as refused:
        session.apply(dynmesh.EditBatch(), conflict_policy="touched")
    assert refused.value.metadata["field"] == "as_of_revision"


def test_undo_from_the_command_line(session, daemon, capsys):
    from dynmesh.cli import main

    add_vertex(session, 1.0)
    add_vertex(session, 2.0)
    assert main(["--target", daemon.target, "undo", session.name, "2", "--json"]) == 0
    undone = json.loads(capsys.readouterr().out)
    assert (undone["revision"], undone["count"], undone["redoable_batches"]) == (4, 2, 2)
    assert undone["checksum"] == str(session.info().checksum)
    assert main(["--target", daemon.target, "redo", session.name]) == 0
    said = f"redid 1 batch(es): {session.name} is at revision 5; 1 can be undone, 1 redone"
    assert said in capsys.readouterr().out
    assert main(["--target", daemon.target, "undo", session.name, "9"]) == 1
    assert "NOTHING_TO_UNDO" in capsys.readouterr().err
