"""What a session was before, on the command line, as a shell sees it."""

from __future__ import annotations

import getpass
import json
import os
import subprocess
import sys

import dynmesh
import meshio
import pytest
from dynmesh.cli import main, make_parser
from dynmesh.cli_history import byte_count
from dynmesh.cli_notes import one_line
from shapes import two_tets

COMMAND = (
    [os.environ["DYNMESH_COMMAND"]] if "DYNMESH_COMMAND" in os.environ else [sys.executable, "-m", "dynmesh"]
)


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    """A daemon that keeps sessions."""
    with dynmesh.launch(data_dir=tmp_path_factory.mktemp("data")) as running:
        yield running


@pytest.fixture
def shell(store):
    """Runs a command in a process of its own."""

    def call(*args: object) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [*COMMAND, *map(str, args)],
            env={**os.environ, "DYNMESH_TARGET": store.target, "LOGNAME": "ann"},
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
            stdin=subprocess.DEVNULL,
        )

    return call


@pytest.fixture
def part(store, shell, tmp_path):
    """Two tetrahedra, imported by the command as revision 1."""
    meshio.write(tmp_path / "tets.vtu", two_tets())
    made = shell("create", "part", tmp_path / "tets.vtu", "-m", "as drawn")
    assert made.returncode == 0, made.stderr
    session = store.client.session("part")
    yield session
    assert session.validate() == []
    session.delete()


def told(run: subprocess.CompletedProcess[str]):
    """What a command told programs."""
    assert run.returncode == 0, run.stderr
    return json.loads(run.stdout)


def test_history_lists_who_did_what_and_why(part, shell):
    assert shell("split", "part", "--ends", 0, 1, "--message", "finer").returncode == 0
    assert shell("undo", "part", "-m", "too fine", "--author", "bob").returncode == 0
    assert shell("redo", "part").returncode == 0
    assert shell("repair", "part", "--weld", 2, "-m", "welded").returncode == 0
    records = told(shell("history", "part", "--json"))
    assert [(r["revision"], r["kind"], r["author"], r["message"]) for r in records] == [
        (5, "repair", "ann", "welded"),
        (4, "redo", "ann", ""),
        (3, "undo", "bob", "too fine"),
        (2, "edit", "ann", "finer"),
        (1, "import", "ann", "as drawn"),
    ]
    header, *rows = shell("history", "part", "--limit", 3).stdout.splitlines()
    assert header.split()[0] == "REVISION" and [row.split()[0] for row in rows] == ["5", "4", "3"]
    assert "undo" in rows[2] and rows[2].endswith(" bob          too fine") and rows[1].endswith(" ann")


def test_rollback_goes_back_and_undo_takes_that_back(part, shell):
    first = part.info().checksum
    last = told(shell("split", "part", "--ends", 0, 1, "--json"))
    assert (last["revision"], last["durable_revision"]) == (2, 2)
    dry = shell("rollback", "part", 1, "--dry-run")
    assert dry.stdout == "part would be as it was at revision 1: 5 vertices, 9 edges, 7 faces, 2 cells\n"
    assert part.revision == 2
    record = told(shell("rollback", "part", "1", "--if-revision", 2, "-m", "as drawn", "--json"))
    assert (record["name"], record["revision"], record["target_revision"]) == ("part", 3, 1)
    assert record["checksum"] == str(first) == str(part.info().checksum)
    assert next(part.revisions()).message == "as drawn"
    assert shell("undo", "part").returncode == 0 and part.counts.vertices == 6
    said = shell("rollback", "part", 1).stdout
    assert said.startswith("part is at revision 5, as it was at revision 1: 5 vertices, ")
    assert said.endswith("; 2 can be undone, 0 redone\n")


def test_snapshots_are_made_listed_gone_back_to_and_deleted(part, shell):
    made = shell("snapshot", "create", "part", "before", "-m", "in case")
    assert made.stdout == "snapshot before is revision 1 of part\n"
    assert shell("split", "part", "--ends", 0, 1).returncode == 0
    record = told(shell("snapshot", "create", "part", "first", "--revision", 1, "--author", "bob", "--json"))
    assert (record["name"], record["revision"], record["author"]) == ("first", 1, "bob")
    assert [s["name"] for s in told(shell("snapshot", "list", "part", "--json"))] == ["before", "first"]
    rows = shell("snapshot", "list", "part").stdout.splitlines()
    assert len(rows) == 3 and rows[1].startswith("before ") and rows[1].endswith(" ann          in case")
    assert told(shell("rollback", "part", "--snapshot", "before", "--json"))["target_revision"] == 1
    assert shell("snapshot", "delete", "part", "first").stdout == "deleted snapshot first of part\n"
    assert [s.name for s in part.snapshots()] == ["before"]
    for command in (("rollback", "part", "--snapshot", "first"), ("snapshot", "delete", "part", "first")):
        refused = shell(*command)
        assert refused.returncode == 1 and refused.stderr.endswith("[SNAPSHOT_NOT_FOUND]\n")
    again = shell("snapshot", "create", "part", "before", "--json")
    assert json.loads(again.stderr)["error"]["reason"] == "SNAPSHOT_EXISTS"


def test_a_fork_is_a_session_of_its_own(part, store, shell):
    assert shell("split", "part", "--ends", 0, 1).returncode == 0
    made = shell("fork", "part", "copy", "--revision", 1, "--durability", "async", "-m", "to try things")
    assert made.stdout == (
        "copy begins with revision 1 of part: 5 vertices, 9 edges, 7 faces, 2 cells; durability async\n"
    ), made.stderr
    (only,) = told(shell("history", "copy", "--json"))
    assert (only["kind"], only["author"], only["message"]) == ("creation", "ann", "to try things")
    now = told(shell("fork", "part", "now", "--json"))
    assert (now["name"], now["revision"], now["counts"]["vertices"]) == ("now", 2, 6)
    part.create_snapshot("s", 1)
    assert told(shell("fork", "part", "named", "--snapshot", "s", "--json"))["revision"] == 1
    assert shell("fork", "part", "copy").stderr.endswith("[SESSION_EXISTS]\n")
    for name in ("copy", "now", "named"):
        store.client.delete_session(name)


def test_what_cannot_be_had_is_one_line_with_the_reason(part, store, shell):
    gone = shell("rollback", "part", 0)
    assert gone.returncode == 1 and gone.stderr.count("\n") == 1 and gone.stderr.endswith("[REVISION_GONE]\n")
    assert shell("rollback", "part", 9).stderr.endswith("[REVISION_IN_FUTURE]\n")
    assert shell("rollback", "part", 1, "--if-revision", 7).stderr.endswith("[REVISION_MISMATCH]\n")
    assert shell("undo", "part", "-m", "m" * 5000).stderr.endswith("[BAD_ARGUMENT]\n")
    scratch = store.client.create_session("scratch", durability="none")
    for command in (("history", "scratch"), ("snapshot", "list", "scratch"), ("rollback", "scratch", 1)):
        assert shell(*command).stderr.endswith("[NO_HISTORY]\n")
    assert shell("history", "nobody").stderr.endswith("[SESSION_NOT_FOUND]\n")
    scratch.delete()


def test_bytes_that_are_no_text_are_refused_by_name(part, store):
    command = [*COMMAND, "--target", store.target, "undo", part.name, "-m", b"\xff"]
    refused = subprocess.run(command, capture_output=True, text=True, check=False)
    assert refused.returncode == 1 and "message is no text" in refused.stderr
    assert "Traceback" not in refused.stderr


def test_retention_is_set_when_a_session_is_made_and_later(store, shell):
    options = ("--retain-revisions", 100, "--retain-age", "36h", "--retain-bytes", "64M")
    record = told(shell("create", "retaining", *options, "--json"))
    assert record["retention"] == {"max_revisions": 100, "max_age": 129600, "max_bytes": 64 << 20}
    assert "retention  at most 100 revisions, 129600 s, 64.0 MiB\n" in shell("info", "retaining").stdout
    changed = shell("set-retention", "retaining", "--retain-age", "7d")
    assert "retention  at most 604800 s\n" in changed.stdout, changed.stderr
    assert "retention  as the daemon says\n" in shell("set-retention", "retaining").stdout
    shell("create", "scratch", "--durability", "none")
    assert "retention" not in shell("info", "scratch").stdout
    for name in ("retaining", "scratch"):
        store.client.delete_session(name)


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("rollback --snapshot s w", {"name": "w", "snapshot": "s", "revision": None}),
        ("rollback w --dry-run 7", {"name": "w", "revision": 7, "dry_run": True}),
        ("fork w --revision 7 v", {"name": "w", "new": "v", "revision": 7, "durability": None}),
        ("snapshot create w --revision 7 s", {"name": "w", "snapshot": "s", "revision": 7}),
        ("smooth w -m why 14", {"message": "why", "ids": [14], "author": getpass.getuser()}),
        ("adapt w --target-length 1 --author bob", {"author": "bob", "message": None}),
        ("create w f --retain-age 90m", {"retain_age": 5400, "retain_revisions": 0, "retain_bytes": 0}),
        ("create w f --retain-age 1.5h", {"retain_age": 5400}),
        ("set-retention w --retain-bytes 2G", {"retain_bytes": 2 << 30}),
    ],
)
def test_arguments_are_understood(line, expected):
    args = vars(make_parser().parse_args(line.split()))
    assert {key: args[key] for key in expected} == expected


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("rollback w", "either REVISION or --snapshot"),
        ("rollback w 7 --snapshot s", "either REVISION or --snapshot"),
        ("rollback w -1", "'-1' is not a whole number"),
        ("rollback w first", "'first' is not a whole number"),
        ("fork w", "the following arguments are required: NEW"),
        ("fork w v --revision 7 --snapshot s", "not allowed with argument"),
        ("fork w v --durability forever", "invalid choice: 'forever'"),
        ("history w --limit 0", "'0' is not a positive whole number"),
        ("snapshot", "required: ACTION"),
        ("snapshot create w", "required: SNAPSHOT"),
        ("snapshot create w s --revision 0", "'0' is not a positive whole number"),
        ("create w -m why", "there is none"),
        ("create w f --retain-age soon", "'soon' is not an age such as"),
        ("create w f --retain-age -5", "'-5' is not an age such as"),
        ("create w f --retain-bytes 1X", "'1X' is not a number of bytes"),
        ("create w f --retain-revisions -1", "'-1' is not a whole number"),
    ],
)
def test_wrong_usage_is_told(line, message, capsys):
    assert main(line.split()) == 2
    out, err = capsys.readouterr()
    assert out == "" and message in err.splitlines()[-1]


def test_help_is_there_for_all_of_it(capsys):
    snapshots = [f"snapshot {action}" for action in ("create", "list", "delete")]
    for command in ("history", "rollback", "fork", "set-retention", *snapshots):
        with pytest.raises(SystemExit) as ended:
            main([*command.split(), "--help"])
        assert ended.value.code == 0 and f"usage: dynmesh {command}" in capsys.readouterr().out


def test_sizes_have_units():
    assert [byte_count(text) for text in ("12", "1k", "1.5M", "2G", "1T")] == [12, 1024, 3 << 19, 2 << 30, 1 << 40]


def test_what_others_wrote_is_one_line_that_commands_no_terminal():
    assert one_line("first\nsecond") == "first ..."
    assert one_line("\x1b[31mred\x07") == "\N{REPLACEMENT CHARACTER}[31mred\N{REPLACEMENT CHARACTER}"
    assert one_line("") == "" and one_line("  \n") == ""
