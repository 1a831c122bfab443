"""Neighbourhoods, entities and the boundary, against brute force."""

import itertools

import dynmesh
import numpy as np
import pytest
from dynmesh import EntityKind
from model import Model, Oracle
from shapes import TET, grid_tets, two_tets, zoo

KINDS = ("vertex", "edge", "face", "cell")


@pytest.fixture
def zoo_without_degenerates(session):
    mesh = zoo()
    mesh.cells[5] = type(mesh.cells[5])("triangle", mesh.cells[5].data[:2])
    session.import_mesh(mesh)
    return session


@pytest.mark.parametrize(("origin", "target"), list(itertools.product(KINDS, KINDS)))
def test_all_relations_equal_brute_force(zoo_without_degenerates, origin, target):
    session = zoo_without_degenerates
    oracle = Oracle(session, Model.of(session.snapshot()))
    if origin == target or KINDS.index(origin) < KINDS.index(target):
        expected = {i: sorted(row) for i, row in oracle.relation(origin, target).items()}
        assert session.neighbors(origin, target).to_dict() == expected
    else:
        found = session.neighbors(origin, target)
        assert {i: set(row) for i, row in found.to_dict().items()} == oracle.relation(origin, target)


@pytest.mark.parametrize("kind", ["vertex", "edge", "face"])
def test_the_boundary_equals_brute_force(zoo_without_degenerates, kind):
    session = zoo_without_degenerates
    found = session.boundary(kind)
    assert set(found.tolist()) == Oracle(session, Model.of(session.snapshot())).boundary(kind)
    assert (np.diff(found.astype(int)) > 0).all()
    listed = session.entities(kind)
    assert listed.ids[listed.on_boundary].tolist() == found.tolist()


def test_rows_come_in_the_order_of_the_request(session):
    session.import_mesh(two_tets())
    csr = session.neighbors("cell", "vertex", [1, 0, 1])
    assert csr.ids.tolist() == [1, 0, 1]
    assert [csr.row(i).tolist() for i in range(3)] == [[1, 2, 3, 4], [0, 1, 2, 3], [1, 2, 3, 4]]
    assert csr.offsets.tolist() == [0, 4, 8, 12] and csr.revision == 1


def test_a_slice_means_the_live_ones_in_between(session):
    session.import_mesh(two_tets())
    with session.edit() as tx:
        tx.remove_elements("cell", [0])
    assert session.neighbors("vertex", "cell", slice(1, 3)).to_dict() == {1: [1], 2: [1]}
    assert session.neighbors("cell", "cell", slice(None)).to_dict() == {1: []}
    assert session.entities("cell", slice(0, 100)).ids.tolist() == [1]


def test_nothing_asked_is_nothing_answered(session):
    csr = session.neighbors("vertex", "cell", [])
    assert (len(csr.ids), csr.offsets.tolist(), len(csr.neighbors)) == (0, [0], 0)
    assert session.positions().shape == (0, 3)


def test_answers_of_many_chunks_are_joined(session):
    mesh = grid_tets(24)
    session.import_mesh(mesh, progress=False)
    csr = session.neighbors("vertex", "cell")
    counts = np.bincount(mesh.cells[0].data.ravel(), minlength=len(mesh.points))
    assert (np.diff(csr.offsets) == counts).all()
    rows = np.repeat(np.arange(len(mesh.points)), counts)
    assert (mesh.cells[0].data[csr.neighbors] == rows[:, None]).any(axis=1).all()
    assert (session.positions(np.arange(15624, -1, -1)) == mesh.points[::-1]).all()


def test_a_list_of_ids_that_no_message_holds_is_asked_in_parts(session, monkeypatch):
    session.import_mesh(two_tets())
    monkeypatch.setattr("dynmesh.queries.CHUNK_BYTES", 8)
    assert session.neighbors("cell", "vertex", [1, 0, 1, 1, 0]).ids.tolist() == [1, 0, 1, 1, 0]


def test_entities_say_what_they_are(session):
    session.import_mesh(two_tets())
    with session.edit() as tx:
        tx.add_elements("triangle", [[1, 2, 3], [3, 2, 1]])
    faces = session.entities("face", tx.result.new_ids[0])
    assert faces.is_element.all() and faces.is_duplicate.tolist() == [False, True]
    assert faces.born_revisions.tolist() == [1, 2] and faces.kind == EntityKind.FACE
    assert faces.vertices.tolist() == [1, 2, 3, 3, 2, 1] and faces.revision == 2
    assert not session.entities("face", [i for i in range(7) if i != faces.ids[0]]).is_element.any()


def test_the_boundary_surface_is_a_draco_mesh_of_the_outer_faces(session):
    session.import_mesh(two_tets())
    surface = session.boundary_surface(16)
    assert surface.drc.startswith(b"DRACO") and surface.revision == 1
    pytest.importorskip("dynmesh._native")
    slots, positions, triangles = surface.decode()
    assert len(triangles) == 6 and set(slots.tolist()) == set(range(5))
    assert np.abs(positions - session.positions(slots)).max() < 2**-14
    expected = {
        tuple(sorted(f))
        for f in session.neighbors("face", "vertex", session.boundary("face")).to_dict().values()
    }
    assert {tuple(sorted(t)) for t in slots[triangles].tolist()} == expected


def test_there_is_no_surface_without_faces(session):
    session.import_mesh(TET, {})
    with pytest.raises(dynmesh.FailedPreconditionError):
        session.boundary_surface()


def test_a_surface_that_was_damaged_is_data_loss(session):
    with pytest.raises(dynmesh.DynmeshError):
        dynmesh.Surface(b"DRACO not really", 1).decode()


def test_rows_are_indexed_like_a_list(session):
    session.import_mesh(two_tets())
    stars = session.neighbors("vertex", "cell", [0, 4])
    assert stars.row(-1).tolist() == stars.row(1).tolist()
    for index in (2, -3):
        with pytest.raises(IndexError):
            stars.row(index)
