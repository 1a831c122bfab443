"""Queries by place, rings and filters, against numpy."""

import dynmesh
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from shapes import TET, grid_tets, two_tets, zoo

KINDS = ("vertex", "edge", "face", "cell")
# Quarters: so that points often lie on vertices, edges and faces of the grid.
coordinates = st.integers(-2, 6).map(lambda quarters: quarters / 4)
points = st.tuples(coordinates, coordinates, coordinates)
generic = st.tuples(*[st.floats(-0.2, 1.2, allow_subnormal=False)] * 3)


@pytest.fixture(scope="module")
def grid(client):
    """48 tetrahedra in the unit cube, with an edit behind them."""
    session = client.create_session("places-grid")
    session.import_mesh(grid_tets(2), progress=False)
    with session.edit() as tx:
        tx.move_vertices([13], [[0.5, 0.55, 0.45]])
    yield session
    session.delete()


@pytest.fixture(scope="module")
def nodes(grid):
    """Positions, and vertices of the cells."""
    return grid.positions(), grid.entities("cell").vertices.reshape(-1, 4)


def corners_of(session, kind):
    """Low and high corners of bounding boxes, by id."""
    listed, positions = session.entities(kind), session.positions()
    if kind == "vertex":
        return listed.ids, listed.positions, listed.positions
    rows = np.split(positions[listed.vertices], listed.vertex_offsets[1:-1])
    return listed.ids, np.array([r.min(axis=0) for r in rows]), np.array([r.max(axis=0) for r in rows])


def meeting(session, kind, low, high):
    ids, lows, highs = corners_of(session, kind)
    return ids[((lows <= high) & (highs >= low)).all(axis=1)]


@given(points, points)
def test_what_is_in_a_box(grid, a, b):
    low, high = np.minimum(a, b), np.maximum(a, b)
    for kind in KINDS:
        expected = meeting(grid, kind, low, high).tolist()
        assert grid.in_box(kind, (low, high)).tolist() == expected
        assert grid.entities(kind, box=(low, high)).ids.tolist() == expected
        picked = [i for i in (7, 3, 20, 3) if i in expected]
        assert grid.entities(kind, [7, 3, 20, 3], box=[low, high]).ids.tolist() == picked


def test_boxes_of_every_type_of_element(session):
    session.import_mesh(zoo(), progress=False)
    for low, high in (([0, 0, 0], [1, 1, 1]), ([2.5, 0, 0], [9, 9, 9]), ([0.5, 0.5, 1.5], [0.6, 0.6, 1.6])):
        for kind in KINDS:
            expected = meeting(session, kind, low, high).tolist()
            assert session.in_box(kind, [low, high]).tolist() == expected


@given(st.lists(points, max_size=4), st.integers(1, 30))
def test_nearest_vertices(grid, nodes, asked, count):
    found = grid.nearest_vertices(np.array(asked).reshape(-1, 3), count)
    assert found.offsets.tolist() == [min(count, 27) * i for i in range(len(asked) + 1)]
    for i, point in enumerate(asked):
        distances = np.linalg.norm(nodes[0] - point, axis=1)
        rows = slice(found.offsets[i], found.offsets[i + 1])
        assert found.distances[rows] == pytest.approx(np.sort(distances)[:count])
        assert distances[found.ids[rows]] == pytest.approx(found.distances[rows])
        assert len(set(found.ids[rows].tolist())) == rows.stop - rows.start


def test_vertices_at_equal_distances_go_by_id(session):
    session.import_mesh(grid_tets(2), progress=False)
    for point in session.positions():
        squares = ((session.positions() - point) ** 2).sum(axis=1)
        expected = np.lexsort((np.arange(27), squares))
        assert session.nearest_vertices(point, 27).ids.tolist() == expected.tolist()


def barycentric(corners, point):
    return np.linalg.solve(np.vstack([corners.T, np.ones(4)]), [*point, 1.0])


@given(st.lists(st.one_of(points, generic), min_size=1, max_size=6))
def test_located_cells(grid, nodes, asked):
    positions, cells = nodes
    found = grid.locate(asked)
    for point, cell in zip(asked, found.ids.tolist()):
        least = [barycentric(positions[corners], point).min() for corners in cells]
        inside = np.flatnonzero(np.array(least) >= -1e-12)
        surely = np.flatnonzero(np.array(least) > 1e-12)
        if cell < 0:
            assert surely.size == 0
        else:
            assert cell in inside and not (surely < cell).any()


def test_located_faces_lie_within_the_tolerance(session):
    session.import_mesh(TET, {"triangle": [[0, 1, 2], [0, 1, 3]]})
    asked = [[0.2, 0.2, 0.0], [0.2, 0.0, 0.2], [0.2, 0.2, 0.1], [3, 3, 3], [0.5, 0, 0]]
    assert session.locate(asked, "face").ids.tolist() == [0, 1, -1, -1, 0]
    assert session.locate(asked, "face", tolerance=0.1).ids.tolist() == [0, 1, 0, -1, 0]
    assert session.locate([0.2, 0.2, 0.0], "cell").ids.tolist() == [-1]


def triangle_hits(corners, origin, direction):
    """t for each triangle, NaN for a miss."""
    edges = corners[:, 1:] - corners[:, :1]
    normal = np.cross(direction, edges[:, 1])
    with np.errstate(all="ignore"):
        scale = 1 / (edges[:, 0] * normal).sum(axis=1)
        off = origin - corners[:, 0]
        u = (off * normal).sum(axis=1) * scale
        cross = np.cross(off, edges[:, 0])
        v = cross @ direction * scale
        t = (edges[:, 1] * cross).sum(axis=1) * scale
        return np.where((u >= 0) & (v >= 0) & (u + v <= 1) & (t >= 0), t, np.nan)


@given(st.lists(st.tuples(generic, generic), min_size=1, max_size=4))
def test_hits_of_rays(grid, nodes, ends):
    # Askew, as rounding decides about what grazes edges or begins on faces.
    starts = np.array([end[0] for end in ends]) + [0.0137, 0.0271, 0.0419]
    ways = np.array([end[1] for end in ends]) - starts + [0.0123, 0.0345, 0.0567]
    for which in ("any", "surface"):
        faces = grid.entities("face")
        ids = faces.ids if which == "any" else grid.boundary("face")
        corners = nodes[0][faces.vertices.reshape(-1, 3)[ids]]
        every, first = (grid.cast_rays(starts, ways, hits=hits, targets=which) for hits in ("all", "first"))
        for i, (start, way) in enumerate(zip(starts, ways)):
            expected = triangle_hits(corners, start, way)
            row = slice(every.offsets[i], every.offsets[i + 1])
            assert every.t[row] == pytest.approx(np.sort(expected[~np.isnan(expected)]), abs=1e-9)
            assert (np.diff(every.t[row]) >= 0).all()
            head = slice(first.offsets[i], first.offsets[i + 1])
            assert first.faces[head].tolist() == every.faces[row][:1].tolist()
            assert first.t[head].tolist() == every.t[row][:1].tolist()


def brute_rings(session, kind, rings):
    adjacent = {i: set(row) for i, row in session.neighbors(kind, kind).to_dict().items()}
    reached = {i: {i} for i in adjacent}
    for _ in range(rings):
        reached = {i: row.union(*(adjacent[j] for j in row)) for i, row in reached.items()}
    return {i: sorted(row - {i}) for i, row in reached.items()}


@pytest.mark.parametrize("kind", KINDS)
def test_rings_are_neighbours_of_neighbours(session, kind):
    session.import_mesh(zoo(), progress=False)
    for rings in (1, 2, 3):
        assert session.neighbors(kind, kind, rings=rings).to_dict() == brute_rings(session, kind, rings)


def test_filters_combine(grid):
    box = ([0, 0, 0], [0.5, 0.5, 0.5])
    vertices = set(grid.boundary("vertex").tolist()) & set(grid.in_box("vertex", box).tolist())
    csr = grid.neighbors("vertex", "cell", boundary_only=True, box=box)
    assert csr.ids.tolist() == sorted(vertices) and len(vertices) == 7
    assert grid.entities("vertex", slice(0, 13), boundary_only=True, box=box).ids.tolist() == [
        i for i in sorted(vertices) if i < 13
    ]
    with pytest.raises(dynmesh.InvalidArgumentError, match="BAD_ENTITY_KIND"):
        grid.entities("cell", boundary_only=True)


def test_answers_follow_the_edits(session):
    session.import_mesh(two_tets())
    far = ([5, 5, 5], [7, 7, 7])
    assert session.in_box("vertex", far).size == 0 and session.info().index_bytes > 0
    with session.edit() as tx:
        tx.move_vertices([4], [[6, 6, 6]])
    assert session.in_box("vertex", far).tolist() == [4]
    assert session.in_box("cell", far).tolist() == [1]
    assert session.locate([2, 2, 2]).ids.tolist() == [1]
    assert session.nearest_vertices([9, 9, 9]).ids.tolist() == [4]
    with session.edit() as tx:
        tx.remove_elements("cell", [1])
        tx.remove_vertices([4])
    assert session.in_box("vertex", far).size == 0
    located = session.locate([2, 2, 2])
    assert (located.ids.tolist(), located.revision) == ([-1], 3)


def test_many_points_are_asked_about_in_parts(grid, monkeypatch):
    monkeypatch.setattr("dynmesh.places._POINTS_PER_CALL", 3)
    asked = np.random.default_rng(1).uniform(0, 1, (8, 3))
    assert grid.locate(asked).ids.tolist() == [int(grid.locate(point).ids[0]) for point in asked]
    assert grid.nearest_vertices(asked, 2).offsets.tolist() == list(range(0, 18, 2))
    assert grid.cast_rays(asked, asked - 0.51).offsets.tolist() == list(range(9))
    assert grid.locate([]).ids.tolist() == []


@pytest.mark.parametrize(
    ("ask", "reason"),
    [
        (lambda s: s.in_box("vertex", [[0, 0, 0], [1, -1, 1]]), "BAD_ARGUMENT"),
        (lambda s: s.in_box("vertex", [[0, 0, 0]]), "BAD_ARRAY_LENGTH"),
        (lambda s: s.in_box("vertex", [[0, 0, 0], [1, np.inf, 1]]), "NON_FINITE_VALUE"),
        (lambda s: s.in_box("point", [[0, 0, 0], [1, 1, 1]]), "BAD_ENTITY_KIND"),
        (lambda s: s.nearest_vertices([[0, 0]]), "BAD_ARRAY_LENGTH"),
        (lambda s: s.nearest_vertices([0, 0, np.nan]), "NON_FINITE_VALUE"),
        (lambda s: s.nearest_vertices([0, 0, 0], 0), "BAD_ARGUMENT"),
        (lambda s: s.nearest_vertices([0, 0, 0], -1), "BAD_ARGUMENT"),
        (lambda s: s.nearest_vertices([0, 0, 0], 10001), "BAD_ARGUMENT"),
        (lambda s: s.nearest_vertices([0, 0, 0], 2**40), "BAD_ARGUMENT"),
        (lambda s: s.locate([0, 0, 0], "edge"), "BAD_ENTITY_KIND"),
        (lambda s: s.locate([0, 0, 0], "face", tolerance=-1), "BAD_ARGUMENT"),
        (lambda s: s.locate([0, 0, 0], "face", tolerance=np.nan), "NON_FINITE_VALUE"),
        (lambda s: s.locate([0, 0, 0], "face", tolerance="wide"), "BAD_ARGUMENT"),
        (lambda s: s.locate([0, 0, 0], tolerance=1.0), "BAD_ARGUMENT"),
        (lambda s: s.cast_rays([0, 0, 0], [0, 0, 0]), "BAD_ARGUMENT"),
        (lambda s: s.cast_rays([[0, 0, 0], [1, 1, 1]], [1, 0, 0]), "BAD_ARRAY_LENGTH"),
        (lambda s: s.cast_rays([0, 0, 0], [1, 0, 0], hits="some"), "BAD_ARGUMENT"),
        (lambda s: s.cast_rays([0, 0, 0], [1, 0, 0], targets=3), "BAD_ARGUMENT"),
        (lambda s: s.neighbors("vertex", "cell", rings=2), "BAD_ARGUMENT"),
        (lambda s: s.neighbors("vertex", "vertex", rings=0), "BAD_ARGUMENT"),
        (lambda s: s.neighbors("vertex", "vertex", rings=1001), "BAD_ARGUMENT"),
        (lambda s: s.neighbors("vertex", "vertex", box=[1, 2, 3]), "BAD_ARRAY_LENGTH"),
    ],
)
def test_questions_that_make_no_sense_are_refused(grid, ask, reason):
    with pytest.raises(dynmesh.InvalidArgumentError) as caught:
        ask(grid)
    assert caught.value.reason == reason


def test_the_point_that_offends_is_named(grid):
    with pytest.raises(dynmesh.InvalidArgumentError) as caught:
        grid.locate([[0, 0, 0], [0, 0, 0], [0, np.nan, 0]])
    assert caught.value.metadata["index"] == "2"
