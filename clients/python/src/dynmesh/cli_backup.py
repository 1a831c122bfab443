"""``dynmesh backup`` and ``dynmesh restore``."""

from __future__ import annotations

import argparse
from typing import Any

from .client import Client
from .durability import DURABILITY_NAMES


def add_backup_options(parser: argparse.ArgumentParser) -> None:
    """The arguments of ``dynmesh backup``."""
    parser.add_argument("name", metavar="NAME")
    parser.add_argument("file", metavar="FILE", help="replaced, if it is there, when the backup is whole")


def add_restore_options(parser: argparse.ArgumentParser) -> None:
    """The arguments of ``dynmesh restore``."""
    parser.add_argument("file", metavar="FILE", help="that dynmesh backup wrote")
    parser.add_argument("name", metavar="NAME", nargs="?", help="of the new session (that of the backup)")
    parser.add_argument(
        "--durability",
        choices=DURABILITY_NAMES,
        help="of the new session: what acknowledges an edit (that of the backup)",
    )
    parser.add_argument("--dry-run", action="store_true", help="check the backup and tell, and make nothing")


def backup(client: Client, args: argparse.Namespace) -> tuple[dict[str, Any], str]:
    """Writes a backup; the result for programs and for humans."""
    result = client.session(args.name).backup(args.file)
    record = {"name": args.name, "revision": result.revision, "file": args.file, "file_bytes": result.file_bytes}
    size = f"{result.file_bytes / 2**20:.1f} MiB"
    return record, f"wrote {args.file}: {args.name} at revision {result.revision}, {size}"


def restore(client: Client, args: argparse.Namespace) -> tuple[dict[str, Any], str]:
    """Makes a session of a backup; the result for programs and for humans."""
    result = client.restore_backup(
        args.file, args.name, durability=args.durability, validate_only=args.dry_run
    )
    record = {**result.info.to_dict(), "source_name": result.source_name, "source_uid": result.source_uid}
    did = "is good: it would make" if args.dry_run else "restored:"
    source = "" if result.source_name == result.info.name else f", from {result.source_name}"
    counts = result.info.counts
    return record, (
        f"{args.file} {did} {result.info.name} at revision {result.revision}{source}, durability "
        f"{result.info.durability}, {counts.vertices} vertices, {counts.faces} faces, {counts.cells} cells"
    )
