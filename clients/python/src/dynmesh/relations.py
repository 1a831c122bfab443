"""Neighbour relations as pairs of kinds, and on the wire."""

from __future__ import annotations

from collections.abc import Iterable

from .arguments import as_list, bad_argument
from .kinds import EntityKind, KindLike, as_kind
from .v1 import types_pb2

Relation = tuple[EntityKind, EntityKind]
RelationLike = tuple[KindLike, KindLike]


def relations_to_proto(relations: Iterable[RelationLike]) -> list[types_pb2.Relation]:
    """Pairs such as ("vertex", "cell") as messages."""
    return [_to_proto(pair) for pair in as_list(relations, "stored_relations")]


def relation_from_proto(message: types_pb2.Relation) -> Relation:
    """Relation message as a pair of kinds."""
    return EntityKind(getattr(message, "from")), EntityKind(message.to)


def _to_proto(pair: RelationLike) -> types_pb2.Relation:
    if not isinstance(pair, (tuple, list)) or len(pair) != 2:
        message = f'a relation is a pair of kinds such as ("vertex", "cell"), not {pair!r}'
        raise bad_argument("stored_relations", message)
    source, target = map(as_kind, pair)
    return types_pb2.Relation(**{"from": source, "to": target})
