"""Mirrors: equal to their session after every revision, whatever happens on the way."""

import threading

import dynmesh
import numpy as np
import pytest
from dynmesh.delta import decode_delta
from dynmesh.follower import Follower
from dynmesh.raw_delta import decode_raw
from dynmesh.v1 import subscriptions_pb2
from model import Model
from proxy import Proxy
from shapes import TET, grid_tets, two_tets, zoo

native = pytest.importorskip("dynmesh._native")

WAIT_S = 30


def move(session, ids, to=None):
    """One revision."""
    with session.edit() as tx:
        tx.move_vertices(ids, np.random.default_rng(len(ids)).random((len(ids), 3)) if to is None else to)
    return tx.result.revision


def assert_equal(mirror, session):
    """The mirror is where the session is, and holds what it holds."""
    info = session.info()
    mirror.wait(info.revision, timeout=WAIT_S)
    assert (mirror.revision, mirror.checksum) == (info.revision, info.checksum)
    assert Model.of(mirror.snapshot()) == Model.of(session.snapshot())


@pytest.mark.parametrize("codec", ["auto", "draco", "zstd", "raw"])
def test_it_follows_from_nothing_and_live(session, codec):
    session.import_mesh(zoo())
    with session.mirror(codec=codec) as mirror:
        assert_equal(mirror, session)
        with session.edit() as tx:
            new = tx.add_vertices(TET + 20)
            tx.add_elements("tetra", [new])
            tx.remove_elements("cell", [2])
            tx.remove_elements(
                "edge",
                [i for i in session.entities("edge").ids if session.entities("edge", [i]).is_element[0]],
            )
        assert_equal(mirror, session)
        assert mirror.num_elements("cell") == 4 and mirror.num_vertices == 19
        assert mirror.stats.deltas >= 2 and mirror.stats.refollows == 0


@pytest.mark.parametrize("codec", ["auto", "raw"])
def test_a_snapshot_of_many_chunks_appears_at_once(session, codec):
    session.import_mesh(grid_tets(24), progress=False)
    seen = []
    with session.mirror(codec=codec, on_delta=lambda update: seen.append(update.revision)) as mirror:
        assert_equal(mirror, session)
        assert seen == [1]
        move(session, np.arange(15625))
        assert_equal(mirror, session)
        stats = mirror.stats
        assert stats.topology_bytes <= stats.raw_topology_bytes and stats.raw_geometry_bytes > 0
        assert len(stats.latencies_s) == stats.deltas and stats.latency_s() >= 0


def test_an_edit_while_it_arrives_is_not_lost(session):
    session.import_mesh(grid_tets(24), progress=False)
    with session.mirror() as mirror:
        for _ in range(20):
            move(session, np.arange(0, 15625, 7), np.random.default_rng(1).random((2233, 3)))
        assert_equal(mirror, session)


def test_arrays_are_by_slot_and_cannot_be_written(session):
    session.import_mesh(two_tets())
    with session.mirror() as mirror:
        mirror.wait(1, timeout=WAIT_S)
        with mirror.lock:
            cells = mirror.elements("cell")
            assert cells.types.tolist() == [4, 4] and cells.vertices[1].tolist() == [1, 2, 3, 4]
            assert (mirror.positions == two_tets().points).all() and mirror.live_vertices.all()
            with pytest.raises(ValueError):
                mirror.positions[0] = 0
        with pytest.raises(KeyError):
            mirror.attribute("none", "cell")


def test_waiting_ends_with_the_deadline(session):
    with session.mirror() as mirror:
        with pytest.raises(dynmesh.DeadlineExceededError):
            mirror.wait(1, timeout=0.05)
        with pytest.raises(dynmesh.DeadlineExceededError):
            for update in mirror.updates(timeout=0.05):
                assert update.revision == 0


def test_quantised_positions_lie_on_a_grid_and_topology_is_proved(session):
    mesh = grid_tets(6)
    session.import_mesh(mesh, progress=False)
    with session.mirror(position_bits=10) as mirror:
        mirror.wait(1, timeout=WAIT_S)
        assert np.abs(mirror.positions - mesh.points).max() <= 1.01 / 1023
        assert mirror.checksum.topology == session.info().checksum.topology
        move(session, [0], [[0.5, 0.5, 0.5]])
        mirror.wait(2, timeout=WAIT_S)
        assert np.abs(mirror.positions[0] - 0.5).max() <= 1.01 / 1023


def test_it_takes_a_broken_connection_up_where_it_was(daemon, session):
    proxy = Proxy(daemon.target.removeprefix("unix:"))
    session.import_mesh(grid_tets(8), progress=False)
    with dynmesh.connect(proxy.target) as client, client.session(session.name).mirror() as mirror:
        mirror.wait(1, timeout=WAIT_S)
        first = mirror.stats.raw_geometry_bytes
        for _ in range(3):
            proxy.cut(refuse=True)
            revision = move(session, [0, 5])
            proxy.heal()
            mirror.wait(revision, timeout=WAIT_S)
        assert_equal(mirror, session)
        assert mirror.stats.reconnects >= 3 and mirror.stats.refollows == 0
        assert 0 < mirror.stats.raw_geometry_bytes - first < 1000 < first  # two vertices a time
    proxy.close()


def test_it_goes_on_from_a_closed_mirror(session):
    session.import_mesh(grid_tets(8), progress=False)
    with session.mirror() as old:
        old.wait(1, timeout=WAIT_S)
    revision = move(session, [3])
    with session.mirror(from_mirror=old) as mirror:
        mirror.wait(revision, timeout=WAIT_S)
        assert_equal(mirror, session)
        assert mirror.stats.raw_geometry_bytes < 100 < old.stats.raw_geometry_bytes
    assert old.revision == 1


def test_a_copy_that_differs_is_fetched_again(session):
    session.import_mesh(two_tets())
    with session.mirror() as mirror:
        mirror.wait(1, timeout=WAIT_S)
        with mirror.lock:
            mirror._state.vertices.geometry += 1
        revision = move(session, [0])
        mirror.wait(revision, timeout=WAIT_S)
        assert_equal(mirror, session)
        assert mirror.stats.refollows == 1


def test_a_copy_that_never_agrees_ends_the_mirror(session, monkeypatch):
    monkeypatch.setattr("dynmesh.mirror_state.vertex_sum", lambda slots: 1)
    session.import_mesh(two_tets())
    with session.mirror() as mirror:
        with pytest.raises(dynmesh.MirrorError, match="CHECKSUM_MISMATCH"):
            mirror.wait(1, timeout=WAIT_S)
        assert mirror.stats.refollows == 1
        with pytest.raises(dynmesh.MirrorError):
            mirror.snapshot()


def test_a_session_made_anew_under_its_name_is_followed_from_its_beginning(client):
    session = client.create_session("phoenix")
    session.import_mesh(grid_tets(4), progress=False)
    with session.mirror() as old:
        old.wait(1, timeout=WAIT_S)
    session.delete()
    session = client.create_session("phoenix")
    with session.mirror(from_mirror=old) as mirror:  # revision 1 is in the future there
        session.import_mesh(two_tets())
        assert_equal(mirror, session)
        assert mirror.stats.refollows == 1
    session.delete()


def test_a_namesake_that_has_come_as_far_is_not_taken_for_the_old_session(client):
    session = client.create_session("phoenix")
    with session.edit() as tx:
        tx.add_vertices([[0, 0, 0], [1, 0, 0]])
        tx.add_attribute("t", "vertex")
    with session.edit() as tx:
        tx.set_attribute("t", "vertex", [0], [7.0])
    with session.mirror() as old:
        old.wait(2, timeout=WAIT_S)
    uid = session.info().uid
    session.delete()
    session = client.create_session("phoenix")
    assert session.info().uid != uid
    with session.edit() as tx:  # the same vertices, so the same checksum: only the attribute differs
        tx.add_vertices([[0, 0, 0], [1, 0, 0]])
        tx.add_attribute("t", "vertex")
    revision = move(session, [0], [[0, 0, 0]])
    with session.mirror(from_mirror=old) as mirror:
        mirror.wait(revision, timeout=WAIT_S)
        assert_equal(mirror, session)
        assert mirror.stats.refollows == 1
        assert not mirror.attribute("t", "vertex").any()
    session.delete()


def test_one_that_reads_slowly_is_sent_fewer_larger_deltas(daemon, session):
    session.import_mesh(grid_tets(12), progress=False)
    read_on = threading.Event()
    with daemon.connect(read_ahead_bytes=64 << 10) as client:
        with client.session(session.name).mirror(codec="raw", on_delta=lambda _: read_on.wait(WAIT_S)) as mirror:
            mirror.wait(1, timeout=WAIT_S)
            for _ in range(40):
                revision = move(session, np.arange(13**3))  # 60 KB each
            read_on.set()
            mirror.wait(revision, timeout=WAIT_S)
            assert_equal(mirror, session)
            assert mirror.stats.deltas < 10
    with pytest.raises(dynmesh.InvalidArgumentError):
        daemon.connect(read_ahead_bytes=1000)


def test_deleting_the_session_ends_it(client):
    session = client.create_session("short")
    with session.mirror() as mirror:
        mirror.wait(0, timeout=WAIT_S)
        session.delete()
        with pytest.raises(dynmesh.NotFoundError):
            mirror.wait(1, timeout=WAIT_S)


def test_a_missing_session_is_told_by_wait(client):
    with client.session("nobody").mirror() as mirror:
        with pytest.raises(dynmesh.NotFoundError, match="SESSION_NOT_FOUND"):
            mirror.wait(1, timeout=WAIT_S)


def test_while_paused_it_stands_still_and_then_gets_less(session):
    session.import_mesh(grid_tets(4), progress=False)
    with session.mirror() as mirror:
        mirror.wait(1, timeout=WAIT_S)
        mirror.pause()
        for _ in range(30):
            revision = move(session, [1, 2])
        assert mirror.revision == 1
        before = mirror.stats.deltas
        mirror.resume()
        mirror.wait(revision, timeout=WAIT_S)
        assert_equal(mirror, session)
        assert mirror.stats.deltas - before <= 30


class Messages:
    """A subscription whose second message arrives when its follower is paused."""

    def __init__(self, payload: bytes) -> None:
        self._payload = payload
        self.follower: Follower | None = None
        self.taken: list[int] = []
        self.arrived, self.took_second = threading.Event(), threading.Event()

    def subscribe(self, request):
        return self

    def __iter__(self):
        for revision in (1, 2):
            if revision == 2:
                self.follower.set_paused(True)
                self.arrived.set()
            yield subscriptions_pb2.SubscribeResponse(delta=self._payload, revision=revision, consistent=True)

    def cancel(self):
        pass

    # ---- The follower's sink ----

    def resume_at(self):
        return 0, ""

    def received(self, message):
        pass

    def take(self, deltas, message):
        self.taken.append(message.revision)
        if message.revision == 2:
            self.took_second.set()

    def reconnecting(self):
        pass


def test_a_message_that_arrives_during_a_pause_waits(session):
    for resumes in (False, True):
        messages = Messages(payload_of(session))
        messages.follower = Follower(messages.subscribe, subscriptions_pb2.SubscribeRequest(), messages)
        messages.follower.start()
        assert messages.arrived.wait(WAIT_S)
        if resumes:
            messages.follower.set_paused(False)
            assert messages.took_second.wait(WAIT_S)
        messages.follower.close()
        assert messages.taken[:2] == ([1, 2] if resumes else [1])


def test_updates_skip_for_the_slow_and_end_with_the_mirror(session):
    session.import_mesh(two_tets())
    mirror = session.mirror()
    mirror.wait(1, timeout=WAIT_S)
    steps = mirror.updates(timeout=WAIT_S)
    assert next(steps).revision == 1
    revision = [move(session, [0], [[i, 0, 0]]) for i in range(5)][-1]
    mirror.wait(revision, timeout=WAIT_S)
    update = next(steps)
    assert update.revision == revision and update.deltas[-1].vertex_slots.tolist() == [0]
    threading.Timer(0.0, mirror.close).start()
    assert list(steps) == []


def test_an_exception_of_the_callback_ends_it_with_that_cause(session):
    session.import_mesh(two_tets())

    def fail(update):
        raise ZeroDivisionError("mine")

    with session.mirror(on_delta=fail) as mirror:
        with pytest.raises(dynmesh.MirrorError, match="mine") as caught:
            mirror.wait(2, timeout=WAIT_S)
    assert isinstance(caught.value.__cause__, ZeroDivisionError)


def test_the_callback_may_close_it(session):
    session.import_mesh(two_tets())
    closed = threading.Event()
    holder: list[dynmesh.Mirror] = []
    ready = threading.Event()

    def close(update):
        ready.wait(WAIT_S)
        holder[0].close()
        closed.set()

    holder.append(session.mirror(on_delta=close))
    ready.set()
    assert closed.wait(WAIT_S)
    holder[0].close()


def test_a_closed_mirror_can_still_be_read(session):
    session.import_mesh(two_tets())
    mirror = session.mirror()
    mirror.wait(1, timeout=WAIT_S)
    mirror.close()
    assert mirror.revision == 1 and len(mirror.to_meshio().points) == 5
    with pytest.raises(dynmesh.MirrorError, match="CLOSED"):
        mirror.wait(2, timeout=WAIT_S)


def test_a_bad_request_is_refused(session):
    with pytest.raises(dynmesh.InvalidArgumentError):
        session.mirror(codec="zip")
    with session.mirror(position_bits=99) as mirror:
        with pytest.raises(dynmesh.InvalidArgumentError):
            mirror.wait(1, timeout=WAIT_S)


def payload_of(session, codec=0, position_bits=0):
    """The first message of a subscription."""
    request = subscriptions_pb2.SubscribeRequest(
        session=session.name, codec=codec, position_bits=position_bits
    )
    call = session._subscriptions.Subscribe(request)
    try:
        return next(iter(call)).delta
    finally:
        call.cancel()


def assert_same(one, other):
    """Two decoded deltas are equal, part by part."""
    if isinstance(one, np.ndarray):
        assert one.dtype == other.dtype and one.shape == other.shape and one.tobytes() == other.tobytes()
    elif isinstance(one, dict):
        assert one.keys() == other.keys()
        for key in one:
            assert_same(one[key], other[key])
    elif isinstance(one, (list, tuple)):
        assert len(one) == len(other)
        for left, right in zip(one, other, strict=True):
            assert_same(left, right)
    else:
        assert one == other


@pytest.mark.parametrize("newest", [False, True])
@pytest.mark.parametrize("position_bits", [0, 12])
def test_raw_deltas_are_decoded_alike_in_numpy(session, position_bits, newest):
    session.import_mesh(zoo())
    with session.edit() as tx:
        tx.remove_elements("cell", [0])
        tx.remove_vertices([14])
        for kind in ("vertex", "cell"):
            tx.add_attribute("t", kind, np.int32, 2)
            tx.add_attribute("u", kind, np.float64)
            tx.set_attribute("t", kind, [1], [[-5, 7]])
            tx.set_attribute("u", kind, [2, 3], [0.25, -1e300])
        if newest:  # columns that only version 2 of the format can describe
            for number, dtype in enumerate((np.float32, np.int64, np.uint8)):
                tx.add_attribute(f"v{number}", "vertex", dtype, 3, default=[1, 2, 3], policy="drop")
                tx.set_attribute(f"v{number}", "vertex", [1, 5], [[7, 8, 9], [0, 0, 255]])
    payload = payload_of(session, subscriptions_pb2.DELTA_CODEC_RAW, position_bits)
    assert payload[4] == (2 if newest else 1)
    assert_same(native.decode(payload), decode_raw(payload))


def test_it_follows_without_the_native_module(session, monkeypatch):
    for module in ("delta", "checksum"):
        monkeypatch.setattr(f"dynmesh.{module}._native", None)
    monkeypatch.setattr("dynmesh.session.HAS_NATIVE", False)
    session.import_mesh(zoo())
    with session.mirror() as mirror:
        assert_equal(mirror, session)
        move(session, [0, 3])
        assert_equal(mirror, session)
        assert mirror.stats.refollows == 0
    with pytest.raises(dynmesh.UnimplementedError, match="NO_NATIVE_MODULE"):
        session.mirror(codec="draco")


@pytest.mark.parametrize("decode", [decode_delta, decode_raw])
def test_damaged_payloads_are_typed_errors_and_nothing_worse(session, decode):
    session.import_mesh(zoo())
    with session.edit() as tx:
        tx.add_attribute("t", "vertex", np.float32, 2, default=[1, 2])
        tx.set_attribute("t", "vertex", [1, 5], [[7, 8], [0, 255]])
    payload = payload_of(session, subscriptions_pb2.DELTA_CODEC_RAW)
    rng = np.random.default_rng(5)
    for _ in range(500):
        damaged = bytearray(payload)
        for at in rng.integers(0, len(damaged), rng.integers(1, 4)):
            damaged[at] ^= 1 << rng.integers(0, 8)
        try:  # without the package xxhash, numpy cannot tell all damage
            decode(bytes(damaged[: rng.integers(0, 2 * len(damaged))]))
        except (dynmesh.DataLossError, dynmesh.UnimplementedError):
            continue
        assert decode is decode_raw
