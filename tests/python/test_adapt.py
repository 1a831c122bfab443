"""Adaptation and smoothing through the daemon; mirrors follow them."""

import json
import os
import subprocess

import dynmesh
import numpy as np
import pytest


def grid(n: int) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """The unit square by 2 n^2 triangles."""
    x, y = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1), indexing="ij")
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    at = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    a, b, c, d = (part.ravel() for part in (at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]))
    return points, {"triangle": np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])}


def area(session: dynmesh.Session) -> float:
    """The sum of the areas of all triangles, which must all look up."""
    snapshot = session.snapshot()
    where = np.zeros((snapshot.vertex_ids.max() + 1, 3))
    where[snapshot.vertex_ids] = snapshot.positions
    a, b, c = (where[snapshot.blocks[0].vertices[:, k]] for k in range(3))
    twice = np.cross(b - a, c - a)[:, 2]
    assert (twice > 0).all()
    return float(twice.sum() / 2)


@pytest.mark.parametrize("length", [0.07, 0.3])
def test_a_square_comes_to_a_length_and_a_mirror_follows(session, length):
    session.import_mesh(*grid(8))
    steps = []
    with session.mirror() as mirror:
        result = session.adapt(length, progress=steps.append)
        mirror.wait(result.revision, timeout=30)
        assert mirror.checksum == session.info().checksum
    assert result.revision == session.revision > 1
    assert result.after.share_in_band > max(0.7, result.before.share_in_band)
    assert result.after.elements == len(session.snapshot().blocks[0].ids)
    assert area(session) == pytest.approx(1, rel=1e-12)
    assert (result.splits if length < 0.1 else result.collapses) > 0
    assert steps and steps[0].elements > 0 and steps[0].pass_number >= 1


def test_an_attribute_says_where_triangles_are_small(session):
    session.import_mesh(*grid(8))
    with session.edit() as tx:
        tx.add_attribute("size", "vertex")
        snapshot = session.snapshot()
        tx.set_attribute("size", "vertex", snapshot.vertex_ids, 0.03 + 0.2 * snapshot.positions[:, 0])
    session.adapt(size_attribute="size")
    x = session.snapshot().positions[:, 0]
    assert (x < 0.5).sum() > 2 * (x > 0.5).sum()


def test_refusals_say_why(session):
    session.import_mesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], {"quad": [[0, 1, 2, 3]]})
    with pytest.raises(dynmesh.FailedPreconditionError) as refused:
        session.adapt(1.0)
    assert refused.value.reason == "NOT_SIMPLEX" and refused.value.ids == (0,)
    with pytest.raises(dynmesh.InvalidArgumentError):
        session.adapt()
    with pytest.raises(dynmesh.InvalidArgumentError):
        session.adapt(1.0, size_attribute="size")
    for length in (0, 0.0, -1.0):
        with pytest.raises(dynmesh.InvalidArgumentError, match="a target length is positive and finite") as refused:
            session.adapt(length)
        assert refused.value.metadata["field"] == "target_length"


def test_smoothing_moves_what_is_asked_for(session):
    points, cells = grid(4)
    points[6] += [0.1, 0.05, 0]
    session.import_mesh(points, cells)
    with session.edit() as tx:
        edit = tx.smooth_vertices([0, 6], iterations=20)
    assert tx.result.num_moved[edit] == 1
    assert np.abs(session.positions([6]) - [0.25, 0.25, 0]).max() < 0.05
    with session.edit() as tx:
        tx.smooth_vertices([6], method="laplacian", factor=0.5, move_boundary=True, tangential=True)
        tx.smooth_vertices([6], method="optimizing", min_quality=0.1)
    with pytest.raises(dynmesh.InvalidArgumentError):
        session.edit().smooth_vertices([6], method="magic")
    with pytest.raises(dynmesh.InvalidArgumentError, match="factor"):
        with session.edit() as tx:
            tx.smooth_vertices([6], factor=1.5)


def test_the_command_adapts(daemon, session):
    session.import_mesh(*grid(4))
    command = [os.environ["DYNMESH_COMMAND"], "--target", daemon.target, "adapt", session.name]
    run = subprocess.run([*command, "--target-length", "0.1", "--json"], capture_output=True, text=True, check=True)
    record = json.loads(run.stdout)
    assert record["revision"] == session.revision and record["after"]["elements"] > 32
    run = subprocess.run([*command, "--target-length", "0.1"], capture_output=True, text=True, check=True)
    assert "passes" in run.stdout and "after" in run.stdout
    assert subprocess.run(command, capture_output=True).returncode == 2
