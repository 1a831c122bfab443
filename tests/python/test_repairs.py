"""Repairs, as a script asks for them."""

from __future__ import annotations

import dynmesh
import numpy as np
import pytest
from dynmesh import repairs
from shapes import TET


def soup(points: np.ndarray, triangles: list[list[int]]) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Every triangle with vertices of its own."""
    rows = np.asarray(triangles)
    return points[rows.ravel()], {"triangle": np.arange(rows.size).reshape(-1, 3)}


SURFACE = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]


def test_a_soup_of_triangles_becomes_a_closed_surface(session):
    broken = [SURFACE[0], SURFACE[1][::-1], SURFACE[2]]  # one is flipped, one is missing
    session.import_mesh(*soup(TET, broken))
    result = session.repair(weld=1e-9, remove_duplicates=True, split_non_manifold=True, orient=True, fill_holes=3)
    assert [step.step.name for step in result.steps] == [
        "weld",
        "remove_duplicates",
        "split_non_manifold",
        "orient",
        "fill_holes",
        "orient",
    ]
    assert result.revision == session.revision == 2
    assert (result.count("merged"), result.count("reversed"), result.count("filled")) == (5, 1, 1)
    assert session.counts == result.counts == (4, 6, 4, 0)
    assert result.checksum == session.info().checksum
    assert len(session.boundary("edge")) == 0
    again = session.repair(weld=1e-9, orient=True, fill_holes=3)
    assert again.revision == 2 and all(not step.findings for step in again.steps)


def test_steps_have_options_and_findings_name_entities(session):
    session.import_mesh(np.vstack([TET, TET[:1], [[5, 5, 5]]]), {"triangle": [[0, 1, 2], [1, 0, 2], [4, 3, 1]]})
    result = session.repair(
        [
            repairs.RemoveDuplicates(max_measure=None, isolated_vertices=True),
            repairs.Weld(),
            repairs.FillHoles(2),
            repairs.Orient(by_majority=True),
        ],
        if_revision=1,
    )
    assert result.steps[0].findings["duplicate"].ids.tolist() == [1]
    assert result.steps[0].findings["duplicate"].kinds.tolist() == [dynmesh.EntityKind.FACE]
    assert result.steps[0].findings["isolated"].ids.tolist() == [5]
    assert result.steps[1].findings["merged"].ids.tolist() == [4]
    assert result.steps[2].count("hole_too_long") == 1
    assert result.steps[3].count("nothing of the kind") == 0


def test_a_dry_run_changes_nothing(session):
    session.import_mesh(*soup(TET, SURFACE))
    before = session.info().checksum
    dry = session.repair([repairs.Weld(0.0)], validate_only=True)
    assert (dry.revision, dry.counts.vertices) == (1, 4)
    assert session.info().checksum == before
    assert session.repair(weld=0.0).checksum == dry.checksum


def test_what_makes_no_sense_is_refused(session):
    session.import_mesh(TET, {"tetra": [[0, 1, 2, 3]]})
    with pytest.raises(dynmesh.InvalidArgumentError, match="tolerance"):
        session.repair(weld=-1.0)
    with pytest.raises(dynmesh.InvalidArgumentError, match="not both"):
        session.repair([repairs.Orient()], orient=True)
    with pytest.raises(dynmesh.InvalidArgumentError, match="max_edges"):
        session.repair(fill_holes=-1)
    with pytest.raises(dynmesh.AbortedError, match="REVISION_MISMATCH"):
        session.repair(orient=True, if_revision=9)
    with pytest.raises(dynmesh.InvalidArgumentError) as refused:
        session.repair([repairs.Orient(), repairs.RemoveDuplicates(max_measure=-1.0)])
    assert refused.value.metadata["step"] == "1"
    assert session.revision == 1
