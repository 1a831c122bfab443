"""Errors are typed, carry reasons, and are the builtins that callers expect."""

import pickle
import socket

import dynmesh
import pytest
from dynmesh import errors
from hypothesis import given
from hypothesis import strategies as st
from shapes import TET


def field(number: int, payload: bytes) -> bytes:
    """A length-delimited protobuf field of less than 128 bytes."""
    return bytes([number << 3 | 2, len(payload)]) + payload


INFO = field(1, b"LINK") + field(2, b"dynmesh") + field(3, field(1, b"ids") + field(2, b"3,5"))
STATUS = (
    b"\x08\x05"
    + field(2, b"no")
    + field(3, field(1, b"type.googleapis.com/google.rpc.ErrorInfo") + field(2, INFO))
)


def test_reason_and_metadata_are_read_from_a_google_rpc_status():
    assert errors.parse_error_info(STATUS) == ("LINK", {"ids": "3,5"})


@given(st.binary(max_size=64))
def test_any_bytes_are_read_without_an_exception(blob):
    reason, metadata = errors.parse_error_info(blob)
    assert isinstance(reason, str) and isinstance(metadata, dict)


@given(st.integers(0, len(STATUS) - 1), st.integers(0, 255))
def test_a_damaged_status_is_read_without_an_exception(at, value):
    errors.parse_error_info(STATUS[:at] + bytes([value]) + STATUS[at + 1 :])
    errors.parse_error_info(STATUS[:at])


@pytest.mark.parametrize(
    ("kind", "builtin"),
    [
        (dynmesh.InvalidArgumentError, ValueError),
        (dynmesh.NotFoundError, LookupError),
        (dynmesh.FailedPreconditionError, RuntimeError),
        (dynmesh.OutOfRangeError, IndexError),
        (dynmesh.UnavailableError, ConnectionError),
        (dynmesh.DeadlineExceededError, TimeoutError),
        (dynmesh.PermissionDeniedError, PermissionError),
        (dynmesh.UnimplementedError, NotImplementedError),
    ],
)
def test_errors_are_the_fitting_builtins(kind, builtin):
    error = kind("no", reason="WHY", metadata={"ids": "3,5,...", "revision": "7"})
    assert isinstance(error, builtin) and isinstance(error, dynmesh.DynmeshError)
    assert (str(error), error.ids, error.revision) == ("no [WHY]", (3, 5), 7)


def test_errors_can_be_pickled():
    error = pickle.loads(pickle.dumps(dynmesh.UnavailableError("gone", reason="WHY", metadata={"a": "b"})))
    assert (type(error), error.reason, error.metadata) == (dynmesh.UnavailableError, "WHY", {"a": "b"})


def test_codes_without_a_class_are_internal():
    assert type(errors.make_error(2, "what")) is dynmesh.InternalError


def test_a_missing_session_is_not_found(client):
    with pytest.raises(dynmesh.NotFoundError) as caught:
        client.session("nobody").info()
    assert caught.value.reason == "SESSION_NOT_FOUND"


def test_a_name_that_is_taken_exists_already(client, session):
    with pytest.raises(dynmesh.AlreadyExistsError, match="SESSION_EXISTS"):
        client.create_session(session.name)


@pytest.mark.parametrize("name", ["", ".hidden", "a" * 65, "a b", "ä", "a/b"])
def test_bad_names_are_invalid(client, name):
    with pytest.raises(dynmesh.InvalidArgumentError, match="BAD_SESSION_NAME"):
        client.create_session(name)


def test_a_vertex_in_use_cannot_be_removed(session):
    session.import_mesh(TET, {"tetra": [[0, 1, 2, 3]]})
    with pytest.raises(dynmesh.FailedPreconditionError) as caught:
        with session.edit() as tx:
            tx.remove_vertices([2])
    assert caught.value.reason == "VERTEX_IN_USE"
    assert session.revision == 1


def test_an_id_that_was_reused_is_refused_by_the_revision_it_was_read_at(session):
    session.import_mesh(TET, {})
    with session.edit() as tx:
        tx.remove_vertices([3])
    with pytest.raises(dynmesh.NotFoundError) as gone:
        session.positions([3])
    with session.edit() as tx:
        tx.add_vertices([[5, 5, 5]])
    assert tx.result.new_vertices.tolist() == [3]
    with pytest.raises(dynmesh.NotFoundError) as reused:
        session.positions([3], as_of_revision=1)
    assert (gone.value.reason, reused.value.reason) == ("ENTITY_REMOVED", "ENTITY_REMOVED")
    assert reused.value.ids == (3,)
    assert session.positions([3]).tolist() == [[5, 5, 5]]


def test_a_revision_in_the_future_is_out_of_range(session):
    session.import_mesh(TET, {})
    with pytest.raises(dynmesh.OutOfRangeError, match="REVISION_IN_FUTURE"):
        session.positions([0], as_of_revision=2)


def test_a_call_that_nobody_answers_exceeds_its_deadline():
    with socket.create_server(("127.0.0.1", 0)) as mute:
        with dynmesh.connect("127.0.0.1:%d" % mute.getsockname()[1]) as client:
            with pytest.raises(dynmesh.DeadlineExceededError):
                client.session("a").info(timeout=0.1)


def test_nobody_at_the_target_is_unavailable():
    with dynmesh.connect("unix:/nonexistent/dynmesh", retries=1) as client:
        with pytest.raises(dynmesh.UnavailableError):
            client.session("a").info()
