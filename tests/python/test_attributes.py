"""Attribute columns keep values exactly, or say that they cannot."""

import dynmesh
import meshio
import numpy as np
import pytest
from dynmesh.columns import as_values, point_columns
from shapes import TET, two_tets


COLUMN_DTYPES = [np.float64, np.float32, np.int64, np.int32, np.uint8]


@pytest.mark.parametrize(
    ("given", "kept"),
    [(dtype, dtype) for dtype in COLUMN_DTYPES]
    + [(np.float16, np.float32), (np.bool_, np.uint8), (np.int8, np.int32), (np.int16, np.int32)]
    + [(np.uint16, np.int32), (np.uint32, np.int64), (np.uint64, np.int64)],
)
def test_values_keep_their_type_or_get_the_nearest_that_holds_them(given, kept):
    given = np.array([[0, 1], [1, 0]], dtype=given)
    values = as_values(given, "a")
    assert values.dtype == kept and (values == given).all()


@pytest.mark.parametrize(
    "values",
    [
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
    assert "`attributes`" not in caught.value.message  # which only imports have
    with pytest.raises(dynmesh.InvalidArgumentError, match="naming the others in `attributes`"):
        point_columns({"stress": values}, None)


@pytest.mark.parametrize("dtype", COLUMN_DTYPES)
def test_columns_of_each_type_travel_to_files_and_mirrors_as_they_are(session, dtype):
    mesh = two_tets()
    mesh.point_data = {"t": np.array([[0, 1], [2, 3], [4, 5], [6, 7], [8, 100]], dtype)}
    session.import_mesh(mesh)
    assert session.info().attributes[0].dtype == np.dtype(dtype).name
    with session.mirror() as mirror:
        mirror.wait(1, timeout=20)
        for copy in (session.to_meshio(), mirror.to_meshio()):
            assert copy.point_data["t"].dtype == dtype
            assert (copy.point_data["t"] == mesh.point_data["t"]).all()


@pytest.mark.parametrize("codec", ["auto", "raw"])
def test_a_default_is_the_row_of_whoever_has_none(session, codec):
    session.import_mesh(TET, {"tetra": [[0, 1, 2, 3]], "line": [[0, 1]]})
    with session.mirror(codec=codec) as early:
        with session.edit() as tx:
            tx.add_attribute("t", "vertex", np.float32, 2, default=[0.5, -1], policy="max")
            tx.add_attribute("q", "edge", np.int64, default=-7)
            tx.set_attribute("t", "vertex", [3], [[1, 2]])
        with session.edit() as tx:
            tx.remove_elements("cell", [0])
            tx.remove_vertices([3])
        with session.edit() as tx:
            tx.add_vertices([[0, 0, 2], [0, 0, 3]])
        with session.edit() as tx:
            tx.set_attribute("t", "vertex", [4], [[3, 4]])
        early.wait(5, timeout=20)
        with session.mirror(codec=codec) as late:
            late.wait(5, timeout=20)
            for mirror in (early, late):
                assert mirror.attribute("t", "vertex").tolist() == 4 * [[0.5, -1]] + [[3, 4]]
                assert mirror.attribute("q", "edge").tolist() == [[-7]]
                assert mirror.to_meshio().cell_data["q"][0].tolist() == [-7]
    assert session.to_meshio().point_data["t"].tolist() == 4 * [[0.5, -1]] + [[3, 4]]
    assert session.info().attributes == (
        ("t", dynmesh.EntityKind.VERTEX, "float32", 2, "max", (0.5, -1.0)),
        ("q", dynmesh.EntityKind.EDGE, "int64", 1, "copy", (-7,)),
    )


@pytest.mark.parametrize(("policy", "middle"), [("interpolate", 15), ("copy", 10), ("max", 20), ("drop", 3)])
def test_policies_say_what_a_new_vertex_takes(session, policy, middle):
    session.import_mesh(TET, {"tetra": [[0, 1, 2, 3]]})
    with session.edit() as tx:
        tx.add_attribute("t", "vertex", np.uint8, default=3, policy=policy)
        tx.set_attribute("t", "vertex", [0, 1], [10, 20])
        tx.split_edges(ends=[[0, 1]])
    assert session.to_meshio().point_data["t"].tolist() == [10, 20, 3, 3, middle]


@pytest.mark.parametrize(
    ("arguments", "field"),
    [
        ({"dtype": np.int16}, "type"),
        ({"policy": "mean"}, "policy"),
        ({"default": [1, 2]}, "default_row"),
        ({"default": 0.1, "dtype": np.float32}, "default_row"),
        ({"default": 256, "dtype": np.uint8}, "default_row"),
        ({"default": 2.5, "dtype": np.int64}, "default_row"),
        ({"default": 2**63, "dtype": np.int64}, "default_row"),
        ({"default": "a"}, "default_row"),
    ],
)
def test_a_column_that_cannot_be_is_refused_by_its_field(session, arguments, field):
    with pytest.raises(dynmesh.InvalidArgumentError, match="'t'") as caught, session.edit() as tx:
        tx.add_attribute("t", "vertex", **arguments)
    assert caught.value.metadata == {"attribute": "t", "field": field}
    assert session.info().revision == 0


def test_a_default_that_is_not_finite_is_refused(session):
    with pytest.raises(dynmesh.InvalidArgumentError, match="NON_FINITE_VALUE"), session.edit() as tx:
        tx.add_attribute("t", "vertex", default=np.inf)
    assert session.info().attributes == ()


def test_values_of_another_type_are_taken_only_as_what_they_are(session):
    session.import_mesh(TET, {})
    with session.edit() as tx:
        tx.add_attribute("t", "vertex", np.float32)
        tx.set_attribute("t", "vertex", [0, 1], np.array([7, 8]))
        tx.set_attribute("t", "vertex", [2], np.float32([0.1]))
    assert session.to_meshio().point_data["t"].tolist() == [7, 8, np.float32(0.1), 0]
    with pytest.raises(dynmesh.InvalidArgumentError, match="INEXACT_VALUE"), session.edit() as tx:
        tx.set_attribute("t", "vertex", [0, 3], [0.5, 0.1])
    assert session.to_meshio().point_data["t"].tolist() == [7, 8, np.float32(0.1), 0]


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
    mesh.point_data = {"good": np.zeros(5), "bad": np.full(5, 2**63, np.uint64)}
    session.import_mesh(mesh, attributes=["good"])
    assert [spec.name for spec in session.info().attributes] == ["good"]


def test_a_name_that_the_server_cannot_have_is_changed_with_a_warning(session):
    mesh = two_tets()
    mesh.cell_data = {"gmsh:physical": [np.array([1, 2])]}
    with pytest.warns(UserWarning, match="gmsh_physical"):
        session.import_mesh(mesh)
    assert session.info().attributes == (
        ("gmsh_physical", dynmesh.EntityKind.CELL, "int64", 1, "copy", (0,)),
    )


def test_blocks_of_one_column_get_a_type_that_holds_all_of_them(session):
    mesh = meshio.Mesh(TET, [("tetra", [[0, 1, 2, 3]]), ("tetra", [[0, 2, 1, 3]])])
    mesh.cell_data = {"a": [np.array([2**53]), np.array([0.5])]}
    session.import_mesh(mesh)
    assert session.to_meshio().cell_data["a"][0].tolist() == [2.0**53, 0.5]
    mesh.cell_data = {"a": [np.array([2**53 + 1]), np.array([0.5])]}
    with pytest.raises(dynmesh.InvalidArgumentError, match="'a'"):
        session.import_mesh(mesh)


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


def test_rows_of_a_mirror_are_gathered_by_the_slots_of_positions_and_elements(session):
    session.import_mesh(TET, {"tetra": [[0, 1, 2, 3]], "line": [[0, 1]]})
    with session.mirror() as mirror:
        with session.edit() as tx:
            tx.add_attribute("t", "vertex", np.float32, 2, default=[1, 2])
            tx.add_attribute("c", "cell", np.uint8, default=9)
            tx.add_attribute("q", "edge", np.int64, default=-7)
            tx.set_attribute("t", "vertex", [1], [[3, 4]])
        mirror.wait(2, timeout=20)
        with mirror.lock:
            corners = mirror.attribute("t", "vertex")[mirror.elements("cell").vertices[0]]
        assert corners.tolist() == [[1, 2], [3, 4], [1, 2], [1, 2]]
        with session.edit() as tx:
            new = tx.add_vertices([[0, 0, 2], [0, 0, 3]])
            tx.add_elements("tetra", [[0, 1, new[0], new[1]]])
            tx.set_attribute("q", "edge", [5], [50])  # of no element
        mirror.wait(3, timeout=20)
        with mirror.lock:
            assert mirror.attribute("t", "vertex").tolist()[4:] == [[1, 2], [1, 2]]
            assert len(mirror.attribute("t", "vertex")) == len(mirror.positions) == 6
            assert mirror.attribute("c", "cell").tolist() == [[9], [9]]
            assert mirror.attribute("q", "edge")[:, 0].tolist() == [-7, -7, -7, -7, -7, 50]


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
