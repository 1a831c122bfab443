"""Waiting for what must come."""

from __future__ import annotations

import time

import dynmesh

PATIENCE_S = 60.0


def await_serving(session: dynmesh.Session) -> dynmesh.SessionInfo:
    """What the session is, once a connection to its daemon is made again."""
    deadline = time.monotonic() + PATIENCE_S
    while True:
        try:
            return session.info()
        except dynmesh.UnavailableError:
            assert time.monotonic() < deadline, "it cannot be reached"
            time.sleep(0.01)


def await_state(client: dynmesh.Client, name: str, state: str) -> None:
    """Waits until the list says so, which loads nothing."""
    deadline = time.monotonic() + PATIENCE_S
    while {info.name: info.state for info in client.sessions()}[name] != state:
        assert time.monotonic() < deadline, f"{name} does not become {state}"
        time.sleep(0.01)
