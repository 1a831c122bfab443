"""Sessions that outlive their daemon."""

import subprocess

import dynmesh
import pytest
from dynmesh.daemon import find_daemon
from shapes import two_tets
from waiting import await_serving, await_state


def test_a_session_is_there_again_with_its_ids(tmp_path):
    with dynmesh.launch(data_dir=tmp_path) as daemon:
        session = daemon.client.create_session("part")
        imported = session.import_mesh(two_tets(), progress=False)
        assert (imported.info.revision, imported.info.durable_revision) == (1, 1)
        with session.edit() as batch:
            batch.split_edges([0])
        before = session.info()
        edges = session.neighbors("edge", "vertex")
        assert (before.durability, before.durable_revision, before.state) == ("sync", 2, "loaded")
    with dynmesh.launch(data_dir=tmp_path) as daemon:
        (listed,) = daemon.client.sessions()
        assert (listed.name, listed.revision, listed.state) == ("part", 2, "stored")
        session = daemon.client.session("part")
        after = session.info()
        assert (after.uid, after.revision, after.checksum) == (before.uid, before.revision, before.checksum)
        assert after.counts == before.counts and after.state == "loaded"
        assert session.neighbors("edge", "vertex").ids.tolist() == edges.ids.tolist()
        assert session.validate() == []
        with session.mirror() as mirror:
            mirror.wait(2, 30)
            assert mirror.checksum == after.checksum


def test_what_an_adaptation_made_is_on_disk_when_it_answers(tmp_path):
    with dynmesh.launch(data_dir=tmp_path) as daemon:
        session = daemon.client.create_session("part")
        session.import_mesh(two_tets(), progress=False)
        result = session.adapt(0.5, progress=False)
        assert result.revision > 1 and result.durable_revision == result.revision
    with dynmesh.launch(data_dir=tmp_path) as daemon:
        revisions = list(daemon.client.session("part").revisions())
        assert [each.kind for each in revisions] == ["adaptation"] * (result.revision - 1) + ["import"]


def test_a_mirror_goes_on_across_a_restart(tmp_path):
    directory = tmp_path / "data"
    socket = f"--unix_socket={tmp_path / 'socket'}"
    mirrored = []
    with dynmesh.connect(f"unix:{tmp_path / 'socket'}") as client:
        with dynmesh.launch(data_dir=directory, flags=[socket]):
            session = client.create_session("part")
            session.import_mesh(two_tets(), progress=False)
            mirror = session.mirror(on_delta=lambda update: mirrored.append(update.from_revision))
            mirror.wait(1, 30)
        with dynmesh.launch(data_dir=directory, flags=[socket]):
            await_serving(session)
            with session.edit() as batch:
                batch.add_vertices([[9, 9, 9]])
            mirror.wait(2, 30)
            assert mirror.checksum == session.info().checksum
            assert 1 in mirrored, "it went on from where it was"
            mirror.close()


def test_without_a_data_directory_nothing_can_be_kept(client):
    assert client.create_session("plain").info().durability == "none"
    client.session("plain").delete()
    with pytest.raises(dynmesh.FailedPreconditionError) as refused:
        client.create_session("kept", durability="sync")
    assert refused.value.reason == "NO_STORE"
    with pytest.raises(dynmesh.InvalidArgumentError, match="none, async, sync"):
        client.create_session("kept", durability="forever")


def test_a_session_may_end_with_its_daemon(tmp_path):
    with dynmesh.launch(data_dir=tmp_path) as daemon:
        daemon.client.create_session("scratch", durability="none")
        daemon.client.create_session("deleted").delete()
    with dynmesh.launch(data_dir=tmp_path) as daemon:
        assert list(daemon.client.sessions()) == []


def test_two_daemons_do_not_share_a_directory(tmp_path):
    with dynmesh.launch(data_dir=tmp_path) as daemon:
        second = subprocess.run(
            [find_daemon(), "--listen=127.0.0.1:0", f"--data_dir={tmp_path}"], capture_output=True, text=True
        )
        assert second.returncode != 0
        assert str(daemon.pid) in second.stderr, "it says who has it"


def test_a_retry_after_a_restart_gets_the_first_answer(tmp_path):
    def add(daemon: dynmesh.Daemon) -> tuple[int, list[int]]:
        with daemon.client.session("part").edit(request_id="once") as batch:
            batch.add_vertices([[0, 0, 0], [1, 0, 0]])
        return batch.result.revision, batch.result.new_vertices.tolist()

    with dynmesh.launch(data_dir=tmp_path) as daemon:
        daemon.client.create_session("part")
        first = add(daemon)
    with dynmesh.launch(data_dir=tmp_path) as daemon:
        assert add(daemon) == first
        assert daemon.client.session("part").info().counts.vertices == 2


def test_an_idle_session_is_unloaded_and_comes_back(tmp_path):
    with dynmesh.launch(data_dir=tmp_path, idle_timeout=0.001) as daemon:
        client = daemon.client
        session = client.create_session("part")
        session.import_mesh(two_tets(), progress=False)
        before = session.info()
        await_state(client, "part", "stored")
        after = session.info()
        assert (after.state, after.revision, after.checksum) == ("loaded", 1, before.checksum)
        with session.edit() as batch:
            batch.add_vertices([[9, 9, 9]])
        assert batch.result.revision == 2


def test_a_memory_budget_unloads_what_is_not_used(tmp_path):
    with dynmesh.launch(data_dir=tmp_path, idle_timeout=0, max_loaded_bytes=1) as daemon:
        for name in ("one", "two"):
            daemon.client.create_session(name).import_mesh(two_tets(), progress=False)
        for name in ("one", "two"):
            await_state(daemon.client, name, "stored")
        assert daemon.client.session("one").info().counts.cells == 2
