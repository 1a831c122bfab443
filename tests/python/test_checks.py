"""Checks through the daemon: settings, refusals, warnings and reports."""

import json
import math

import dynmesh
import numpy as np
import pytest
from shapes import TET, bow_tie


def one_tet(session) -> None:
    session.import_mesh(TET, {"tetra": [[0, 1, 2, 3]]})


def torus(session, n: int = 8) -> None:
    """A surface of quads with a handle."""
    u, v = np.meshgrid(*2 * [2 * np.pi * np.arange(n) / n], indexing="ij")
    ring = 3 + np.cos(v)
    points = np.stack([ring * np.cos(u), ring * np.sin(u), np.sin(v)], axis=-1).reshape(-1, 3)
    at = np.arange(n * n).reshape(n, n)
    right, up, both = np.roll(at, -1, 0), np.roll(at, -1, 1), np.roll(at, (-1, -1), (0, 1))
    session.import_mesh(points, {"quad": np.stack([at, right, both, up], axis=-1).reshape(-1, 4)})


def test_a_report_has_arrays_for_each_check_and_a_summary(session):
    session.import_mesh(bow_tie())
    report = session.check()
    assert report.revision == 1 and tuple(report.results) == dynmesh.CHECKS
    links = report["vertex_link"]
    assert links.ids.tolist() == [0] and links.ids.dtype == np.uint32
    assert links.values.tolist() == [2.0] and links.values.dtype == np.float64
    assert (links.measured, links.bad, links.highest) == (5, 1, 2.0)
    assert report.topology.surface.pieces == 2 and report.topology.components == 1
    assert "vertex_link" in report.bad() and report.bad("reject") == []
    json.dumps(report.to_dict(), allow_nan=False)


def test_a_torus_has_a_handle_and_no_hole(session):
    torus(session)
    report = session.check(["genus", "holes", "non_orientable", "orientation"])
    assert list(report.results) == ["orientation", "holes", "non_orientable", "genus"]
    assert report["genus"].bad == 1 and report["genus"].highest == 1
    assert report.bad() == ["genus"]
    assert report.topology.surface == dynmesh.SurfaceTopology(1, 0, 0, 0, 1, 0)


def test_angles_are_those_that_numpy_finds(session):
    one_tet(session)
    result = session.check({"min_dihedral": ("warn", 90.0), "min_face_angle": "off"}).results
    assert list(result) == ["min_dihedral"]
    assert math.isclose(result["min_dihedral"].lowest, math.degrees(math.acos(math.sqrt(1 / 3))))
    assert result["min_dihedral"].findings[dynmesh.EntityKind.CELL].ids.tolist() == [0]


def test_what_a_session_rejects_is_refused_and_what_it_warns_of_is_told(session):
    one_tet(session)
    info = session.set_checks({"inverted": "reject", "min_dihedral": ("warn", 50.0)})
    assert info.checks == {"inverted": ("reject", -1e-9), "min_dihedral": ("warn", 50.0)}
    assert info.revision == 1
    with pytest.raises(dynmesh.FailedPreconditionError) as refused:
        with session.edit() as tx:
            tx.move_vertices([3], [[0, 0, -1]])
    assert refused.value.reason == "CHECK_FAILED" and refused.value.metadata["check"] == "inverted"
    assert session.revision == 1
    with session.edit() as tx:
        tx.move_vertices([3], [[0, 0, 0.1]])
    (warning,) = tx.result.warnings
    assert (warning.reason, warning.check, warning.threshold) == ("CHECK_FAILED", "min_dihedral", 50.0)
    assert warning.ids.tolist() == [0] and warning.values[0] < 50
    assert session.check(["inverted"])["inverted"].severity == "reject"
    assert session.set_checks({}).checks == {}


def test_checks_of_a_new_session(client):
    made = client.create_session("born-checked", checks={"isolated_vertex": "reject"})
    with pytest.raises(dynmesh.FailedPreconditionError):
        with made.edit() as tx:
            tx.add_vertices([[0, 0, 0]])
    made.delete()


def test_some_entities_are_looked_at_alone(session):
    session.import_mesh(bow_tie())
    report = session.check(["vertex_link"], kind="vertex", ids=[1, 0])
    assert report["vertex_link"].measured == 2 and report.topology is None
    assert session.check(kind="vertex", box=[[0.5, -1, -1], [2, 2, 1]])["vertex_link"].measured == 2
    with pytest.raises(dynmesh.NotFoundError):
        session.check(kind="vertex", ids=[77])


def test_findings_are_bounded_and_all_are_counted(session):
    torus(session)
    result = session.check({"aspect_ratio": ("warn", 1.0)}, max_findings=3)["aspect_ratio"]
    assert len(result.ids) == 3 and result.bad == 64
    assert session.check({"aspect_ratio": ("warn", 1.0)}, max_findings=0)["aspect_ratio"].ids.size == 0


@pytest.mark.parametrize(
    "checks",
    [{"no_such": "warn"}, {"quality": "sometimes"}, {"quality": ("warn",)}, {"quality": 5}, {"quality": ("warn", 2.0)},
     {"quality": ("warn", math.nan)}, {"quality": ("warn", "much")}],
)
def test_settings_that_make_no_sense_are_refused(session, checks):
    for call in (session.set_checks, session.check):
        with pytest.raises(dynmesh.InvalidArgumentError) as refused:
            call(checks)
        assert refused.value.reason == "BAD_ARGUMENT"
    assert session.info().checks == {}


@pytest.mark.parametrize("arguments", [{"checks": []}, {"max_findings": -1}, {"max_findings": 10**7}, {"ids": [0]}])
def test_questions_that_make_no_sense_are_refused(session, arguments):
    with pytest.raises(dynmesh.InvalidArgumentError):
        session.check(**arguments)


def test_checks_of_the_whole_mesh_are_no_setting(session):
    with pytest.raises(dynmesh.InvalidArgumentError) as refused:
        session.set_checks({"genus": "warn"})
    assert refused.value.metadata["field"] == "checks"
