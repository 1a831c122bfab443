"""The demo's simulation: it drags what it is given, and keeps elements, volume and topology."""

import sys
from pathlib import Path

import meshio
import numpy as np
import pytest
import shapes

sys.path.insert(0, str(Path(__file__).parents[2] / "clients" / "python" / "examples"))

from dragging.operators import Tally  # noqa: E402
from dragging.region import Region, ball_region  # noqa: E402
from dragging.simulation import Simulation  # noqa: E402
from dragging.survey import survey  # noqa: E402

# Of a hexahedron, in meshio's node order.
TETRAHEDRA = [(0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6)]
PRISMS = [(0, 1, 2, 4, 5, 6), (0, 2, 3, 4, 6, 7)]


def block(size: tuple[int, int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Points and hexahedra of so many unit cubes."""
    at = np.arange(np.prod([n + 1 for n in size])).reshape([n + 1 for n in size])
    points = np.argwhere(at >= 0).astype(float)
    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    slices = [tuple(slice(k, k + n) for k, n in zip(corner, size)) for corner in corners]
    return points, np.stack([at[s].ravel() for s in slices], axis=1)


def cut(hexahedra: np.ndarray, parts: list[tuple[int, ...]]) -> np.ndarray:
    return np.concatenate([hexahedra[:, list(part)] for part in parts])


def square(n: int) -> meshio.Mesh:
    """A square of quads, with a triangle and a wire that hang on."""
    points, hexahedra = block((n, n, 1))
    quads = hexahedra[:, :4]
    more = [[0, -1, 0], [-1, 0, 0], [-1, -1, 1]]
    first = len(points)
    cells = [("quad", quads), ("triangle", [[0, first, first + 1]]), ("line", [[first, first + 2]])]
    return meshio.Mesh(np.vstack([points, more]), cells)


def solids() -> dict[str, meshio.Mesh]:
    points, hexahedra = block((6, 6, 6))
    tetrahedra = cut(hexahedra, TETRAHEDRA)
    broken = np.concatenate([tetrahedra[:, [1, 0, 2, 3]][:9], tetrahedra[9:], tetrahedra[:3], [[0, 1, 1, 2]]])
    return {
        "tetrahedra": meshio.Mesh(points, [("tetra", tetrahedra)]),
        "turned over": meshio.Mesh(points, [("tetra", tetrahedra[:, [1, 0, 2, 3]])]),
        "broken": meshio.Mesh(points, [("tetra", broken)]),
        "prisms": meshio.Mesh(points, [("wedge", cut(hexahedra, PRISMS))]),
        "hexahedra": meshio.Mesh(points, [("hexahedron", hexahedra)]),
        "zoo": shapes.zoo(),
        "square": square(8),
        "wires": meshio.Mesh(points[:3], [("line", [[0, 1], [1, 2]])]),
        "points": meshio.Mesh(points, []),
    }


@pytest.mark.parametrize("name", solids())
def test_any_mesh_is_dragged_and_nothing_is_turned_over(session, name):
    session.import_mesh(solids()[name])
    start, before = survey(session), session.info()
    with session.mirror() as mirror:
        simulation = Simulation(session, ball_region(start.points, start.points[0]), start, before.revision)
        reports = [simulation.step(k / 12, (k + 1) / 12) for k in range(12)]
        after = simulation.finish()
        mirror.wait(after.revision, timeout=30)
        assert mirror.checksum == session.info().checksum
    end = survey(session, start.flipped)
    assert simulation.tally.outcomes["move vertex"].accepted > 0
    assert end.num_inverted <= start.num_inverted
    assert session.info().euler_characteristic == before.euler_characteristic
    assert [report.revision for report in reports] == sorted(report.revision for report in reports)


def test_a_slab_keeps_its_form_by_operators(session):
    points, hexahedra = block((24, 12, 3))
    session.import_mesh(meshio.Mesh(points, [("tetra", cut(hexahedra, TETRAHEDRA))]))
    start = survey(session)
    ends = np.array([[5.0, 6.0, 1.5], [17.0, 6.5, 1.5]])
    region = Region(1.5, 4.5, np.array([1.0, 1.0, 0.0]), lambda t: (1 - t) * ends[0] + t * ends[1])
    simulation = Simulation(session, region, start, session.revision)
    reports = [simulation.step(k / 30, (k + 1) / 30) for k in range(30)] + [simulation.finish()]
    end = survey(session, start.flipped)
    assert sum(report.held for report in reports) == 0
    assert end.num_inverted == 0
    assert end.size == pytest.approx(start.size, rel=1e-12)
    assert end.worst_angle > 10
    for name in ("split edge", "collapse edge", "swap edge", "smooth vertex"):
        assert simulation.tally.outcomes[name].accepted > 0


def test_what_was_refused_is_counted_with_its_reason(session):
    session.import_mesh(shapes.two_tets())
    with session.edit(skip_refused=True) as tx:
        tx.swap_edges(ends=[[0, 1], [1, 2]])
        tx.split_edges(ends=[[0, 1]])
    tally = Tally()
    assert tally.add(tx.result, [("swap edge", 2), ("split edge", 1)]) == 1
    assert tally.outcomes["swap edge"].reasons == {"BOUNDARY": 2}
    assert tally.outcomes["split edge"].accepted == 1
