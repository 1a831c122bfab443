"""The command: in a process of its own, as a shell sees it, where that matters, else within this one."""

from __future__ import annotations

import contextlib
import io
import json
import os
import signal
import subprocess
import sys

import dynmesh
import meshio
import numpy as np
import pytest
from dynmesh.cli import main
from shapes import bow_tie, two_tets, zoo

COMMAND = (
    [os.environ["DYNMESH_COMMAND"]] if "DYNMESH_COMMAND" in os.environ else [sys.executable, "-m", "dynmesh"]
)


@pytest.fixture
def run(daemon, monkeypatch):
    """Runs a command within this process, and gives its exit code, stdout and stderr."""

    def call(*args: object, target: str = daemon.target) -> subprocess.CompletedProcess[str]:
        monkeypatch.setenv("DYNMESH_TARGET", target)
        stdout, stderr = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(stdout), contextlib.redirect_stderr(stderr):
            try:
                code = main([*map(str, args)])
            except SystemExit as ended:  # help, or wrong usage
                code = ended.code
        return subprocess.CompletedProcess(args, code, stdout.getvalue(), stderr.getvalue())

    return call


@pytest.fixture
def shell(daemon):
    """The same in a process of its own."""

    def call(*args: object, target: str = daemon.target) -> subprocess.CompletedProcess[str]:
        environment = {**os.environ, "DYNMESH_TARGET": target}
        return subprocess.run(
            [*COMMAND, *map(str, args)],
            env=environment,
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
            stdin=subprocess.DEVNULL,
        )

    return call


@pytest.fixture
def mesh_file(tmp_path):
    """A file of two tetrahedra."""
    meshio.write(tmp_path / "tets.vtu", two_tets())
    return tmp_path / "tets.vtu"


def test_operators_change_what_is_named_and_a_dry_run_tells(run, mesh_file):
    assert run("create", "ops", mesh_file).returncode == 0
    dry = json.loads(run("split", "ops", "--ends", "0", "1", "--at", "0.25", "--dry-run", "--json").stdout)
    assert (dry["revision"], dry["counts"]["vertices"]) == (1, 6)
    text = run("split", "ops", "--ends", 0, 1, "--at", "0.25").stdout
    assert text.startswith("revision 2: 6 vertices") and "new vertices: 5\n" in text
    smoothed = json.loads(run("smooth", "ops", "--move-boundary", "--min-quality", "0.01", "--json").stdout)
    assert (smoothed["revision"], smoothed["skipped"]) == (3, [])
    refused = run("swap", "ops", "--ends", 0, 5)
    assert refused.returncode == 1 and refused.stderr.startswith("dynmesh: ") and "[BOUNDARY]" in refused.stderr
    places = ("--ends", 0, 5, 0, 4000)
    skipped = json.loads(run("swap", "ops", *places, "--skip-refused", "--json").stdout)
    assert skipped["skipped"] == [0, 1]
    assert [refusal["reason"] for refusal in skipped["refusals"]] == ["BOUNDARY", "UNKNOWN_ENTITY"]
    passed_over = run("split", "ops", "--ends", 0, 4000, "--skip-refused", "--dry-run", "--json")
    assert json.loads(passed_over.stdout)["new_vertices"] == [None]
    assert "item 1: UNKNOWN_ENTITY" in run("swap", "ops", *places, "--skip-refused").stdout
    assert run("collapse", "ops", "--ends", 0, 5, "--at", "0").stdout.startswith("revision 6: 5 vertices")
    assert run("rm", "ops", "--yes").returncode == 0


def test_elements_are_split_and_vertices_dissolved(run, mesh_file):
    assert run("create", "parts", mesh_file).returncode == 0
    split = json.loads(run("split", "parts", "0", "--kind", "cell", "--json").stdout)
    assert (split["new_vertices"], split["counts"]["cells"]) == ([5], 5)
    assert run("dissolve", "parts", 5).stdout.startswith("revision 3: 5 vertices")
    assert run("rm", "parts", "--yes").returncode == 0


def test_operators_whose_names_make_no_sense_are_wrong_usage(run):
    ends, at = ("--ends", 1, 2), ("--at", "0.5")
    for arguments in (("--ends", 1), (*ends, "--kind", "cell"), (1, *at, "--kind", "cell"), (*ends, "--faces"), ()):
        assert run("split" if "--faces" not in arguments else "swap", "none", *arguments).returncode == 2


def test_a_repair_tells_what_it_did_and_a_dry_run_what_it_would_do(run, tmp_path):
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 0], [1, 0, 0], [0, -1, 0], [9, 9, 9]], dtype=float)
    meshio.write_points_cells(tmp_path / "halves.vtu", points, {"triangle": np.array([[0, 1, 2], [3, 5, 4]])})
    assert run("create", "halves", tmp_path / "halves.vtu").returncode == 0
    options = ("--weld", "1e-9", "--remove-isolated", "--split-non-manifold", "--orient", "--fill-holes", "3")
    dry = json.loads(run("repair", "halves", *options, "--dry-run", "--json").stdout)
    assert (dry["revision"], dry["steps"][0]["merged"]["ids"]) == (1, [3, 4])
    done = json.loads(run("repair", "halves", *options, "--json").stdout)
    assert (done["revision"], done["steps"]) == (2, dry["steps"])
    assert done["counts"] == {"vertices": 4, "edges": 5, "faces": 2, "cells": 0}
    text = run("repair", "halves", "--orient", "--fill-holes", "3").stdout
    assert run("repair", "halves", "--orient", "--dry-run").stdout == "would be done at revision 2\norient: nothing\n"
    assert text == "revision 2\norient: nothing\nfill holes: 1 hole too long\norient: nothing\n"
    refused = run("repair", "halves", "--weld", "-1")
    assert refused.returncode != 0 and "Traceback" not in refused.stderr
    run("rm", "halves")


def test_a_mesh_through_the_command_and_out_again(shell, mesh_file, tmp_path):
    created = shell("create", "cli", mesh_file, "--json")
    assert created.returncode == 0, created.stderr
    assert json.loads(created.stdout)["counts"] == {"vertices": 5, "edges": 9, "faces": 7, "cells": 2}
    assert created.stderr == ""
    listed = json.loads(shell("ls", "--json").stdout)
    assert [info["name"] for info in listed] == ["cli"]
    exported = json.loads(shell("--json", "export", "cli", tmp_path / "out.vtu").stdout)
    assert exported["revision"] == 1 and exported["tetra"] == 2
    assert (meshio.read(tmp_path / "out.vtu").cells[0].data == two_tets().cells[0].data).all()
    assert json.loads(shell("rm", "cli", "--json").stdout) == {"name": "cli", "revision": 1}
    assert json.loads(shell("ls", "--json").stdout) == []


@pytest.mark.parametrize(
    "arguments",
    [
        ("create", "odd", "--slot-map", "map.npz"),
        ("create", "odd", "FILE", "--slot-map", "map.npz"),
        ("store", "odd", "none", "vertex-cell"),
        ("set-checks", "odd", "none", "inverted=warn"),
        ("set-checks", "odd", "inverted=never"),
        ("set-checks", "odd", "upside_down=warn"),
        ("set-checks", "odd", "quality=warn:high"),
        ("merge", "odd", "1", "2", "3"),
    ],
)
def test_options_that_make_no_sense_together_are_refused(run, mesh_file, arguments):
    refused = run(*(mesh_file if argument == "FILE" else argument for argument in arguments))
    assert refused.returncode == 2 and "usage:" in refused.stderr
    assert json.loads(run("ls", "--json").stdout) == []


def test_output_for_humans(run, mesh_file):
    assert "2" in run("create", "human", mesh_file).stdout
    assert "human" in run("ls").stdout
    text = run("info", "human").stdout
    assert "checksum" in text and "boundary" in text and "(0 0 0) to (1 1 1)" in text
    written = run("export", "human", mesh_file.with_name("out.vtk")).stdout
    assert written.endswith("out.vtk at revision 1: 5 vertices, 2 tetra\n")
    assert run("rm", "human").stdout == "deleted human at revision 1\n"


def test_a_hilbert_import_writes_the_map_of_ids(run, mesh_file, tmp_path):
    made = run("create", "curve", mesh_file, "--slot-order", "hilbert", "--slot-map", tmp_path / "map", "--json")
    assert made.returncode == 0, made.stderr
    slots = np.load(tmp_path / "map")
    assert sorted(slots.files) == ["cell", "vertex"]
    assert sorted(slots["vertex"]) == [0, 1, 2, 3, 4] and sorted(slots["cell"]) == [0, 1]
    run("rm", "curve")


def test_relations_are_stored_by_name(run, mesh_file):
    assert run("create", "store", mesh_file).returncode == 0
    stored = run("store", "store", "vertex-cell", "cell-cell", "--json")
    assert stored.returncode == 0, stored.stderr
    assert list(json.loads(stored.stdout)["stored_relations"]) == ["vertex-cell", "cell-cell"]
    assert "stored     vertex-cell" in run("info", "store").stdout
    assert json.loads(run("store", "store", "none", "--json").stdout)["stored_relations"] == {}
    refused = run("store", "store", "edge-edge")
    assert refused.returncode == 1 and "edge->edge is not one that can be switched" in refused.stderr
    assert run("store", "store", "vertexcell").returncode == 2
    run("rm", "store")


def test_import_fills_an_empty_session_once(run, mesh_file):
    assert run("create", "later").returncode == 0
    assert run("import", "later", mesh_file).returncode == 0
    again = run("import", "later", mesh_file)
    assert again.returncode == 1 and "SESSION_NOT_EMPTY" in again.stderr
    run("rm", "later")


def test_warnings_of_the_mesh_are_on_stderr(run, tmp_path):
    meshio.write(tmp_path / "zoo.vtu", zoo())
    created = run("create", "zoo", tmp_path / "zoo.vtu", "--json", "--attributes", "")
    assert created.returncode == 0 and "DEGENERATE_ELEMENT" in created.stderr
    record = json.loads(created.stdout)
    assert record["element_counts"]["cells"] == 4
    assert "DEGENERATE_ELEMENT" in [warning["reason"] for warning in record["warnings"]]
    run("rm", "zoo")


def test_a_file_that_cannot_be_read_makes_no_session(run, tmp_path):
    (tmp_path / "bad.vtu").write_text("nonsense")
    for file, why in ((tmp_path / "bad.vtu", "cannot read"), (tmp_path / "none.vtu", "no such file")):
        created = run("create", "bad", file)
        assert created.returncode == 1 and why in created.stderr
        assert created.stderr.count("\n") == 1 and "Traceback" not in created.stderr
    assert run("info", "bad").returncode == 1


def test_a_mesh_that_is_refused_makes_no_session(run, tmp_path):
    mesh = two_tets()
    mesh.point_data = {"big": np.full(5, 2**63, np.uint64)}
    meshio.write(tmp_path / "big.vtu", mesh)
    created = run("create", "refused", tmp_path / "big.vtu")
    assert created.returncode == 1 and "'big'" in created.stderr
    assert run("info", "refused").returncode == 1
    assert run("create", "refused", tmp_path / "big.vtu", "--attributes", "").returncode == 0
    run("rm", "refused")


def test_errors_are_one_line_with_the_reason(shell):
    missing = shell("info", "nobody")
    assert (missing.returncode, missing.stdout) == (1, "")
    assert missing.stderr.startswith("dynmesh: ") and missing.stderr.endswith("[SESSION_NOT_FOUND]\n")
    unreachable = shell("ls", target="unix:/nonexistent/socket")
    assert unreachable.returncode == 1 and unreachable.stderr.count("\n") == 1
    assert shell("frobnicate").returncode == 2


def test_errors_are_json_for_programs(run):
    missing = run("undo", "nobody", "--json")
    assert (missing.returncode, missing.stdout) == (1, "")
    error = json.loads(missing.stderr)["error"]
    assert (error["type"], error["reason"], error["metadata"]) == (
        "NotFoundError",
        "SESSION_NOT_FOUND",
        {"session": "nobody"},
    )
    assert error["message"]
    unread = json.loads(run("--json", "create", "nobody", "/nonexistent.vtu").stderr)["error"]
    assert unread["type"] == "FileNotFoundError" and "/nonexistent.vtu" in unread["message"]


@pytest.mark.parametrize(
    "args", [(), ("frobnicate",), ("info",), ("ls", "--what"), ("watch", "a", "--codec", "zip")]
)
def test_wrong_usage_is_2(run, args):
    assert run(*args).returncode == 2


def test_help_is_there_for_every_command(run):
    commands = "serve create import export ls info check set-checks query watch store rm undo redo repair adapt"
    operators = "split collapse swap smooth dissolve merge"
    for command in (*commands.split(), *operators.split()):
        shown = run(command, "--help")
        assert shown.returncode == 0 and "usage: dynmesh" in shown.stdout


def test_help_is_there_for_every_question(run):
    for question in ("neighbors", "box", "nearest", "locate", "ray"):
        shown = run("query", question, "--help")
        assert shown.returncode == 0 and f"usage: dynmesh query {question}" in shown.stdout, shown.stderr
        misused = run("query", question)
        assert misused.returncode == 2 and "Traceback" not in misused.stderr and "required" in misused.stderr


def test_numbers_may_be_written_in_any_way(run, mesh_file):
    run("create", "numbers", mesh_file)
    near = run("query", "nearest", "numbers", "-1e-3", "-0.", "-.0E+1")
    assert near.stdout == "0 at distance 0.001\n", near.stderr
    assert run("query", "box", "numbers", "vertex", "-1e-3", "-1.", "-.5", "1e-3", ".5", ".5").stdout == "0\n"
    assert run("query", "locate", "numbers", "-1E-3", "-1.e0", "0").stdout == "in no cell\n"
    hit = run("query", "ray", "numbers", "1e-1", "1e-1", "-1.", "-1e-9", "0", "1.")
    assert hit.stdout.startswith("face "), hit.stderr
    box = ["--box", "-1e-3", "-1.", "-1e0", "1e-3", "1", "1"]
    assert run("query", "neighbors", "numbers", "vertex", "cell", *box).returncode == 0
    assert run("query", "nearest", "numbers", "0", "0", "0", "-1x").returncode == 2
    run("rm", "numbers")


def test_query_asks_about_neighbours_and_places(run, mesh_file):
    run("create", "asked", mesh_file)

    def ask(*args):
        shown, told = run("query", *args), run("query", *args, "--json")
        assert (shown.returncode, told.returncode) == (0, 0), shown.stderr + told.stderr
        return shown.stdout.splitlines(), json.loads(told.stdout)

    lines, record = ask("neighbors", "asked", "cell", "cell")
    assert lines == ["0: 1", "1: 0"]
    assert record == {"revision": 1, "rows": [{"id": 0, "neighbors": [1]}, {"id": 1, "neighbors": [0]}]}
    corner = ["0", "0", "0", "0.5", "0.5", "0.5"]
    assert ask("neighbors", "asked", "vertex", "cell", "--box", *corner)[0] == ["0: 0"]
    assert ask("neighbors", "asked", "vertex", "vertex", "--ids", "0", "--rings", "2", "--boundary")[0] == [
        "0: 1 2 3 4"
    ]
    assert ask("box", "asked", "cell", *corner)[1] == {"revision": 1, "ids": [0, 1]}
    lines, record = ask("nearest", "asked", "-1", "0", "0", "--count", "2")
    assert lines[0] == "0 at distance 1" and record["distances"] == pytest.approx([1, 2**0.5])
    assert ask("locate", "asked", "0.1", "0.1", "0.1") == (["cell 0"], {"revision": 1, "kind": "cell", "id": 0})
    assert ask("locate", "asked", "-0.5", "9", "9")[0] == ["in no cell"]
    assert ask("locate", "asked", "0.2", "0.2", "-0.01", "--in", "face", "--tolerance", "0.1")[1]["id"] is not None
    hit = ask("ray", "asked", "0.2", "0.2", "-1", "0", "0", "1")
    assert hit[1]["t"] == [1] and hit[0][0].endswith("at t = 1")
    assert len(ask("ray", "asked", "0.2", "0.3", "-1", "0", "0", "1", "--all", "--any-face")[1]["t"]) == 3
    assert ask("ray", "asked", "5", "5", "5", "1", "0", "0")[0] == ["nothing"]
    refused = run("query", "box", "asked", "cell", "1", "1", "1", "0", "0", "0")
    assert refused.returncode == 1 and refused.stderr.endswith("[BAD_ARGUMENT]\n")
    assert run("query", "asked").returncode == 2 and run("query", "nearest", "asked", "x", "0", "0").returncode == 2
    run("rm", "asked")


def test_watch_prints_a_line_for_each_step(daemon, client, run):
    session = client.create_session("watched")
    session.import_mesh(two_tets())
    command = [*COMMAND, "--target", daemon.target, "watch", "watched", "--json", "--count", "2"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        first = json.loads(process.stdout.readline())
        assert first["revision"] == 1 and first["vertices"] == 5 and first["elements"]["cells"] == 2
        with session.edit() as tx:
            tx.remove_elements("cell", [0])
        second = json.loads(process.stdout.readline())
        assert (second["from_revision"], second["revision"], second["removed_elements"]) == (1, 2, 1)
        assert second["checksum"] == str(tx.result.checksum)
        assert process.wait(20) == 0
    line = run("watch", "watched", "--count", 1).stdout
    assert line.startswith("revision      2  ") and line.endswith("now 5 vertices, 1 cells\n")
    session.delete()


def test_watching_can_be_interrupted(daemon, client):
    session = client.create_session("interrupted")
    session.import_mesh(two_tets())
    command = [*COMMAND, "--target", daemon.target, "watch", "interrupted"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline().startswith("revision")
        process.send_signal(signal.SIGINT)
        assert process.wait(20) == 0 and process.stderr.read() == ""
    session.delete()


def test_serve_becomes_the_daemon(tmp_path):
    socket, ready = tmp_path / "socket", tmp_path / "ready"
    command = [*COMMAND, "serve", "--listen=", f"--unix_socket={socket}", f"--ready_file={ready}"]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        try:
            with dynmesh.connect(f"unix:{socket}", retries=1000) as client:  # until somebody answers
                assert list(client.sessions()) == []
        finally:
            process.send_signal(signal.SIGTERM)
            assert process.wait(20) == 0


def test_output_that_nobody_reads_is_no_error(daemon, client):
    command = [*COMMAND, "--target", daemon.target, "ls"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        process.stdout.close()
        assert process.wait(30) == 0 and process.stderr.read() == ""


def test_the_command_says_by_its_exit_code_whether_something_is_bad(session, run):
    session.import_mesh(bow_tie())
    fine = run("check", session.name, "--json")
    assert fine.returncode == 0, fine.stderr
    record = json.loads(fine.stdout)
    assert record["checks"]["vertex_link"]["findings"]["vertex"] == {"ids": [0], "values": [2.0]}
    assert record["topology"]["surface"]["pieces"] == 2 and record["failed"] == []
    bad = run("check", session.name, "--only", "vertex_link,quality", "--fail-on", "vertex_link")
    assert bad.returncode == 1 and "vertex_link" in bad.stderr and "vertex 0" in bad.stdout
    session.set_checks({"vertex_link": "reject"})
    rejected = run("check", session.name, "--json")
    assert rejected.returncode == 1 and json.loads(rejected.stdout)["failed"] == ["vertex_link"]
    assert "vertex_link: reject" in run("info", session.name).stdout


def test_a_check_that_fails_is_told_from_one_that_finds_something(run):
    assert run("check", "nobody").returncode == 2
    assert json.loads(run("check", "nobody", "--json").stderr)["error"]["reason"] == "SESSION_NOT_FOUND"
    assert run("check", "nobody", target="unix:/nonexistent/socket").returncode == 2
    told = run("check", "--help").stdout
    assert "Exit code: 0 if nothing is bad" in " ".join(told.split())


def test_checks_of_batches_are_set_by_name(session, run):
    session.import_mesh(two_tets())
    told = json.loads(run("set-checks", session.name, "inverted=reject", "min_dihedral=warn:5", "--json").stdout)
    assert told["checks"].keys() == {"inverted", "min_dihedral"}
    assert session.info().checks["min_dihedral"] == ("warn", 5.0)
    assert run("set-checks", session.name, "none").returncode == 0
    assert session.info().checks == {}


def test_batches_tell_what_the_checks_warn_of(session, run):
    session.import_mesh(two_tets())
    assert run("set-checks", session.name, "quality=warn:0.95").returncode == 0
    told = run("split", session.name, "--ends", 1, 2, "--json")
    (warning,) = json.loads(told.stdout)["warnings"]
    assert (warning["check"], warning["reason"], warning["kind"]) == ("quality", "CHECK_FAILED", "cell")
    assert (warning["count"], warning["threshold"], len(warning["ids"])) == (4, 0.95, 4)
    assert told.stderr.startswith("dynmesh: warning: quality") and told.stderr.count("\n") == 1
    first = f"{warning['ids'][0]} ({warning['values'][0]:.4g}), "
    for command in (("smooth", "--move-boundary"), ("collapse", "--ends", 1, 5, "--dry-run")):
        name, *options = command
        shown = run(name, session.name, *options)
        assert shown.returncode == 0 and shown.stderr.startswith("dynmesh: warning: quality"), shown.stderr
        assert " cell(s)): " in shown.stderr and shown.stderr.count("\n") == 1
    assert first in told.stderr
    session.set_checks({})
    quiet = run("smooth", session.name, "--json")
    assert (quiet.stderr, json.loads(quiet.stdout)["warnings"]) == ("", [])


def test_merge_welds_pairs_of_vertices(session, run):
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [5, 0, 0], [6, 0, 0], [5, 1, 0]], dtype=float)
    session.import_mesh(points, {"triangle": [[0, 1, 2], [3, 4, 5]]})
    told = json.loads(run("merge", session.name, 1, 3, "--json").stdout)
    assert (told["revision"], told["counts"]["vertices"]) == (2, 5)
    refused = run("merge", session.name, 0, 1)
    assert refused.returncode == 1 and "[EDGE_EXISTS]" in refused.stderr


def test_changes_of_all_of_a_session_take_a_revision(session, run):
    session.import_mesh(two_tets())
    with session.edit() as tx:
        tx.add_vertices([[9, 9, 9]])
    late = ("--if-revision", 1)
    for command in (("undo", session.name), ("redo", session.name), ("repair", session.name, "--remove-isolated")):
        refused = run(*command, *late)
        assert refused.returncode == 1 and "[REVISION_MISMATCH]" in refused.stderr
    assert session.revision == 2
    assert run("undo", session.name, "--if-revision", 2).returncode == 0
    assert run("redo", session.name, "--if-revision", 3).returncode == 0
    assert run("repair", session.name, "--remove-isolated", "--if-revision", 4).returncode == 0
    assert session.revision == 5 and session.counts.vertices == 5


def test_the_command_refuses_checks_that_it_does_not_know(session, run):
    assert run("check", session.name, "--only", "no_such").returncode == 2
    assert run("check", session.name, "--only", "quality", "--fail-on", "genus").returncode == 2
