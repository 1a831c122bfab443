"""What is said of a revision on the command line, and what is told of it again."""

from __future__ import annotations

import argparse
import getpass


def add_note_options(parser: argparse.ArgumentParser) -> None:
    """``--message`` and ``--author`` of a command that makes a revision."""
    parser.add_argument("-m", "--message", metavar="TEXT", help="why: dynmesh history tells it again")
    parser.add_argument("--author", metavar="WHO", default=login_name(), help="(your login name)")


def login_name() -> str | None:
    """Whoever is logged in; None where nobody has a name, as in a container."""
    try:
        return getpass.getuser()
    except (ImportError, KeyError, OSError):
        return None


def one_line(text: str) -> str:
    """The first line of what somebody else wrote, without what a terminal would obey."""
    first, *more = text.strip().splitlines() or [""]
    return "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in first) + (" ..." if more else "")
