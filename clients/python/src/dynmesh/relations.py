"""Neighbour relations as pairs of kinds, and on the wire."""

from __future__ import annotations

from collections.abc import Iterable

from .errors import InvalidArgumentError
from .kinds import EntityKind, KindLike, as_kind
from .v1 import types_pb2

Relation = tuple[EntityKind, EntityKind]
RelationLike = tuple[KindLike, KindLike]


def relations_to_proto(relations: Iterable[RelationLike]) -> list[types_pb2.Relation]:
    """Pairs such as ("vertex", "cell") as messages."""
    return [_to_proto(pair) for pair in relations]


def relation_from_proto(message: types_pb2.Relation) -> Relation:
    """Relation message as a pair of kinds."""
    return EntityKind(getattr(message, "from")), EntityKind(message.to)


def _to_proto(pair: RelationLike) -> types_pb2.Relation:
    if isinstance(pair, str) or len(pair) != 2:
        raise InvalidArgumentError(
            f'a relation is a pair of kinds such as ("vertex", "cell"), not {pair!r}', reason="BAD_ARGUMENT"
        )
    source, target = map(as_kind, pair)
    return types_pb2.Relation(**{"from": source, "to": target})
