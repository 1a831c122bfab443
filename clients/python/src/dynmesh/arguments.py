"""Arguments that are no arrays: checked where they come in, so that what is wrong is named.

All raise `InvalidArgumentError` BAD_ARGUMENT, with the argument's name in ``metadata["field"]``.
"""

from __future__ import annotations

import uuid
from collections.abc import Collection, Iterable, Mapping
from typing import Any

import numpy as np

from .errors import InvalidArgumentError

# What an int32 field holds.
INT32 = (-(2**31), 2**31 - 1)


def bad_argument(what: str, message: str) -> InvalidArgumentError:
    """The error for an argument named `what`."""
    return InvalidArgumentError(message, reason="BAD_ARGUMENT", metadata={"field": what})


def as_text(value: str, what: str) -> str:
    """`value`, if it is a string that UTF-8 can write: a command line may hold others."""
    if not isinstance(value, str):
        raise bad_argument(what, f"{what} is no string: {value!r}")
    try:
        value.encode()
    except UnicodeEncodeError:
        raise bad_argument(what, f"{what} is no text: {value!r}") from None
    return value


def as_request_id(value: str | None) -> str:
    """`value`, or one that nobody else has."""
    return uuid.uuid4().hex if value is None or value == "" else as_text(value, "request_id")


def as_word(value: str, words: Collection[str], what: str) -> str:
    """`value`, if it is one of `words`."""
    if isinstance(value, str) and value in words:
        return value
    raise bad_argument(what, f"{what} is one of {', '.join(words)}, not {value!r}")


def as_int64(value: int, what: str, low: int = -(2**63), high: int = 2**63 - 1) -> int:
    """`value` for an int64 field, if it is an integer from `low` to `high`."""
    if not isinstance(value, (int, np.integer)) or isinstance(value, bool) or not -(2**63) <= value < 2**63:
        raise bad_argument(what, f"{what} is no 64-bit integer: {value!r}")
    if low <= value <= high:
        return int(value)
    raise bad_argument(what, f"{what} is from {low} to {high}, not {value}")


def as_revision(value: int | None) -> int | None:
    """`value` of ``if_revision``, which may be left out."""
    return None if value is None else as_int64(value, "if_revision")


def as_count(value: int, what: str) -> int:
    """`value` for a uint32 field where 0 stands for a default: 1 or more."""
    number = as_int64(value, what)
    if 1 <= number <= 0xFFFFFFFF:
        return number
    raise bad_argument(what, f"{what} is not positive, or too large: {value}")


def as_number(value: float, what: str) -> float:
    """`value` as a float."""
    if isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool):
        try:
            return float(value)
        except OverflowError:
            pass
    raise bad_argument(what, f"{what} is no number: {value!r}")


def as_seconds(value: float, what: str = "timeout") -> float:
    """`value` as a time of more than 0 seconds, which may be infinite."""
    seconds = as_number(value, what)
    if seconds > 0:  # not NaN either
        return seconds
    raise bad_argument(what, f"{what} must be more than 0 seconds, not {value}")


def as_list(values: Iterable[Any], what: str) -> list[Any]:
    """The items of an iterable. A string or a mapping is none here."""
    if isinstance(values, Iterable) and not isinstance(values, (str, bytes, Mapping)):
        return list(values)
    raise bad_argument(what, f"{what} is no list: {values!r}")
