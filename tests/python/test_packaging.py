"""A source distribution is complete: built, unpacked, made a wheel, and used, far from any checkout.

With Debian's packages and without a download. The native module is left out, because compiling it takes minutes;
its sources are looked for.
"""

import os
import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
NO_LIBRARIES = {**os.environ, "PKG_CONFIG_LIBDIR": "/nonexistent", "PKG_CONFIG_PATH": ""}


def copy_client(target: Path) -> Path:
    ignore = shutil.ignore_patterns("build", "*.egg-info", "__pycache__", "*_pb2*", "*.so")
    return Path(shutil.copytree(ROOT / "clients/python", target, ignore=ignore))


def run_setup(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "setup.py", "-q", *arguments]
    return subprocess.run(command, cwd=folder, env=NO_LIBRARIES, capture_output=True, text=True, check=False)


@pytest.fixture(scope="module")
def unpacked(tmp_path_factory):
    """A source distribution of a checkout, unpacked."""
    checkout = tmp_path_factory.mktemp("checkout")
    client = copy_client(checkout / "clients/python")
    for folder in ("proto", "core"):
        shutil.copytree(ROOT / folder, checkout / folder)
    shutil.copy(ROOT / "LICENSE", checkout)
    made = run_setup(client, "sdist", "-d", str(checkout / "dist"))
    assert made.returncode == 0, made.stderr
    target = tmp_path_factory.mktemp("elsewhere")
    with tarfile.open(next((checkout / "dist").glob("*.tar.gz"))) as archive:
        archive.extractall(target)
    return next(target.iterdir())


def test_it_holds_all_that_the_native_module_is_made_of(unpacked):
    held = {str(path.relative_to(unpacked / "vendor")) for path in (unpacked / "vendor").rglob("*.*")}
    wanted = [*(ROOT / "proto/dynmesh/v1").glob("*.proto")]
    for folder in ("core/mesh", "core/delta", "core/codec"):
        wanted += [*(ROOT / folder).glob("*.cc"), *(ROOT / folder).glob("*.h")]
    assert held == {str(path.relative_to(ROOT)) for path in wanted}
    assert (unpacked / "src/native/native.cc").is_file() and (unpacked / "LICENSE").is_file()


def test_a_source_distribution_of_one_is_the_same(unpacked, tmp_path):
    made = run_setup(unpacked, "sdist", "-d", str(tmp_path))
    assert made.returncode == 0, made.stderr
    with tarfile.open(next(tmp_path.glob("*.tar.gz"))) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    assert {"vendor/proto/dynmesh/v1/types.proto", "vendor/core/mesh/mesh.h", "LICENSE"} <= names


def test_a_wheel_of_it_follows_a_session(unpacked, tmp_path, daemon, session):
    made = run_setup(unpacked, "bdist_wheel", "-d", str(tmp_path))
    assert made.returncode == 0, made.stderr
    with zipfile.ZipFile(next(tmp_path.glob("*.whl"))) as wheel:
        wheel.extractall(tmp_path / "site")
    with session.edit() as tx:
        tx.add_vertices([[0, 0, 0]])
    script = f"""
import sys
sys.path.insert(0, {str(tmp_path / "site")!r})
import dynmesh
assert dynmesh.__file__.startswith({str(tmp_path)!r}), dynmesh.__file__
assert not dynmesh.delta.HAS_NATIVE
with dynmesh.connect({daemon.target!r}) as client, client.session({session.name!r}).mirror() as mirror:
    print(mirror.wait(1, 30), mirror.num_vertices)
"""
    ran = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert (ran.stdout.split(), ran.returncode) == (["1", "1"], 0), ran.stderr


def test_without_the_messages_it_is_said_what_is_missing(tmp_path):
    client = copy_client(tmp_path / "alone")
    made = run_setup(client, "bdist_wheel", "-d", str(tmp_path))
    assert made.returncode != 0 and "no .proto files" in made.stderr, made.stderr
    assert "source distribution" in made.stderr
