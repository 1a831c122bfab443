"""The parser of the command ``dynmesh``: options stand anywhere, and whoever called tells how errors are said."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import NoReturn


class UsageError(Exception):
    """Arguments that make no sense.

    Attributes
    ----------
    usage : str
        How the command is called, as lines.
    prog : str
        The command.
    """

    def __init__(self, parser: argparse.ArgumentParser, message: str) -> None:
        super().__init__(message)
        self.usage = parser.format_usage()
        self.prog = parser.prog


class CommandParser(argparse.ArgumentParser):
    """Options may stand between positionals, optional ones too: ``smooth NAME --iterations 2 14 21``.

    Raises `UsageError` where argparse would end the process.
    """

    _intermixing = False

    def parse_known_args(  # type: ignore[override]
        self, args: Sequence[str] | None = None, namespace: argparse.Namespace | None = None
    ) -> tuple[argparse.Namespace, list[str]]:
        """As argparse; a command's own arguments are intermixed, unless a ``--`` says where options end."""
        if self._intermixing or self._subparsers is not None or (args is not None and "--" in args):
            return super().parse_known_args(args, namespace)
        self._intermixing = True  # which parses twice, by this method
        try:
            return self.parse_known_intermixed_args(args, namespace)
        finally:
            self._intermixing = False

    def error(self, message: str) -> NoReturn:
        """Wrong usage."""
        raise UsageError(self, message)


def positive(text: str) -> int:
    """The number of an argument, at least 1."""
    try:
        number = int(text)
    except ValueError:
        number = 0
    if number < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is not a positive whole number")
    return number


def ids(text: str) -> list[int]:
    """The ids of an argument, separated by commas."""
    try:
        return [int(part) for part in text.split(",") if part]
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a list of ids such as 3,14") from None
