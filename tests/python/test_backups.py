"""Backups in files, and sessions made of them."""

import json
import os
import subprocess
import sys
import threading

import dynmesh
import numpy as np
import pytest
from shapes import two_tets, zoo

COMMAND = (
    [os.environ["DYNMESH_COMMAND"]] if "DYNMESH_COMMAND" in os.environ else [sys.executable, "-m", "dynmesh"]
)


@pytest.fixture
def filled(session):
    session.import_mesh(zoo(), progress=False)
    with session.edit() as batch:
        batch.split_edges([0])
        batch.add_attribute("t", "vertex", "float64", default=[0.5])
    return session


def assert_equal(copy, original):
    ours, theirs = copy.snapshot(), original.snapshot()
    assert ours.revision == theirs.revision
    assert np.array_equal(ours.vertex_ids, theirs.vertex_ids)
    assert np.array_equal(ours.positions, theirs.positions)
    assert len(ours.blocks) == len(theirs.blocks)
    for mine, other in zip(ours.blocks, theirs.blocks, strict=True):
        assert np.array_equal(mine.ids, other.ids) and np.array_equal(mine.vertices, other.vertices)
    assert copy.info().checksum == original.info().checksum


def test_a_session_is_made_again_and_goes_on_in_the_same_way(client, filled, tmp_path):
    path = tmp_path / "part.dynb"
    backup = filled.backup(path, progress=False)
    assert backup.revision == 2 and backup.info.to_dict() == filled.info().to_dict()
    assert backup.file_bytes == path.stat().st_size
    restored = client.restore_backup(path, "again", progress=False)
    copy = restored.session
    assert copy.name == "again" and restored.source_name == filled.name
    assert restored.source_uid == filled.info().uid != restored.info.uid
    assert restored.revision == 2 and restored.info.update_time == filled.info().update_time
    assert_equal(copy, filled)
    for session in (copy, filled):
        with session.edit(as_of_revision=1) as batch:
            batch.split_edges([1])
    assert_equal(copy, filled)
    assert copy.validate() == []
    with copy.mirror() as mirror:
        mirror.wait(3, 30)
        assert mirror.checksum == filled.info().checksum
    copy.delete()


def test_the_name_is_that_of_the_backup_where_no_other_is_given(client, filled, tmp_path):
    filled.backup(tmp_path / "b")
    with pytest.raises(dynmesh.AlreadyExistsError):
        client.restore_backup(tmp_path / "b")
    filled.delete()
    assert client.restore_backup(tmp_path / "b").session.name == filled.name
    assert filled.info().revision == 2


def test_while_it_is_edited_a_backup_is_of_one_revision(client, session, tmp_path):
    session.import_mesh(two_tets(), progress=False)
    checksums = {1: session.info().checksum}

    def edit():
        for _ in range(50):
            with session.edit() as batch:
                batch.add_vertices([[1, 2, 3]])
            checksums[batch.result.revision] = batch.result.checksum

    editor = threading.Thread(target=edit)
    editor.start()
    backups = [session.backup(tmp_path / f"{i}").info for i in range(5)]
    editor.join()
    for i, info in enumerate(backups):
        restored = client.restore_backup(tmp_path / f"{i}", f"copy-{i}")
        assert restored.info.checksum == info.checksum == checksums[info.revision]
        restored.session.delete()


def test_what_is_damaged_is_refused_and_makes_nothing(client, filled, tmp_path):
    path = tmp_path / "part.dynb"
    filled.backup(path)
    good = path.read_bytes()
    for bad in (good[:-1], good[: len(good) // 2], b"", b"a mesh?", good[:100] + b"\0" + good[101:], good + b"x"):
        path.write_bytes(bad)
        with pytest.raises(dynmesh.DataLossError) as refused:
            client.restore_backup(path, "bad")
        assert refused.value.reason == "BACKUP_DAMAGED"
    path.write_bytes(good[:4] + b"\2" + good[5:])
    with pytest.raises(dynmesh.FailedPreconditionError, match="format 2"):
        client.restore_backup(path, "bad")
    with pytest.raises(dynmesh.NotFoundError):
        client.session("bad").info()


def test_a_dry_run_checks_and_makes_nothing(client, filled, tmp_path):
    filled.backup(tmp_path / "b")
    told = client.restore_backup(tmp_path / "b", "dry", validate_only=True)
    assert told.info.counts == filled.info().counts and told.info.uid == ""
    with pytest.raises(dynmesh.NotFoundError):
        told.session.info()


def test_a_retry_gets_the_first_answer(client, filled, tmp_path):
    filled.backup(tmp_path / "b")
    first = client.restore_backup(tmp_path / "b", "once", request_id="once")
    again = client.restore_backup(tmp_path / "b", "once", request_id="once")
    assert again.info.uid == first.info.uid
    first.session.delete()


def test_files_that_cannot_be_used_are_named(client, filled, tmp_path):
    with pytest.raises(FileNotFoundError):
        client.restore_backup(tmp_path / "none")
    with pytest.raises(IsADirectoryError):
        client.restore_backup(tmp_path)
    with pytest.raises(FileNotFoundError, match="no such folder"):
        filled.backup(tmp_path / "none" / "b")
    with pytest.raises(dynmesh.InvalidArgumentError) as refused:
        filled.backup(7)
    assert refused.value.metadata["field"] == "path"
    with pytest.raises(dynmesh.InvalidArgumentError):
        client.restore_backup(tmp_path / "none", durability="forever")


def test_a_backup_that_fails_leaves_the_file_that_was_there(client, tmp_path):
    path = tmp_path / "part.dynb"
    path.write_bytes(b"the last one")
    with pytest.raises(dynmesh.NotFoundError):
        client.session("nobody").backup(path)
    assert path.read_bytes() == b"the last one"
    assert os.listdir(tmp_path) == ["part.dynb"]


def test_a_session_moves_to_a_daemon_that_keeps_it(filled, tmp_path):
    filled.backup(tmp_path / "b")
    data = tmp_path / "data"
    with dynmesh.launch(data_dir=data) as daemon:
        restored = daemon.client.restore_backup(tmp_path / "b", "kept", durability="sync")
        assert restored.info.durability == "sync" and restored.info.durable_revision == 2
        assert daemon.client.restore_backup(tmp_path / "b").info.durability == "none"
    with dynmesh.launch(data_dir=data) as daemon:
        kept = daemon.client.session("kept")
        assert_equal(kept, filled)
        kept.backup(tmp_path / "c")
        assert [info.name for info in daemon.client.sessions()] == ["kept"]
    with pytest.raises(dynmesh.FailedPreconditionError) as refused, dynmesh.launch() as daemon:
        daemon.client.restore_backup(tmp_path / "c")
    assert refused.value.reason == "NO_STORE"


def run(daemon, *arguments):
    return subprocess.run(
        [*COMMAND, *map(str, arguments)],
        env={**os.environ, "DYNMESH_TARGET": daemon.target},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )


def test_the_command_writes_and_restores(daemon, client, filled, tmp_path):
    path = tmp_path / "part.dynb"
    said = run(daemon, "backup", filled.name, path)
    assert said.returncode == 0 and said.stderr == "", "no progress but on a terminal"
    assert said.stdout.startswith(f"wrote {path}: {filled.name} at revision 2, ")
    record = json.loads(run(daemon, "backup", filled.name, path, "--json").stdout)
    assert record == {
        "name": filled.name,
        "revision": 2,
        "file": str(path),
        "file_bytes": path.stat().st_size,
    }
    dry = run(daemon, "restore", path, "cli-copy", "--dry-run")
    assert dry.returncode == 0 and "it would make cli-copy at revision 2" in dry.stdout
    made = json.loads(run(daemon, "restore", path, "cli-copy", "--durability", "none", "--json").stdout)
    assert (made["name"], made["revision"], made["source_name"]) == ("cli-copy", 2, filled.name)
    assert_equal(client.session("cli-copy"), filled)
    taken = run(daemon, "restore", path, "cli-copy")
    assert taken.returncode == 1 and "[SESSION_EXISTS]" in taken.stderr
    path.write_bytes(b"DYNB")
    damaged = json.loads(run(daemon, "restore", path, "--json").stderr)
    assert damaged["error"]["reason"] == "BACKUP_DAMAGED"
    client.session("cli-copy").delete()
