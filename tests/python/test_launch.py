"""A daemon of one's own: where it is found, how it ends, and what is said when it does not start."""

import os
import select
import signal
import stat
import subprocess
import sys
import textwrap
from concurrent.futures import ThreadPoolExecutor

import dynmesh
import pytest
from dynmesh.daemon import find_daemon


def script(path, body: str):
    """An executable stand-in for dynmeshd."""
    path.write_text("#!/bin/sh\n" + textwrap.dedent(body))
    path.chmod(0o755)
    return path


def test_it_serves_in_a_private_directory_that_goes_with_it():
    with dynmesh.launch() as daemon:
        assert daemon.running and daemon.target.startswith("unix:/")
        directory = os.path.dirname(daemon.target.removeprefix("unix:"))
        assert stat.S_IMODE(os.stat(directory).st_mode) == 0o700
        assert list(daemon.client.sessions()) == []
    assert not daemon.running and not os.path.exists(directory)
    daemon.close()


def test_it_can_serve_at_a_port_as_well():
    with dynmesh.launch(listen="127.0.0.1:0") as daemon:
        address = next(a for a in daemon.addresses if a.startswith("127.0.0.1:"))
        with dynmesh.connect(address) as client:
            client.create_session("a")
        assert [info.name for info in daemon.client.sessions()] == ["a"]


def test_two_daemons_are_two():
    with dynmesh.launch() as one, dynmesh.launch() as other:
        one.client.create_session("a")
        assert list(other.client.sessions()) == []


def test_a_daemon_that_dies_is_reported_with_the_end_of_its_log(tmp_path):
    binary = script(tmp_path / "dynmeshd", "echo no such luck >&2; exit 3")
    with pytest.raises(dynmesh.LaunchError, match=r"status 3(?s:.*)no such luck"):
        dynmesh.launch(binary)


def test_a_flag_that_it_does_not_know_is_in_the_message():
    with pytest.raises(dynmesh.LaunchError, match="no_such_flag"):
        dynmesh.launch(flags=["--no_such_flag"])


def test_a_daemon_that_never_serves_is_given_up(tmp_path):
    binary = script(tmp_path / "dynmeshd", "exec sleep 60")
    with pytest.raises(dynmesh.LaunchError, match="not ready within"):
        dynmesh.launch(binary, timeout=0.2)


def test_a_daemon_that_ignores_sigterm_is_killed(tmp_path):
    binary = script(
        tmp_path / "dynmeshd",
        """
        trap '' TERM
        for flag; do case $flag in --ready_file=*) echo unix:x > ${flag#--ready_file=};; esac; done
        while :; do sleep 1; done
        """,
    )
    daemon = dynmesh.launch(binary, grace=0.1)
    daemon.close()
    assert not daemon.running


def test_what_is_not_there_is_said_so(tmp_path, monkeypatch):
    with pytest.raises(dynmesh.LaunchError, match="nowhere"):
        dynmesh.launch(tmp_path / "nowhere")
    monkeypatch.setenv("DYNMESHD", str(script(tmp_path / "mine", "exit 0")))
    assert find_daemon() == str(tmp_path / "mine")


def test_a_killed_daemon_makes_calls_unavailable():
    with dynmesh.launch() as daemon:
        session = daemon.client.create_session("a")
        os.kill(daemon.pid, signal.SIGKILL)
        with pytest.raises(dynmesh.UnavailableError):
            session.info()


def test_it_outlives_the_thread_that_launched_it():
    with ThreadPoolExecutor() as threads:
        daemon = threads.submit(dynmesh.launch).result(60)
    with daemon:
        assert list(daemon.client.sessions()) == []


def test_it_ends_with_the_process_that_launched_it(tmp_path):
    code = "import dynmesh, os; d = dynmesh.launch(); print(d.pid, flush=True); os.kill(os.getpid(), 9)"
    environment = {**os.environ, "TMPDIR": str(tmp_path)}  # whoever is killed leaves its directory behind
    run = subprocess.run(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, check=False, timeout=60, env=environment
    )
    pid = int(run.stdout)
    assert run.returncode == -signal.SIGKILL
    wait_until_gone(pid)


def test_it_ends_when_nobody_closes_it():
    code = "import dynmesh; d = dynmesh.launch(); print(d.pid)"
    run = subprocess.run([sys.executable, "-c", code], stdout=subprocess.PIPE, check=True, timeout=60)
    wait_until_gone(int(run.stdout))


def wait_until_gone(pid: int) -> None:
    """Waits for a process that is nobody's child here."""
    try:
        fd = os.pidfd_open(pid)
    except ProcessLookupError:
        return
    poll = select.poll()
    poll.register(fd, select.POLLIN)
    assert poll.poll(20_000), f"process {pid} is still there"
    os.close(fd)
