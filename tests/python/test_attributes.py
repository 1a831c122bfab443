"""Attribute columns keep values exactly, or say that they cannot."""

import dynmesh
import meshio
import numpy as np
import pytest
from dynmesh.columns import as_values
from shapes import TET, two_tets


@pytest.mark.parametrize(
    "dtype", [np.bool_, np.int8, np.uint8, np.int16, np.uint16, np.int32, np.int64, np.uint64]
)
def test_integers_that_fit_become_int32(dtype):
    values = as_values(np.array([0, 1], dtype=dtype), "a")
    assert values.dtype == np.int32 and values.tolist() == [[0], [1]]


@pytest.mark.parametrize("dtype", [np.float16, np.float32, np.float64])
def test_floats_become_float64_exactly(dtype):
    given = np.array([[0.1, -0.0], [1e-5, 3]], dtype=dtype)
    assert (as_values(given, "a") == given).all()


@pytest.mark.parametrize(
    "values",
    [
        [2**31],
        [-(2**31) - 1],
        np.array([2**63], np.uint64),
        ["a"],
        [1j],
        np.zeros((2, 17)),
        np.zeros((2, 3, 3)),
        np.zeros((2, 0)),
        np.zeros(2, np.longdouble),
        5,
    ],
)
def test_what_would_change_is_refused_by_the_name_of_the_column(values):
    with pytest.raises(dynmesh.InvalidArgumentError, match="'stress'") as caught:
        as_values(values, "stress")
    assert caught.value.metadata == {"attribute": "stress"}


def test_data_of_a_mesh_comes_back(session):
    mesh = two_tets()
    mesh.point_data = {"t": np.linspace(0, 1, 5), "v": np.arange(15, dtype=float).reshape(5, 3)}
    mesh.cell_data = {"id": [np.array([7, -8])]}
    session.import_mesh(mesh)
    back = session.to_meshio(slots=False)
    assert (back.point_data["t"] == mesh.point_data["t"]).all()
    assert (back.point_data["v"] == mesh.point_data["v"]).all()
    assert back.cell_data["id"][0].tolist() == [7, -8]


def test_only_the_attributes_that_were_named_are_taken(session):
    mesh = two_tets()
    mesh.point_data = {"good": np.zeros(5), "bad": np.full(5, 2**40)}
    session.import_mesh(mesh, attributes=["good"])
    assert [spec.name for spec in session.info().attributes] == ["good"]


def test_a_name_that_the_server_cannot_have_is_changed_with_a_warning(session):
    mesh = two_tets()
    mesh.cell_data = {"gmsh:physical": [np.array([1, 2])]}
    with pytest.warns(UserWarning, match="gmsh_physical"):
        session.import_mesh(mesh)
    assert session.info().attributes == (("gmsh_physical", dynmesh.EntityKind.CELL, "int32", 1),)


def test_two_columns_that_would_share_a_name_are_refused(session):
    mesh = two_tets()
    mesh.point_data = {"a:b": np.zeros(5), "a;b": np.zeros(5)}
    with pytest.warns(UserWarning), pytest.raises(dynmesh.InvalidArgumentError, match="share a name"):
        session.import_mesh(mesh)


def test_a_column_of_cells_goes_to_each_kind_of_element(session):
    mesh = meshio.Mesh(TET, [("triangle", [[0, 1, 2]]), ("tetra", [[0, 1, 2, 3]]), ("line", [[0, 1]])])
    mesh.cell_data = {"group": [np.array([1]), np.array([2]), np.array([3])]}
    session.import_mesh(mesh)
    back = session.to_meshio()
    groups = {block.type: data.tolist() for block, data in zip(back.cells, back.cell_data["group"])}
    assert groups == {"triangle": [1], "tetra": [2], "line": [3]}


def test_blocks_of_other_kinds_hold_zeros(session):
    session.import_mesh(TET, {"tetra": [[0, 1, 2, 3]], "line": [[0, 1]]})
    with session.edit() as tx:
        tx.add_attribute("q", "cell", np.float64, 2)
        tx.set_attribute("q", "cell", [0], [[0.5, 0.25]])
    back = session.to_meshio()
    data = {block.type: values.tolist() for block, values in zip(back.cells, back.cell_data["q"])}
    assert data == {"line": [[0, 0]], "tetra": [[0.5, 0.25]]}


def test_columns_of_one_name_and_two_shapes_are_told_apart(session):
    session.import_mesh(TET, {"tetra": [[0, 1, 2, 3]], "line": [[0, 1]]})
    with session.edit() as tx:
        tx.add_attribute("q", "cell", np.float64)
        tx.add_attribute("q", "edge", np.int32)
        tx.set_attribute("q", "edge", [0], [5])
    data = session.to_meshio(slots=False).cell_data
    assert sorted(data) == ["q:cell", "q:edge"]
    assert [values.tolist() for values in data["q:edge"]] == [[5], [0]]


def test_rows_follow_their_entities_into_a_mirror(session):
    session.import_mesh(TET, {})
    with session.edit() as tx:
        tx.add_attribute("t", "vertex", np.int32)
        tx.set_attribute("t", "vertex", [1, 3], [10, 30])
    with session.mirror() as mirror:
        mirror.wait(2, timeout=20)
        assert mirror.attribute("t", "vertex")[:, 0].tolist() == [0, 10, 0, 30]
        with session.edit() as tx:
            tx.remove_vertices([3])
        mirror.wait(3, timeout=20)
        with session.edit() as tx:
            tx.add_vertices([[1, 1, 1]])
        mirror.wait(4, timeout=20)
        assert mirror.attribute("t", "vertex")[:, 0].tolist() == [0, 10, 0, 0]


def test_a_column_that_is_not_there_and_one_that_is_twice(session):
    session.import_mesh(TET, {})
    with pytest.raises(dynmesh.DynmeshError, match="UNKNOWN_ATTRIBUTE"):
        with session.edit() as tx:
            tx.set_attribute("t", "vertex", [0], [1.0])
    with pytest.raises(dynmesh.AlreadyExistsError, match="ATTRIBUTE_EXISTS"):
        with session.edit() as tx:
            tx.add_attribute("t", "vertex")
            tx.add_attribute("t", "vertex")


def test_a_name_that_the_mesh_has_not_is_refused(session):
    mesh = two_tets()
    for names in (["nope"], "nope"):
        with pytest.raises(dynmesh.InvalidArgumentError):
            session.import_mesh(mesh, attributes=names)
    assert session.info().revision == 0
