"""Meshes through files: what goes in comes out, and other programs read it."""

import warnings

import dynmesh
import meshio
import numpy as np
import pytest
from dynmesh.files import read_mesh
from dynmesh.meshes import from_meshio
from hypothesis import given
from hypothesis import strategies as st
from shapes import TET, two_tets, zoo

VTK_TYPES = {"line": 3, "triangle": 5, "quad": 9, "tetra": 10, "hexahedron": 12, "wedge": 13, "pyramid": 14}
WIDTHS = {"line": 2, "triangle": 3, "quad": 4, "tetra": 4, "pyramid": 5, "wedge": 6, "hexahedron": 8}


def blocks_of(mesh: meshio.Mesh) -> dict[str, list]:
    """Elements by type, blocks of one type joined."""
    joined: dict[str, list] = {}
    for block in mesh.cells:
        joined.setdefault(block.type, []).extend(np.asarray(block.data).tolist())
    return joined


@pytest.mark.parametrize("name", ["keep.inp", "keep.stl", "keep.ply"])
def test_a_failed_export_leaves_the_old_file(session, tmp_path, name):
    session.import_mesh(zoo())
    (tmp_path / name).write_text("precious")
    with pytest.raises(dynmesh.FileFormatError):
        session.export(tmp_path / name)
    assert [path.name for path in tmp_path.iterdir()] == [name]
    assert (tmp_path / name).read_text() == "precious"


def test_every_type_comes_back_with_degenerates_and_duplicates(session):
    mesh = zoo()
    session.import_mesh(mesh)
    back = session.to_meshio()
    assert (back.points == mesh.points).all()
    assert blocks_of(back) == blocks_of(mesh)
    assert back.point_data["dynmesh:slot"].tolist() == list(range(15))


@given(data=st.data())
def test_any_soup_of_elements_comes_back(client, data):
    count = data.draw(st.integers(1, 12))
    finite = st.floats(allow_nan=False, allow_infinity=False, width=64)
    points = data.draw(st.lists(st.tuples(finite, finite, finite), min_size=count, max_size=count))
    node = st.integers(0, count - 1)
    types = data.draw(st.lists(st.sampled_from(sorted(WIDTHS)), max_size=6))
    blocks = [
        (
            name,
            data.draw(
                st.lists(st.lists(node, min_size=WIDTHS[name], max_size=WIDTHS[name]), min_size=1, max_size=3)
            ),
        )
        for name in types
    ]
    session = client.create_session("soup")
    try:
        session.import_mesh(points, blocks)
        snapshot = session.snapshot()
        assert np.array(points).tobytes() == snapshot.positions.tobytes()
        found = {block.type.meshio_name: block.vertices.tolist() for block in snapshot.blocks}
        assert found == blocks_of(meshio.Mesh(points, blocks))
        assert snapshot.to_meshio(slots=False).points.shape == (count, 3)
        assert snapshot.checksum() == session.info().checksum
        assert session.validate() == []
    finally:
        session.delete()


def test_ids_with_gaps_are_numbered_densely(session):
    session.import_mesh(two_tets())
    with session.edit() as tx:
        tx.remove_elements("cell", [0])
        tx.remove_vertices([0])
    back = session.to_meshio()
    assert back.cells[0].data.tolist() == [[0, 1, 2, 3]]
    assert back.point_data["dynmesh:slot"].tolist() == [1, 2, 3, 4]
    assert back.cell_data["dynmesh:slot"][0].tolist() == [1]
    assert (back.points == session.positions()).all()


@pytest.mark.parametrize("extension", ["vtu", "vtk", "msh", "inp", "mesh"])
def test_files_come_back_through_meshio(client, session, tmp_path, extension):
    mesh = zoo() if extension in ("vtu", "vtk") else two_tets()
    session.import_mesh(mesh)
    path = tmp_path / f"mesh.{extension}"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # formats have views of their own on integer data
        session.export(path, slots=extension == "vtu")
        back = client.create_session("back")
        try:
            back.import_mesh(path, attributes=[])
            assert blocks_of(back.to_meshio()) == blocks_of(mesh)
            assert (back.positions() == mesh.points).all()
        finally:
            back.delete()


@pytest.fixture
def vtk_grid(session, tmp_path):
    """The zoo with an attribute, as VTK reads it from an exported file."""
    vtk = pytest.importorskip("vtk")
    mesh = zoo()
    mesh.point_data = {"t": np.linspace(0, 1, 15)}
    session.import_mesh(mesh)
    session.export(tmp_path / "mesh.vtu")
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(tmp_path / "mesh.vtu"))
    reader.Update()
    return reader.GetOutput()


def test_an_exported_vtu_opens_in_vtk(session, vtk_grid):
    from vtk.util.numpy_support import vtk_to_numpy

    assert (vtk_to_numpy(vtk_grid.GetPoints().GetData()) == zoo().points).all()
    found: dict[int, list] = {}
    for i in range(vtk_grid.GetNumberOfCells()):
        cell = vtk_grid.GetCell(i)
        nodes = [cell.GetPointId(k) for k in range(cell.GetNumberOfPoints())]
        found.setdefault(vtk_grid.GetCellType(i), []).append(nodes)
    blocks = session.snapshot().blocks
    assert found == {VTK_TYPES[block.type.meshio_name]: block.vertices.tolist() for block in blocks}
    point_data = vtk_grid.GetPointData()
    assert (vtk_to_numpy(point_data.GetArray("t")) == np.linspace(0, 1, 15)).all()
    assert vtk_to_numpy(point_data.GetArray("dynmesh:slot")).tolist() == list(range(15))


def test_faces_of_solids_point_outwards_for_vtk(vtk_grid):
    solids = [vtk_grid.GetCell(i) for i in range(vtk_grid.GetNumberOfCells())]
    solids = [cell for cell in solids if cell.GetCellDimension() == 3]
    assert len(solids) == 4
    for cell in solids:
        points = [np.array(cell.GetPoints().GetPoint(k)) for k in range(cell.GetNumberOfPoints())]
        centre = np.mean(points, axis=0)
        for f in range(cell.GetNumberOfFaces()):
            face = cell.GetFace(f).GetPoints()
            a, b, c = (np.array(face.GetPoint(k)) for k in range(3))
            assert np.dot(np.cross(b - a, c - a), a - centre) > 0


def test_a_vertex_block_is_left_out_with_a_warning(session):
    mesh = meshio.Mesh(TET, [("vertex", [[0], [1]]), ("tetra", [[0, 1, 2, 3]])])
    mesh.cell_data = {"a": [np.array([5, 6]), np.array([7])]}
    with pytest.warns(UserWarning, match="vertex"):
        session.import_mesh(mesh)
    assert session.to_meshio().cell_data["a"][0].tolist() == [7]


def test_a_type_that_dynmesh_has_not_names_its_block():
    mesh = meshio.Mesh(np.zeros((10, 3)), [("tetra", [[0, 1, 2, 3]]), ("tetra10", [list(range(10))])])
    with pytest.raises(dynmesh.InvalidArgumentError, match="block 1 holds tetra10") as caught:
        from_meshio(mesh)
    assert caught.value.metadata == {"block": "1", "type": "tetra10"}


def test_sets_are_left_out_with_a_warning():
    mesh = two_tets()
    mesh.point_sets = {"fixed": np.array([0, 1])}
    with pytest.warns(UserWarning, match="point_sets"):
        from_meshio(mesh)


def test_the_ids_of_an_export_are_not_an_attribute(client, session, tmp_path):
    session.import_mesh(two_tets())
    session.export(tmp_path / "mesh.vtu")
    again = client.create_session("again")
    again.import_mesh(tmp_path / "mesh.vtu")
    assert again.info().attributes == () and again.info().checksum == session.info().checksum
    again.delete()


@pytest.mark.parametrize("content", [b"", b"not a mesh", b"<VTKFile>", b"\0" * 100])
def test_a_file_that_is_no_mesh_is_said_so(tmp_path, capsys, content):
    path = tmp_path / "bad.vtu"
    path.write_bytes(content)
    with pytest.raises(dynmesh.FileFormatError, match="cannot read"):
        read_mesh(path)
    assert capsys.readouterr().out == ""


def test_a_file_that_is_not_there_and_a_format_that_is_not(session, tmp_path):
    with pytest.raises(FileNotFoundError):
        session.import_mesh(tmp_path / "none.vtu")
    with pytest.raises(dynmesh.FileFormatError):
        session.export(tmp_path / "mesh.nonsense")
