"""``dynmesh history``, ``rollback``, ``fork``, ``snapshot`` and ``set-retention``: what a session was before."""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable
from typing import Any

from .cli_notes import add_note_options, one_line
from .cli_parser import positive
from .durability import DURABILITY_NAMES
from .info import Counts
from .retention import Retention
from .revisions import Revision, SnapshotInfo
from .session import Session

AddCommand = Callable[[str, str], argparse.ArgumentParser]

_SECONDS = {"": 1, "s": 1, "m": 60, "h": 3600, "d": 86400}
_BYTES = {"": 1, "K": 2**10, "M": 2**20, "G": 2**30, "T": 2**40}


def add_history(add: AddCommand) -> None:
    """Adds the commands; ``args.ask(session, args)`` gives what one of them tells programs and humans."""
    history = add("history", "List the revisions that a session can go back to, the last one first.")
    history.add_argument("name", metavar="NAME")
    history.add_argument("--limit", metavar="N", type=positive, help="no more than so many (all)")
    history.set_defaults(ask=_history)
    rollback = add("rollback", "Put a session back to what it was, as one new revision, which undo takes back.")
    rollback.add_argument("name", metavar="NAME")
    rollback.add_argument("revision", metavar="REVISION", nargs="?", type=whole, help="one that history lists")
    rollback.add_argument("--snapshot", metavar="SNAPSHOT", help="instead: one that snapshot list lists")
    rollback.add_argument("--if-revision", metavar="R", type=int, help="only if the session is at this revision")
    rollback.add_argument("--dry-run", action="store_true", help="tell what would be done, and do nothing")
    add_note_options(rollback)
    rollback.set_defaults(ask=_rollback, needs_target=True)
    fork = add("fork", "Make a session that begins with what another one is, or was.")
    fork.add_argument("name", metavar="NAME", help="what to begin with")
    fork.add_argument("new", metavar="NEW", help="the new session")
    source = fork.add_mutually_exclusive_group()
    source.add_argument("--revision", metavar="REVISION", type=whole, help="as it was then (as it is now)")
    source.add_argument("--snapshot", metavar="SNAPSHOT", help="as it was in this snapshot")
    fork.add_argument("--durability", choices=DURABILITY_NAMES, help="of the new session (as NAME has it)")
    add_note_options(fork)
    fork.set_defaults(ask=_fork)


def add_snapshots(add: AddCommand) -> None:
    """Adds ``create``, ``list`` and ``delete`` of ``dynmesh snapshot``."""
    create = add("create", "Give a revision a name, under which it is kept until the snapshot is deleted.")
    create.add_argument("name", metavar="NAME", help="the session")
    create.add_argument("snapshot", metavar="SNAPSHOT", help="the name")
    create.add_argument("--revision", metavar="REVISION", type=positive, help="one that history lists (the last one)")
    add_note_options(create)
    create.set_defaults(ask=_create_snapshot)
    show = add("list", "List the snapshots of a session.")
    show.add_argument("name", metavar="NAME", help="the session")
    show.set_defaults(ask=_list_snapshots)
    delete = add("delete", "Delete a snapshot. Its revision stays as long as others do.")
    delete.add_argument("name", metavar="NAME", help="the session")
    delete.add_argument("snapshot", metavar="SNAPSHOT")
    delete.set_defaults(ask=_delete_snapshot)


def add_retention_options(parser: argparse.ArgumentParser) -> None:
    """Which earlier revisions a session keeps; `retention_of` reads them."""
    parser.add_argument(
        "--retain-revisions",
        metavar="N",
        type=whole,
        default=0,
        help="last revisions that can be gone back to; 0, here and below: as the daemon says (0)",
    )
    parser.add_argument(
        "--retain-age", metavar="AGE", type=age, default=0.0, help="the same by their age: 3600, 90m, 36h, 7d (0)"
    )
    parser.add_argument(
        "--retain-bytes", metavar="BYTES", type=byte_count, default=0, help="the same by their disk: 64M, 2G (0)"
    )


def retention_of(args: argparse.Namespace) -> Retention:
    """What `add_retention_options` were given."""
    return Retention(args.retain_revisions, args.retain_age, args.retain_bytes)


def whole(text: str) -> int:
    """The number of an argument, at least 0."""
    if not re.fullmatch("[0-9]+", text):
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number")
    return int(text)


def age(text: str) -> float:
    """Seconds of an argument such as 90m."""
    return _measure(text, _SECONDS, "an age such as 3600, 90m, 36h or 7d")


def byte_count(text: str) -> int:
    """Bytes of an argument such as 64M."""
    return int(_measure(text.upper(), _BYTES, "a number of bytes such as 1000000, 64M or 2G"))


def _measure(text: str, units: dict[str, int], what: str) -> float:
    parts = re.fullmatch(r"([0-9]+(?:\.[0-9]*)?)([A-Za-z]?)", text)
    if not parts or parts[2] not in units:
        raise argparse.ArgumentTypeError(f"{text!r} is not {what}")
    number = float(parts[1]) if "." in parts[1] else int(parts[1])
    return number * units[parts[2]]


# ---- Commands ----


def _history(session: Session, args: argparse.Namespace) -> tuple[Any, str]:
    revisions = list(session.revisions(args.limit))
    lines = [f"{'REVISION':>9} {'COMMITTED (UTC)':19} {'KIND':11} {'BYTES':>10} {'AUTHOR':12} MESSAGE"]
    lines += map(_revision_row, revisions)
    return [revision.to_dict() for revision in revisions], "\n".join(lines)


def _rollback(session: Session, args: argparse.Namespace) -> tuple[Any, str]:
    result = session.restore(
        args.revision,
        snapshot=args.snapshot,
        if_revision=args.if_revision,
        validate_only=args.dry_run,
        message=args.message,
    )
    record = {"name": session.name, **result.to_dict()}
    then = f"as it was at revision {result.target_revision}: {_counts(result.counts)}"
    if args.dry_run:
        return record, f"{session.name} would be {then}"
    left = f"{result.undoable_batches} can be undone, {result.redoable_batches} redone"
    return record, f"{session.name} is at revision {result.revision}, {then}; {left}"


def _fork(session: Session, args: argparse.Namespace) -> tuple[Any, str]:
    made = session.fork(args.new, args.revision, args.snapshot, args.durability, message=args.message)
    info = made.info()
    begins = f"begins with revision {info.revision} of {session.name}"
    return info.to_dict(), f"{info.name} {begins}: {_counts(info.counts)}; durability {info.durability}"


def _create_snapshot(session: Session, args: argparse.Namespace) -> tuple[Any, str]:
    made = session.create_snapshot(args.snapshot, args.revision, message=args.message)
    return made.to_dict(), f"snapshot {made.name} is revision {made.revision} of {session.name}"


def _list_snapshots(session: Session, _: argparse.Namespace) -> tuple[Any, str]:
    snapshots = session.snapshots()
    lines = [f"{'SNAPSHOT':24} {'REVISION':>9} {'MADE (UTC)':19} {'AUTHOR':12} MESSAGE"]
    lines += map(_snapshot_row, snapshots)
    return [snapshot.to_dict() for snapshot in snapshots], "\n".join(lines)


def _delete_snapshot(session: Session, args: argparse.Namespace) -> tuple[Any, str]:
    session.delete_snapshot(args.snapshot)
    return {"name": args.snapshot}, f"deleted snapshot {args.snapshot} of {session.name}"


# ---- Output ----


def _revision_row(revision: Revision) -> str:
    made = f"{revision.revision:9} {revision.commit_time:%Y-%m-%d %H:%M:%S}"
    what = f"{revision.kind:11} {revision.size_bytes:10}"
    return f"{made} {what} {one_line(revision.author):12} {one_line(revision.message)}".rstrip()


def _snapshot_row(snapshot: SnapshotInfo) -> str:
    made = f"{snapshot.name:24} {snapshot.revision:9} {snapshot.create_time:%Y-%m-%d %H:%M:%S}"
    return f"{made} {one_line(snapshot.author):12} {one_line(snapshot.message)}".rstrip()


def _counts(counts: Counts) -> str:
    return ", ".join(f"{count} {name}" for name, count in counts._asdict().items())
