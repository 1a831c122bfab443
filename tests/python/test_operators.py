"""Splits, collapses and swaps through the daemon; mirrors follow them."""

import dynmesh
import numpy as np
import pytest
from model import Model
from shapes import TET


def octahedron(session) -> None:
    """Four tetrahedra round the edge 4-5."""
    points = [[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0], [0, 0, -1], [0, 0, 1]]
    session.import_mesh(points, {"tetra": [[4, 5, i, (i + 1) % 4] for i in range(4)]})


def test_splits_collapses_and_swaps_are_followed_exactly(session):
    octahedron(session)
    with session.mirror() as mirror:
        with session.edit(report_lineage=True) as tx:
            middle = tx.split_edges(ends=[[4, 5]], parameters=0.25)
        assert session.positions(tx.result.resolve(middle)).tolist() == [[0, 0, -0.5]]
        assert session.counts.cells == 8
        lineage = tx.result.lineage[0]
        assert sorted(lineage.parents.tolist()) == [0, 0, 1, 1, 2, 2, 3, 3]
        assert set(lineage.kinds.tolist()) == {3} and len(set(lineage.elements.tolist())) == 8
        with session.edit() as tx:
            tx.collapse_edges(ends=[[5, 6]], parameters=0)
        assert session.counts.cells == 4
        with session.edit() as tx:
            tx.swap_edges(ends=[[4, 5]])
        with session.edit() as tx:
            tx.split_elements("cell", session.snapshot().blocks[0].ids[:1])
        mirror.wait(session.revision, timeout=30)
        assert mirror.checksum == session.info().checksum
    assert Model.of(session.snapshot()).checksum() == session.info().checksum


def test_a_vertex_of_a_split_serves_the_same_batch(session):
    octahedron(session)
    with session.edit() as tx:
        middle = tx.split_edges(ends=[[4, 5]])
        again = tx.split_edges(ends=[[4, middle[0]]])
        tx.move_vertices(again, [[0, 0, -0.3]])
    assert session.positions(tx.result.resolve(again)).tolist() == [[0, 0, -0.3]]


def test_refusals_say_why_and_can_be_passed_over(session):
    octahedron(session)
    with pytest.raises(dynmesh.FailedPreconditionError) as refused:
        with session.edit() as tx:
            tx.swap_edges(ends=[[0, 1]])
    assert refused.value.reason == "BOUNDARY" and refused.value.metadata["kind"] == "edge"
    assert session.revision == 1
    with session.edit(skip_refused=True) as tx:
        tx.swap_edges(ends=[[0, 1], [4, 5]])
        tx.split_edges(ends=[[0, 2], [4, 5]])
    assert tx.result.skipped[0].tolist() == [0]
    assert tx.result.refusals[0][0].reason == "BOUNDARY"
    assert tx.result.skipped[1].size >= 1
    assert tx.result.new_ids[1][tx.result.skipped[1]].tolist() == [0xFFFFFFFF] * tx.result.skipped[1].size


def test_shapes_are_kept_unless_told_otherwise(session):
    octahedron(session)
    with pytest.raises(dynmesh.FailedPreconditionError, match="WOULD_INVERT"):
        with session.edit() as tx:
            tx.split_edges(ends=[[4, 5]], positions=[[9, 9, 9]])
    with pytest.raises(dynmesh.FailedPreconditionError, match="WOULD_DEGRADE"):
        with session.edit() as tx:
            tx.split_edges(ends=[[4, 5]], min_quality=0.99)
    with session.edit() as tx:
        tx.split_edges(ends=[[4, 5]], positions=[[9, 9, 9]], allow_inversion=True)
    assert session.counts.cells == 8


@pytest.mark.parametrize(
    "arguments",
    [
        {},
        {"edges": [0], "ends": [[0, 1]]},
        {"edges": [0], "parameters": [0.1, 0.2]},
        {"edges": [0], "parameters": "half"},
        {"edges": [0], "min_quality": "high"},
        {"ends": [[0, 1, 2]]},
    ],
)
def test_arguments_are_checked_before_anything_is_sent(session, arguments):
    with pytest.raises(dynmesh.InvalidArgumentError):
        with session.edit() as tx:
            tx.split_edges(**arguments)


def test_a_quad_and_a_wire_are_split_with_their_edges(session):
    session.import_mesh(np.vstack([TET, [[1, 1, 0]]]), {"quad": [[0, 1, 4, 2]], "line": [[0, 1]]})
    with session.edit() as tx:
        tx.split_edges(ends=[[0, 1]])
    assert session.counts.faces == 3
    assert sum(block.type == dynmesh.ElementType.WIRE_EDGE and len(block.ids) for block in session.snapshot().blocks) == 2


def test_two_tetrahedra_are_welded_at_a_face(session):
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, -1]])
    session.import_mesh(points, {"tetra": [[0, 1, 2, 3], [4, 6, 5, 7]]})
    with session.edit() as tx:
        tx.merge_vertices([[0, 4], [1, 5], [2, 6]])
    assert (session.counts.vertices, session.counts.faces) == (5, 7)
    cells = session.snapshot().blocks[0].ids
    assert session.neighbors("cell", "cell", cells[:1]).row(0).tolist() == cells[1:].tolist()
    with pytest.raises(dynmesh.FailedPreconditionError, match="EDGE_EXISTS"):
        with session.edit() as tx:
            tx.merge_vertices([[0, 1]])


def test_a_dissolved_vertex_leaves_its_ring_triangulated(session):
    ring = [[np.cos(t), np.sin(t), 0] for t in np.arange(6) * np.pi / 3]
    session.import_mesh(np.array([[0, 0, 0], *ring]), {"triangle": [[0, 1 + i, 1 + (i + 1) % 6] for i in range(6)]})
    with session.edit(report_lineage=True) as tx:
        edit = tx.dissolve_vertices([0])
    assert (session.counts.vertices, session.counts.faces) == (6, 4)
    assert len(tx.result.lineage[edit].elements) == 4
    with pytest.raises(dynmesh.FailedPreconditionError, match="FACE_EXISTS|EDGE_EXISTS|WOULD_CHANGE_TOPOLOGY"):
        with session.edit() as tx:
            tx.dissolve_vertices(list(range(1, 7)))


def test_errors_name_the_item(session):
    with pytest.raises(dynmesh.InvalidArgumentError) as refused:
        dynmesh.EditBatch().split_edges(ends=[[0, 1], [0, -1]])
    assert refused.value.metadata["index"] == "1"
