"""Warnings of a batch or an import: lines on stderr, and what programs read."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from typing import Any

from .info import MeshWarning

_SHOWN_IDS = 8


def print_warnings(warnings: Iterable[MeshWarning]) -> None:
    """A line for each on stderr, with the first entities and what a check measured at them."""
    for warning in warnings:
        print(f"dynmesh: warning: {warning}{_first(warning)}", file=sys.stderr)


def warning_records(warnings: Iterable[MeshWarning]) -> list[dict[str, Any]]:
    """The same for programs, with all entities that were named."""
    return [warning.to_dict() for warning in warnings]


def _first(warning: MeshWarning) -> str:
    ids, values = warning.ids[:_SHOWN_IDS], warning.values
    items = [f"{id_} ({values[i]:.4g})" if i < len(values) else str(id_) for i, id_ in enumerate(ids)]
    more = ", ..." if warning.count > len(ids) else ""
    return f": {', '.join(items)}{more}" if items else more
