"""What the command takes for its arguments, and how it refuses others; nothing here needs a daemon."""

from __future__ import annotations

import json

import pytest
from dynmesh.cli import main, make_parser


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("smooth w --method guarded 14 21", {"name": "w", "ids": [14, 21], "method": "guarded"}),
        ("smooth --json w 14 --iterations 3 21", {"ids": [14, 21], "iterations": 3, "json": True}),
        ("smooth w --iterations 3", {"name": "w", "ids": []}),
        ("undo w --if-revision 4 1", {"count": 1, "if_revision": 4}),
        ("undo --if-revision 4 w", {"name": "w", "count": 1, "if_revision": 4}),
        ("create x --duplicates refuse tri.vtu", {"file": "tri.vtu", "duplicates": "refuse"}),
        ("query neighbors w vertex cell --rings 1 --ids 1,3", {"to_kind": "cell", "rings": 1, "ids": [1, 3]}),
        ("query neighbors w --rings 2 vertex cell", {"name": "w", "from_kind": "vertex", "to_kind": "cell"}),
        ("query nearest w -1e-3 --count 2 -.5 -1.", {"X": -1e-3, "Y": -0.5, "Z": -1.0, "count": 2}),
        ("split w 17 --at 0.3 18", {"ids": [17, 18], "at": 0.3}),
        ("store w --json vertex-cell none", {"relations": [("vertex", "cell"), None]}),
        ("rm -- --yes", {"name": "--yes", "yes": False}),
        ("smooth --method guarded -- -w 1 2", {"name": "-w", "ids": [1, 2]}),
    ],
)
def test_options_may_stand_between_positionals(line, expected):
    args = vars(make_parser().parse_args(line.split()))
    assert {key: args[key] for key in expected} == expected


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("split a x", "argument ID: invalid int value: 'x'"),
        ("foo", "invalid choice: 'foo'"),
        ("ls --what", "unrecognized arguments: --what"),
        ("smooth a 1 --what 2", "unrecognized arguments: --what"),
        ("query neighbors w vertex cell --rings 1 3", "unrecognized arguments: 3"),
        ("query neighbors w vertex", "the following arguments are required: TO"),
        ("merge w 1", "one is left over"),
        ("undo w x", "argument N: 'x' is not a positive whole number"),
        ("undo w 0", "argument N: '0' is not a positive whole number"),
        ("query neighbors w vertex cell --ids 1,b", "'1,b' is not a list of ids such as 3,14"),
        ("", "required: COMMAND"),
    ],
)
def test_wrong_usage_is_told_to_humans_and_to_programs(line, message, capsys):
    assert main(line.split()) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.startswith("usage: dynmesh") and message in err.splitlines()[-1]
    assert main(["--json", *line.split()]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1
    error = json.loads(err)["error"]
    assert error["type"] == "UsageError" and message in error["message"]


def test_the_usage_of_a_command_has_all_of_its_arguments(capsys):
    assert main(["smooth", "w", "x"]) == 2
    told = " ".join(capsys.readouterr().err.split())
    assert "usage: dynmesh smooth" in told and "NAME [ID ...]" in told
    with pytest.raises(SystemExit) as ended:
        main(["smooth", "--help"])
    told = " ".join(capsys.readouterr().out.split())
    assert ended.value.code == 0 and "NAME [ID ...]" in told and "max_batch_work" in told
