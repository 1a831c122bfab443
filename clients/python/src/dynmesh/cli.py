"""The command ``dynmesh``.

Exit codes: 0 done, 1 refused or failed (one line with the reason on stderr), 2 wrong usage, 130 interrupted. Of
``dynmesh check``: 0 good, 1 not, 2 failed.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Sequence
from typing import Any

import numpy as np

from .cli_adapt import adapt, add_adapt
from .cli_backup import add_backup_options, add_restore_options, backup, restore
from .cli_check import CHECK_FAILED, CHECK_FOUND, add_check, add_settings, describe_report, run_check
from .cli_edit import add_operators, describe_operators, operate, operator_record
from .cli_history import add_history, add_retention_options, add_snapshots, retention_of
from .cli_info import describe_info, info_row
from .cli_notes import add_note_options
from .cli_parser import CommandParser, UsageError, positive
from .cli_query import add_questions
from .cli_repair import add_repair_options, describe_repair, repair, repair_record
from .cli_warnings import print_warnings, warning_records
from .cli_watch import watch
from .client import DEFAULT_TARGET, DEFAULT_TIMEOUT_S, Client, connect
from .daemon import find_daemon
from .durability import DURABILITY_NAMES
from .edit_result import HistoryResult
from .errors import DynmeshError
from .files import read_mesh
from .info import SessionInfo
from .session import Session
from .transfer import ImportResult

_EXIT_ERROR, _EXIT_USAGE, _EXIT_INTERRUPTED = 1, 2, 130


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs one command; returns the exit code."""
    arguments = sys.argv[1:] if arguments is None else arguments
    try:
        args = _parse(arguments)
    except UsageError as error:
        print(_usage_line(error, as_json="--json" in arguments), file=sys.stderr)
        return _EXIT_USAGE
    try:
        return int(args.run(args) or 0)
    except BrokenPipeError:  # whoever read the output has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except (DynmeshError, OSError) as error:
        print(_error_line(error, as_json=args.json), file=sys.stderr)
        return int(args.exit_code_of_errors)
    except KeyboardInterrupt:
        return _EXIT_INTERRUPTED


def make_parser() -> argparse.ArgumentParser:
    """The command line; ``args.run(args)`` does what was asked for."""
    parser = CommandParser(
        prog="dynmesh",
        description="Named mesh sessions in a dynmesh daemon.",
        epilog="The daemon is found by --target, else by the environment variable DYNMESH_TARGET.",
    )
    parser.set_defaults(
        target=os.environ.get("DYNMESH_TARGET", DEFAULT_TARGET),
        timeout=DEFAULT_TIMEOUT_S,
        json=False,
        exit_code_of_errors=_EXIT_ERROR,
    )
    _add_common(parser)
    commands = parser.add_subparsers(metavar="COMMAND", required=True)
    _add_serve(commands)
    _add_writing(commands)
    _add_reading(commands)
    _add_query(commands)
    _add_history(commands)
    return parser


def _parse(arguments: Sequence[str]) -> argparse.Namespace:
    """What was asked for. Raises `UsageError`."""
    parser = make_parser()
    args, args.rest = parser.parse_known_args(arguments)
    if args.rest and args.run is not _serve:
        parser.error(f"unrecognized arguments: {' '.join(args.rest)}")
    _check_together(parser, args)
    return args


def _add_common(parser: argparse.ArgumentParser) -> None:
    """Options that may stand before the command or after it."""
    suppress = argparse.SUPPRESS
    parser.add_argument("--target", metavar="ADDRESS", default=suppress, help="host:port or unix:/path")
    parser.add_argument("--timeout", metavar="SECONDS", type=float, default=suppress, help="of each call")
    parser.add_argument(
        "--json", action="store_true", default=suppress, help="output for programs; errors too, on stderr"
    )


def _command(commands: Any, name: str, run: Any, help_text: str, **options: Any) -> argparse.ArgumentParser:
    parser: argparse.ArgumentParser = commands.add_parser(
        name, help=help_text, description=help_text, **options
    )
    parser.set_defaults(run=run)
    _add_common(parser)
    return parser


def _add_serve(commands: Any) -> None:
    serve = _command(
        commands,
        "serve",
        _serve,
        "Become a dynmeshd. All other options are passed on to it; dynmeshd --help lists them.",
    )
    serve.add_argument("--binary", metavar="PATH", help="the dynmeshd to run")


def _add_writing(commands: Any) -> None:
    create = _command(commands, "create", _create, "Make a session, empty or filled from a mesh file.")
    create.add_argument("name", metavar="NAME")
    create.add_argument("file", metavar="FILE", nargs="?", help="any format that meshio reads")
    create.add_argument(
        "--duplicates", choices=("keep", "refuse"), default="keep", help="equal elements (keep)"
    )
    create.add_argument(
        "--durability",
        choices=DURABILITY_NAMES,
        help="what acknowledges an edit: nothing, a write, the disk (sync, if the daemon has a data directory)",
    )
    add_retention_options(create)
    _add_import_options(create)
    fill = _command(commands, "import", _import, "Fill an empty session from a mesh file.")
    fill.add_argument("name", metavar="NAME")
    fill.add_argument("file", metavar="FILE", help="any format that meshio reads")
    _add_import_options(fill)
    add_operators(lambda name, text: _command(commands, name, _operate, text))
    add_adapt(lambda name, text: _command(commands, name, _adapt, text))
    store = _command(
        commands,
        "store",
        _store,
        "Keep just these relations as tables: faster queries for memory and slower edits.",
    )
    store.add_argument("name", metavar="NAME")
    store.add_argument(
        "relations",
        metavar="RELATION",
        nargs="+",
        type=_relation,
        help="cell-edge, vertex-cell, edge-cell, vertex-face, cell-cell, vertex-vertex; or none",
    )
    add_settings(_command(commands, "set-checks", _set_checks, "Make just these checks on each batch from now on."))
    help_text = "Keep just these earlier revisions from now on, besides snapshots. Without options: as the daemon says."
    retain = _command(commands, "set-retention", _set_retention, help_text)
    retain.add_argument("name", metavar="NAME")
    add_retention_options(retain)
    help_text = "Repair a session, as one revision: the steps in the order in which they are listed."
    mend = _command(commands, "repair", _repair, help_text)
    mend.add_argument("name", metavar="NAME")
    add_repair_options(mend)
    _add_if_revision(mend)
    add_note_options(mend)
    for name, text in (("undo", "Take the last batches of edits back."), ("redo", "Do undone batches again.")):
        step = _command(commands, name, _undo if name == "undo" else _redo, text)
        step.add_argument("name", metavar="NAME")
        step.add_argument("count", metavar="N", nargs="?", type=positive, default=1, help="batches (1)")
        _add_if_revision(step)
        add_note_options(step)
    help_text = "Make a session of a backup, at the revision that was backed up."
    add_restore_options(_command(commands, "restore", _restore, help_text))
    remove = _command(commands, "rm", _rm, "Delete a session. Asks first when typed at a terminal.")
    remove.add_argument("name", metavar="NAME")
    remove.add_argument("--yes", action="store_true", help="do not ask")


def _add_if_revision(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--if-revision", metavar="R", type=int, help="only if the session is at this revision")


def _add_import_options(parser: argparse.ArgumentParser) -> None:
    help_text = "point and cell data to take, separated by commas; empty for none (default: all)"
    parser.add_argument("--attributes", metavar="NAMES", type=_names, help=help_text)
    parser.add_argument(
        "--slot-order",
        choices=("caller", "hilbert"),
        default="caller",
        help="ids in the order of the file, or along a space-filling curve, which makes queries faster (caller)",
    )
    parser.add_argument(
        "--slot-map",
        metavar="FILE.npz",
        help="where to write the ids that --slot-order hilbert gave: an array for each kind, by position in the file",
    )
    add_note_options(parser)


def _add_reading(commands: Any) -> None:
    _command(commands, "ls", _ls, "List the sessions.")
    info = _command(commands, "info", _info, "Show what a session is and holds.")
    info.add_argument("name", metavar="NAME")
    export = _command(commands, "export", _export, "Write a session to a mesh file.")
    export.add_argument("name", metavar="NAME")
    export.add_argument(
        "file", metavar="FILE", help="its extension chooses meshio's format: .vtu holds everything"
    )
    export.add_argument("--no-slots", action="store_true", help="leave out the ids (dynmesh:slot)")
    help_text = "Write a session to a file from which it can be restored, while it is edited."
    add_backup_options(_command(commands, "backup", _backup, help_text))
    checking = _command(commands, "check", _check, "Check shapes and topology.")
    checking.set_defaults(exit_code_of_errors=CHECK_FAILED)
    add_check(checking)
    follow = _command(commands, "watch", _watch, "Follow a session: a line for each step, until interrupted.")
    follow.add_argument("name", metavar="NAME")
    follow.add_argument("--count", metavar="N", type=positive, help="end after so many steps")
    follow.add_argument("--codec", choices=("auto", "draco", "zstd", "raw"), default="auto", help="(auto)")
    follow.add_argument(
        "--min-interval", metavar="SECONDS", type=float, default=0.0, help="between steps (0)"
    )


def _add_query(commands: Any) -> None:
    help_text = "Ask about neighbours and places."
    questions = commands.add_parser("query", help=help_text, description=help_text).add_subparsers(
        metavar="QUESTION", required=True
    )
    add_questions(lambda name, text: _command(questions, name, _ask, text))


def _add_history(commands: Any) -> None:
    add_history(lambda name, text: _command(commands, name, _ask, text))
    help_text = "Name revisions, which are kept then."
    snapshots = commands.add_parser("snapshot", help=help_text, description=help_text).add_subparsers(
        metavar="ACTION", required=True
    )
    add_snapshots(lambda name, text: _command(snapshots, name, _ask, text))


# ---- Commands ----


def _serve(args: argparse.Namespace) -> int:
    binary = find_daemon(args.binary)
    sys.stdout.flush()
    os.execv(binary, [binary, *args.rest])


def _check_together(parser: argparse.ArgumentParser, args: argparse.Namespace) -> None:
    """Refuses options that make no sense with others."""
    if getattr(args, "slot_map", None) and (args.file is None or args.slot_order != "hilbert"):
        parser.error("--slot-map tells the ids that FILE got with --slot-order hilbert: else item i gets id i")
    if args.run is _create and args.message is not None and args.file is None:
        parser.error("--message says why FILE is imported, and there is none")
    chosen = getattr(args, "relations", []) or getattr(args, "checks", [])
    if None in chosen and len(chosen) > 1:
        parser.error("none stands alone: it switches all relations to on demand, or all checks off")
    pairs = getattr(args, "ends", False) or getattr(args, "pairs", False)
    if pairs and len(args.ids) % 2 != 0:
        parser.error("the IDs are pairs of vertices, and one is left over")
    if getattr(args, "ends", False) and (getattr(args, "faces", False) or getattr(args, "kind", None)):
        parser.error("--ends names edges, which --faces and --kind do not")
    if getattr(args, "kind", None) and getattr(args, "at", None) is not None:
        parser.error("--at is a place on an edge, and --kind names elements")
    if getattr(args, "needs_target", False) and (args.revision is None) == (args.snapshot is None):
        parser.error("say what to go back to: either REVISION or --snapshot SNAPSHOT")


def _create(args: argparse.Namespace) -> None:
    mesh = read_mesh(args.file) if args.file else None  # first: a file that cannot be read makes no session
    with _client(args) as client:
        session = client.create_session(
            args.name,
            duplicates=args.duplicates,
            durability=args.durability,
            retention=retention_of(args),
        )
        if mesh is None:
            return _print_info(args, session.info())
        try:
            result = _import_mesh(args, session, mesh)
        except BaseException:
            session.delete()
            raise
        _print_import(args, result)


def _import(args: argparse.Namespace) -> None:
    mesh = read_mesh(args.file)
    with _client(args) as client:
        _print_import(args, _import_mesh(args, client.session(args.name), mesh))


def _import_mesh(args: argparse.Namespace, session: Session, mesh: Any) -> ImportResult:
    result = session.import_mesh(
        mesh, attributes=args.attributes, slot_order=args.slot_order, message=args.message
    )
    if args.slot_map:
        with open(args.slot_map, "wb") as file:  # np.savez would change the name
            np.savez(file, **{str(kind): ids for kind, ids in result.slots.items()})
    return result


def _store(args: argparse.Namespace) -> None:
    with _client(args) as client:
        wanted = [relation for relation in args.relations if relation is not None]
        _print_info(args, client.session(args.name).store_relations(wanted))


def _operate(args: argparse.Namespace) -> None:
    with _client(args) as client:
        result = operate(client.session(args.name), args)
    print_warnings(result.warnings)
    _print(args, operator_record(result), describe_operators(result, args))


def _repair(args: argparse.Namespace) -> None:
    with _client(args) as client:
        result = repair(client.session(args.name), args)
    _print(args, repair_record(result), describe_repair(result, args))


def _set_checks(args: argparse.Namespace) -> None:
    with _client(args) as client:
        wanted = dict(setting for setting in args.checks if setting is not None)
        _print_info(args, client.session(args.name).set_checks(wanted))


def _set_retention(args: argparse.Namespace) -> None:
    with _client(args) as client:
        _print_info(args, client.session(args.name).set_retention(retention_of(args)))


def _undo(args: argparse.Namespace) -> None:
    with _client(args) as client:
        result = client.session(args.name).undo(args.count, **_step_options(args))
    _print_history(args, "undid", result)


def _redo(args: argparse.Namespace) -> None:
    with _client(args) as client:
        result = client.session(args.name).redo(args.count, **_step_options(args))
    _print_history(args, "redid", result)


def _step_options(args: argparse.Namespace) -> dict[str, Any]:
    return {"if_revision": args.if_revision, "message": args.message}


def _adapt(args: argparse.Namespace) -> None:
    with _client(args) as client:
        record, text = adapt(client.session(args.name), args)
    _print(args, record, text)


def _export(args: argparse.Namespace) -> None:
    with _client(args) as client:
        snapshot = client.session(args.name).export(args.file, slots=not args.no_slots)
    counts = {"vertices": len(snapshot.vertex_ids)}
    counts |= {block.type.meshio_name: len(block.ids) for block in snapshot.blocks}
    contents = ", ".join(f"{count} {name}" for name, count in counts.items())
    _print(
        args,
        {"file": args.file, "revision": snapshot.revision, **counts},
        f"wrote {args.file} at revision {snapshot.revision}: {contents}",
    )


def _backup(args: argparse.Namespace) -> None:
    with _client(args) as client:
        record, text = backup(client, args)
    _print(args, record, text)


def _restore(args: argparse.Namespace) -> None:
    with _client(args) as client:
        record, text = restore(client, args)
    _print(args, record, text)


def _ls(args: argparse.Namespace) -> None:
    with _client(args) as client:
        infos = list(client.sessions())
    lines = [f"{'NAME':24} {'REVISION':>9} {'VERTICES':>10} {'EDGES':>10} {'FACES':>10} {'CELLS':>10}"]
    lines += [info_row(info) for info in infos]
    _print(args, [info.to_dict() for info in infos], "\n".join(lines))


def _info(args: argparse.Namespace) -> None:
    with _client(args) as client:
        _print_info(args, client.session(args.name).info())


def _watch(args: argparse.Namespace) -> int:
    with _client(args) as client:
        return watch(client.session(args.name), args)


def _check(args: argparse.Namespace) -> int:
    with _client(args) as client:
        report, failed = run_check(client.session(args.name), args)
    _print(args, {**report.to_dict(), "failed": failed}, describe_report(report))
    if failed and not args.json:
        print(f"dynmesh: bad: {', '.join(failed)}", file=sys.stderr)
    return CHECK_FOUND if failed else 0


def _ask(args: argparse.Namespace) -> None:
    with _client(args) as client:
        record, text = args.ask(client.session(args.name), args)
    _print(args, record, text)


def _rm(args: argparse.Namespace) -> int | None:
    ask = sys.stdin.isatty() and not args.yes and not args.json
    if ask and not _confirmed(f"delete session {args.name}?"):
        return _EXIT_ERROR
    with _client(args) as client:
        revision = client.delete_session(args.name)
    _print(args, {"name": args.name, "revision": revision}, f"deleted {args.name} at revision {revision}")
    return None


# ---- Output ----


def _client(args: argparse.Namespace) -> Client:
    return connect(args.target, timeout=args.timeout, author=getattr(args, "author", None))


def _confirmed(question: str) -> bool:
    try:
        return input(f"{question} [y/N] ").strip().lower() in ("y", "yes")
    except EOFError:
        return False


def _relation(text: str) -> tuple[str, str] | None:
    if text == "none":
        return None
    source, dash, target = text.partition("-")
    if not dash:
        raise argparse.ArgumentTypeError(f"{text} is not a pair of kinds such as vertex-cell")
    return source, target


def _names(text: str) -> list[str]:
    return [name for name in text.split(",") if name]


def _error_line(error: BaseException, *, as_json: bool) -> str:
    if not as_json:
        return "dynmesh: " + " ".join(str(error).split())
    record: dict[str, Any] = {"type": type(error).__name__, "message": str(error), "reason": "", "metadata": {}}
    if isinstance(error, DynmeshError):
        record |= {"message": error.message, "reason": error.reason, "metadata": error.metadata}
    return json.dumps({"error": record})


def _usage_line(error: UsageError, *, as_json: bool) -> str:
    return _error_line(error, as_json=True) if as_json else f"{error.usage}{error.prog}: error: {error}"


def _print(args: argparse.Namespace, value: Any, text: str) -> None:
    print(json.dumps(value) if args.json else text, flush=True)


def _print_import(args: argparse.Namespace, result: ImportResult) -> None:
    print_warnings(result.warnings)
    record = {**result.info.to_dict(), "warnings": warning_records(result.warnings)}
    _print(args, record, describe_info(result.info))


def _print_history(args: argparse.Namespace, did: str, result: HistoryResult) -> None:
    text = f"{did} {result.count} batch(es): {args.name} is at revision {result.revision}"
    left = f"{result.undoable_batches} can be undone, {result.redoable_batches} redone"
    _print(args, {"name": args.name, **result.to_dict()}, f"{text}; {left}")


def _print_info(args: argparse.Namespace, info: SessionInfo) -> None:
    _print(args, info.to_dict(), describe_info(info))
