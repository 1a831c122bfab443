"""A daemon for all tests of a file, and a session of its own for each test."""

from __future__ import annotations

import itertools
import os

import dynmesh
import pytest
from hypothesis import HealthCheck, settings

# Derandomised, so that a run in CI says the same twice; DYNMESH_HYPOTHESIS=explore looks for new examples.
settings.register_profile(
    "ci",
    deadline=None,
    derandomize=True,
    database=None,
    max_examples=25,
    print_blob=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
settings.register_profile("explore", settings.get_profile("ci"), derandomize=False, max_examples=300)
settings.load_profile(os.environ.get("DYNMESH_HYPOTHESIS", "ci"))

_numbers = itertools.count()


@pytest.fixture(scope="session")
def daemon():
    with dynmesh.launch() as running:
        yield running


@pytest.fixture(scope="session")
def client(daemon):
    with daemon.connect(timeout=30.0) as connected:
        yield connected


@pytest.fixture
def session(client):
    made = client.create_session(f"test-{next(_numbers)}")
    yield made
    try:
        assert made.validate() == []
        made.delete()
    except dynmesh.NotFoundError:
        pass  # the test deleted it
