"""Hostile arguments are refused by name, here or by the server, and change nothing."""

import dynmesh
import numpy as np
import pytest
from dynmesh import arrays, kinds
from dynmesh.edit import EditBatch
from hypothesis import given
from hypothesis import strategies as st
from shapes import TET


@pytest.mark.parametrize("ids", [[-1], [2**32], [0.5], ["a"], [[1, 2]], [True], 3, [None]])
def test_ids_are_a_row_of_integers_below_2_to_the_32(ids):
    with pytest.raises(dynmesh.InvalidArgumentError):
        arrays.as_ids(ids)


def test_a_bad_id_is_named_by_its_index():
    with pytest.raises(dynmesh.InvalidArgumentError) as caught:
        arrays.as_ids([4, 5, -1])
    assert caught.value.metadata == {"index": "2"}


@given(st.lists(st.integers(0, 2**32 - 1)))
def test_ids_survive_the_wire(ids):
    assert arrays.from_bytes(arrays.u32_bytes(arrays.as_ids(ids)), "<u4").tolist() == ids


@pytest.mark.parametrize(
    "points", [[[0, 0]], [1, 2, 3], [[[1, 2, 3]]], [["a", "b", "c"]], [[1j, 0, 0]], [[0, 0, 0], [1]]]
)
def test_points_are_rows_of_three_reals(points):
    with pytest.raises(dynmesh.InvalidArgumentError):
        arrays.as_points(points)


def test_single_precision_points_are_widened_exactly():
    points = np.array([[0.1, 0.2, 0.3]], dtype=np.float32)
    assert (arrays.as_points(points) == points).all()


@pytest.mark.parametrize("name", ["tri", "", 4, None, "vertex"])
def test_unknown_element_types_are_refused(name):
    with pytest.raises(dynmesh.InvalidArgumentError, match="BAD_ELEMENT_TYPE"):
        kinds.as_element_type(name)


@pytest.mark.parametrize("kind", ["Vertex", "", 1, None])
def test_unknown_kinds_are_refused(kind):
    with pytest.raises(dynmesh.InvalidArgumentError, match="BAD_ENTITY_KIND"):
        kinds.as_kind(kind)


def test_rows_of_elements_must_have_the_width_of_their_type():
    with pytest.raises(dynmesh.InvalidArgumentError, match="BAD_ARRAY_LENGTH"):
        EditBatch().add_elements("tetra", [[0, 1, 2]])


def test_positions_and_ids_must_be_as_many():
    with pytest.raises(dynmesh.InvalidArgumentError, match="BAD_ARRAY_LENGTH"):
        EditBatch().move_vertices([0, 1], [[0, 0, 0]])


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_positions_that_are_not_finite_are_refused_by_index(session, bad):
    with pytest.raises(dynmesh.InvalidArgumentError) as caught:
        with session.edit() as tx:
            tx.add_vertices([[0, 0, 0], [0, bad, 0]])
    assert caught.value.reason == "NON_FINITE_VALUE"
    assert caught.value.metadata["edit"] == "0" and caught.value.metadata["index"] == "1"
    assert session.revision == 0


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_an_import_that_is_not_finite_is_refused(session, bad):
    with pytest.raises(dynmesh.InvalidArgumentError, match="NON_FINITE_VALUE"):
        session.import_mesh([[0, 0, bad]], {})
    assert session.info().counts == (0, 0, 0, 0)


def test_an_import_whose_elements_name_no_vertex_is_refused(session):
    with pytest.raises(dynmesh.DynmeshError) as caught:
        session.import_mesh(TET, {"tetra": [[0, 1, 2, 4]]})
    assert isinstance(caught.value, ValueError) or isinstance(caught.value, LookupError)
    assert session.revision == 0


def test_ids_that_never_existed_are_not_found(session):
    session.import_mesh(TET, {"tetra": [[0, 1, 2, 3]]})
    for call in (
        lambda: session.positions([4]),
        lambda: session.neighbors("cell", "vertex", [0, 2**32 - 1]),
        lambda: session.entities("edge", [6]),
    ):
        with pytest.raises(dynmesh.NotFoundError) as caught:
            call()
        assert caught.value.reason == "UNKNOWN_ENTITY" and len(caught.value.ids) == 1


@pytest.mark.parametrize("ids", [slice(0, 10, 2), slice(-3, None), slice(None, -1)])
def test_slices_are_plain_ranges_of_ids(session, ids):
    with pytest.raises(dynmesh.InvalidArgumentError):
        session.neighbors("vertex", "cell", ids)


def test_cells_have_no_boundary(session):
    with pytest.raises(dynmesh.InvalidArgumentError, match="BAD_ENTITY_KIND"):
        session.boundary("cell")


def test_handles_without_a_vertex_are_refused(session):
    with pytest.raises(dynmesh.DynmeshError):
        with session.edit() as tx:
            handles = tx.add_vertices(TET)
            tx.add_elements("tetra", [np.append(handles[:3], handles[3] + 1)])
    assert session.revision == 0


@pytest.mark.parametrize("revision", [2**70, -(2**63) - 1, 1.5, "1", None])
def test_a_revision_that_is_no_64_bit_integer_is_refused(session, revision):
    session.import_mesh(TET, {})
    uses = [
        lambda: session.positions([0], as_of_revision=revision),
        lambda: session.neighbors("vertex", "cell", [0], as_of_revision=revision),
        lambda: session.apply(EditBatch(), as_of_revision=revision),
        lambda: session.edit_stream(as_of_revision=revision),
    ]
    if revision is not None:
        uses.append(lambda: session.apply(EditBatch(), if_revision=revision))
    for use in uses:
        with pytest.raises(dynmesh.InvalidArgumentError, match="BAD_ARGUMENT"):
            use()


@pytest.mark.parametrize("options", [{"min_interval": x} for x in (float("nan"), float("inf"), -1.0, 1e9)])
def test_an_interval_that_is_none_is_refused(session, options):
    with pytest.raises(dynmesh.InvalidArgumentError, match="min_interval"):
        session.mirror(**options)
    with pytest.raises(dynmesh.InvalidArgumentError, match="position_bits"):
        session.mirror(position_bits=2**40)


ODD_ARGUMENTS = {
    "name": lambda s, c: c.create_session(5),
    "name ": lambda s, c: c.session(None),
    "name  ": lambda s, c: c.delete_session(["a"]),
    "duplicates": lambda s, c: c.create_session("odd", duplicates=[]),
    "checks": lambda s, c: c.create_session("odd", checks=None),
    "stored_relations": lambda s, c: c.create_session("odd", stored_relations=None),
    "request_id": lambda s, c: c.create_session("odd", request_id=5),
    "checks ": lambda s, c: s.set_checks(None),
    "checks  ": lambda s, c: s.set_checks(["inverted"]),
    "checks   ": lambda s, c: s.check(5),
    "checks    ": lambda s, c: s.check([["inverted"]]),
    "etag": lambda s, c: s.set_checks({}, etag=5),
    "etag ": lambda s, c: s.delete(etag=None),
    "stored_relations ": lambda s, c: s.store_relations([5]),
    "steps": lambda s, c: s.repair(None),
    "steps ": lambda s, c: s.repair(["orient"]),
    "weld": lambda s, c: s.repair(weld="wide"),
    "batch": lambda s, c: s.apply(None),
    "batch ": lambda s, c: s.edit_stream().submit(None),
    "request_id ": lambda s, c: s.apply(EditBatch(), request_id=5),
    "if_revision": lambda s, c: s.undo(if_revision="1"),
    "conflict_policy": lambda s, c: s.apply(EditBatch(), conflict_policy=[]),
    "window": lambda s, c: s.edit_stream(window=0),
    "slot_order": lambda s, c: s.import_mesh(TET, {}, slot_order=[]),
    "cells": lambda s, c: s.import_mesh(TET, 5),
    "cells ": lambda s, c: s.import_mesh(TET, [5]),
    "size_attribute": lambda s, c: s.adapt(size_attribute=5),
    "path": lambda s, c: s.export(5),
    "position_bits": lambda s, c: s.boundary_surface("14"),
    "codec": lambda s, c: s.mirror(codec=[]),
    "min_interval": lambda s, c: s.mirror(min_interval="1"),
    "from_mirror": lambda s, c: s.mirror(from_mirror=s),
    "on_delta": lambda s, c: s.mirror(on_delta=5),
    "method": lambda s, c: EditBatch().smooth_vertices([0], method=[]),
    "name   ": lambda s, c: EditBatch().add_attribute(5, "cell"),
    "components": lambda s, c: EditBatch().add_attribute("heat", "cell", components=0),
    "heat": lambda s, c: EditBatch().add_attribute("heat", "cell", "real"),
    "default": lambda s, c: EditBatch().add_attribute("heat", "cell", default=[[1], [1, 2]]),
    "values": lambda s, c: EditBatch().set_attribute("heat", "cell", [0, 1], [[1], [1, 2]]),
    "timeout": lambda s, c: dynmesh.connect(timeout="soon"),
    "retries": lambda s, c: dynmesh.connect(retries=-1),
    "read_ahead_bytes": lambda s, c: dynmesh.connect(read_ahead_bytes="1"),
    "target": lambda s, c: dynmesh.connect(5),
}


@pytest.mark.parametrize("what", ODD_ARGUMENTS)
def test_an_odd_argument_is_named(session, client, what):
    with pytest.raises(dynmesh.InvalidArgumentError) as caught:
        ODD_ARGUMENTS[what](session, client)
    assert what.strip() in (caught.value.metadata["field"], caught.value.metadata.get("attribute"))
    assert session.revision == 0


@pytest.mark.parametrize("timeout", ["1", 0, -1.0, np.nan, True, [1], 10**400])
def test_an_odd_timeout_is_refused_by_every_kind_of_call(session, timeout):
    calls = (session.info, session.snapshot, session.validate, session.check, session.undo)
    for call in (*calls, lambda timeout: session.import_mesh(TET, {}, timeout=timeout)):
        with pytest.raises(dynmesh.InvalidArgumentError, match="timeout"):
            call(timeout=timeout)


@pytest.mark.parametrize("timeout", [1e300, np.float32(30), 30, np.inf])
def test_a_timeout_may_be_any_positive_number(session, timeout):
    assert session.info(timeout=timeout).revision == 0
    with session.mirror() as mirror:
        assert mirror.wait(0, timeout=timeout) == 0


@pytest.mark.parametrize("ids", [slice("a", 3), slice(0.5, 3), slice(0, "b"), slice(0, 3, "c"), slice(0, 2**70)])
def test_odd_slices_are_refused(session, ids):
    with pytest.raises(dynmesh.InvalidArgumentError, match="of ids"):
        session.positions(ids)


def test_handles_of_new_vertices_are_no_ids_of_queries(session):
    with session.edit() as tx:
        handles = tx.add_vertices(TET)
    for ask in (session.positions, lambda ids: session.neighbors("vertex", "edge", ids)):
        with pytest.raises(dynmesh.InvalidArgumentError) as caught:
            ask([0, handles[1]])
        assert caught.value.reason == "FOREIGN_HANDLE" and caught.value.metadata["index"] == "1"
    assert (session.positions(tx.result.resolve(handles)) == TET).all()


@pytest.mark.parametrize("vertices", [[0.5], ["a"], [-1], 2**32 - 1, [[0, 2**31 + 4]], "all", None])
def test_what_is_no_vertex_of_a_batch_is_not_resolved(session, vertices):
    with session.edit() as tx:
        handles = tx.add_vertices(TET)
    with pytest.raises(dynmesh.InvalidArgumentError, match="vertices"):
        tx.result.resolve(vertices)
    assert tx.result.resolve(handles[1]) == tx.result.new_vertices[1]
    assert tx.result.resolve([]).shape == (0,)


def test_a_smoothing_factor_of_zero_is_refused(session):
    session.import_mesh(TET, {"tetra": [[0, 1, 2, 3]]})
    with pytest.raises(dynmesh.InvalidArgumentError) as caught:
        with session.edit() as tx:
            tx.smooth_vertices([0], factor=0, move_boundary=True)
    assert caught.value.metadata["field"] == "factor" and session.revision == 1


def test_rows_of_other_components_are_told_from_an_unknown_column(session):
    session.import_mesh(TET, {"tetra": [[0, 1, 2, 3]]})
    with session.edit() as tx:
        tx.add_attribute("flow", "cell", components=3)
    with pytest.raises(dynmesh.InvalidArgumentError) as caught:
        with session.edit() as tx:
            tx.set_attribute("flow", "cell", [0], [1.0])
    assert caught.value.metadata["field"] == "components" and "3" in caught.value.message
    with pytest.raises(dynmesh.NotFoundError, match="UNKNOWN_ATTRIBUTE"):
        with session.edit() as tx:
            tx.set_attribute("flow", "face", [0], [[1.0, 2.0, 3.0]])
