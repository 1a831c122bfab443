"""What of a session outlives the daemon, as words."""

from __future__ import annotations

from .arguments import as_word
from .v1 import sessions_pb2

_DURABILITIES = {
    "none": sessions_pb2.DURABILITY_NONE,
    "async": sessions_pb2.DURABILITY_ASYNC,
    "sync": sessions_pb2.DURABILITY_SYNC,
}
_STATES = {
    sessions_pb2.SESSION_STATE_LOADED: "loaded",
    sessions_pb2.SESSION_STATE_STORED: "stored",
    sessions_pb2.SESSION_STATE_DAMAGED: "damaged",
}

DURABILITY_NAMES = tuple(_DURABILITIES)


def durability_to_proto(name: str | None) -> sessions_pb2.Durability.ValueType:
    """The value for a word; None leaves it to the daemon."""
    if name is None:
        return sessions_pb2.DURABILITY_UNSPECIFIED
    return _DURABILITIES[as_word(name, _DURABILITIES, "durability")]


def durability_name(value: sessions_pb2.Durability.ValueType) -> str:
    """The word for a value; a daemon that knows none keeps nothing."""
    return next((name for name, known in _DURABILITIES.items() if known == value), "none")


def state_name(value: sessions_pb2.SessionState.ValueType) -> str:
    """The word for a state; a daemon that tells none has all sessions in memory."""
    return _STATES.get(value, "loaded")
