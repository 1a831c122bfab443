"""Sessions by name: making, listing, describing, filling and deleting them."""

import dynmesh
import numpy as np
import pytest
from shapes import TET, grid_tets, two_tets, zoo


def test_a_new_session_is_empty_at_revision_0(session):
    info = session.info()
    assert (info.name, info.revision, info.counts) == (session.name, 0, (0, 0, 0, 0))
    assert info.bounds is None and info.checksum == (0, 0) and info.duplicates == "keep"


def test_info_describes_what_was_imported(session):
    session.import_mesh(two_tets())
    info = session.info()
    assert info.revision == 1 and info.counts == (5, 9, 7, 2)
    assert info.element_counts.cells == 2 and info.boundary_counts == (5, 9, 6, 0)
    assert info.euler_characteristic == 1
    assert info.bounds.tolist() == [[0, 0, 0], [1, 1, 1]]
    assert session.counts == info.counts


def test_sessions_are_listed_by_name_over_pages(client, monkeypatch):
    monkeypatch.setattr("dynmesh.client._PAGE_SIZE", 3)
    names = [f"page-{i}" for i in range(8)]
    made = [client.create_session(name) for name in reversed(names)]
    assert [info.name for info in client.sessions() if info.name.startswith("page-")] == names
    for session in made:
        session.delete()


def test_creating_twice_with_one_request_id_is_creating_once(client):
    client.create_session("twice", request_id="r")
    client.create_session("twice", request_id="r").delete()


def test_a_deleted_session_is_gone(client):
    session = client.create_session("gone")
    session.import_mesh(TET, {})
    assert client.delete_session("gone") == 1
    with pytest.raises(dynmesh.NotFoundError):
        session.info()


def test_deleting_with_an_old_etag_is_aborted(client, session):
    etag = session.info().etag
    session.import_mesh(TET, {})
    with pytest.raises(dynmesh.AbortedError, match="ETAG_MISMATCH"):
        client.delete_session(session.name, etag=etag)


def test_an_import_gives_ids_in_the_callers_order(session):
    mesh = zoo()
    result = session.import_mesh(mesh)
    assert result.revision == 1 and result.info.counts.cells == 4
    assert (session.positions() == mesh.points).all()
    cells = session.entities("cell")
    assert cells.types.tolist() == [7, 5, 6, 4]
    assert cells.vertices[:8].tolist() == list(range(8))


def test_an_import_warns_of_degenerate_and_duplicate_elements(session):
    reasons = {w.reason: w.count for w in session.import_mesh(zoo()).warnings}
    assert reasons == {"DEGENERATE_ELEMENT": 1, "DUPLICATE_ELEMENT": 1}


def test_duplicates_can_be_refused(client):
    session = client.create_session("strict", duplicates="refuse")
    with pytest.raises(dynmesh.InvalidArgumentError, match="DUPLICATE_ELEMENT"):
        session.import_mesh(TET, [("tetra", [[0, 1, 2, 3], [1, 2, 0, 3]])])
    assert session.revision == 0
    session.delete()
    with pytest.raises(dynmesh.InvalidArgumentError):
        client.create_session("odd", duplicates="sometimes")


def test_only_an_empty_session_can_be_filled(session):
    session.import_mesh(TET, {})
    with pytest.raises(dynmesh.FailedPreconditionError, match="SESSION_NOT_EMPTY"):
        session.import_mesh(TET, {})


def test_a_validated_import_leaves_the_session_empty(session):
    result = session.import_mesh(two_tets(), validate_only=True)
    assert result.info.counts == (5, 9, 7, 2)
    assert session.info().counts == (0, 0, 0, 0) and session.revision == 0


def test_a_mesh_of_many_chunks_comes_back_as_it_went(session):
    mesh = grid_tets(24)  # 15,625 points and 82,944 tetrahedra: beyond a megabyte
    session.import_mesh(mesh, progress=False)
    snapshot = session.snapshot()
    assert (snapshot.positions == mesh.points).all()
    assert (snapshot.blocks[0].vertices == mesh.cells[0].data).all()
    assert snapshot.checksum() == session.info().checksum


def test_an_empty_session_exports_nothing(session):
    snapshot = session.snapshot()
    assert snapshot.revision == 0 and snapshot.positions.shape == (0, 3) and snapshot.blocks == ()
    assert len(snapshot.to_meshio().points) == 0


def test_progress_is_shown_when_asked_for_and_only_then(session, capsys):
    session.import_mesh(two_tets())
    assert capsys.readouterr().err == ""
    session.snapshot(progress=True)
    assert "exporting" in capsys.readouterr().err


def test_points_of_the_plane_get_a_z_of_zero(session):
    mesh = two_tets()
    mesh.points, mesh.cells = mesh.points[:3, :2].astype(np.float32), []
    session.import_mesh(mesh)
    assert session.positions().tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


STORABLE = [
    ("cell", "edge"),
    ("vertex", "cell"),
    ("edge", "cell"),
    ("vertex", "face"),
    ("cell", "cell"),
    ("vertex", "vertex"),
]


def test_relations_can_be_stored_at_any_moment_and_answers_stay_the_same(session):
    session.import_mesh(grid_tets(3))
    before = {pair: session.neighbors(*pair).to_dict() for pair in STORABLE}
    info = session.store_relations(STORABLE)
    assert [(str(a), str(b)) for a, b in info.stored_relations] == STORABLE
    assert all(size > 0 for size in info.stored_relations.values()) and info.revision == 1
    assert {pair: session.neighbors(*pair).to_dict() for pair in STORABLE} == before
    with session.edit() as tx:
        tx.remove_elements("cell", range(0, 100, 3))
    edited = {pair: session.neighbors(*pair).to_dict() for pair in STORABLE}
    assert session.store_relations([]).stored_relations == {}
    assert {pair: session.neighbors(*pair).to_dict() for pair in STORABLE} == edited != before
    assert session.validate() == []


def test_relations_that_cannot_be_stored_are_refused(session):
    with pytest.raises(dynmesh.InvalidArgumentError, match="edge->edge"):
        session.store_relations([("edge", "edge")])
    with pytest.raises(dynmesh.InvalidArgumentError, match="twice"):
        session.store_relations([("cell", "cell"), (dynmesh.EntityKind.CELL, "cell")])
    with pytest.raises(dynmesh.InvalidArgumentError, match="pair of kinds"):
        session.store_relations(["vertex-cell"])
    with pytest.raises(dynmesh.AbortedError, match="ETAG_MISMATCH"):
        session.store_relations([], etag="another")
    assert session.info().stored_relations == {}


def test_an_update_is_repeated_only_without_an_etag(session, monkeypatch):
    unary, repeatable = session._caller.unary, []

    def watch(method, request, timeout, **options):
        repeatable.append(options["repeatable"])
        return unary(method, request, timeout, **options)

    etag = session.info().etag
    monkeypatch.setattr(session._caller, "unary", watch)
    session.store_relations([("cell", "cell")], etag=etag)
    session.store_relations([])
    assert repeatable == [False, True]


def test_a_session_stores_from_the_beginning_what_it_was_created_with(client):
    session = client.create_session("storing", stored_relations=[("vertex", "cell")])
    session.import_mesh(TET, {"tetra": [[0, 1, 2, 3]]})
    (pair,) = session.info().stored_relations
    assert pair == (dynmesh.EntityKind.VERTEX, dynmesh.EntityKind.CELL)
    session.delete()


def test_a_hilbert_import_tells_the_ids(session):
    mesh = grid_tets(6)
    points, tets = mesh.points, np.asarray(mesh.cells[0].data)
    shuffled = np.random.default_rng(5).permutation(len(tets))
    result = session.import_mesh(points, {"tetra": tets[shuffled]}, slot_order="hilbert")
    vertex, cell = (result.slots[kind] for kind in (dynmesh.EntityKind.VERTEX, dynmesh.EntityKind.CELL))
    assert sorted(vertex) == list(range(len(points))) and sorted(cell) == list(range(len(tets)))
    assert (session.positions()[vertex] == points).all()
    stored = session.neighbors("cell", "vertex").neighbors.reshape(-1, 4)
    assert (stored[cell] == vertex[tets[shuffled]]).all()
    # Along the curve vertices are neighbours in space; in the order of the grid every row begins with a jump.
    assert _mean_step(session.positions()) < 0.9 * _mean_step(points)


def _mean_step(points):
    return np.linalg.norm(np.diff(points, axis=0), axis=1).mean()


def test_an_unknown_slot_order_is_refused(session):
    with pytest.raises(dynmesh.InvalidArgumentError, match="slot_order"):
        session.import_mesh(TET, {}, slot_order="random")
