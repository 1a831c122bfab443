"""Builds what cannot be committed: the generated messages and, where its libraries are, the native module.

Everything static is in pyproject.toml. The dependencies are not: generated code works with the protobuf and
grpcio that it was generated for and newer ones, so they are bounded by the generator that this build uses.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from importlib.metadata import requires, version
from pathlib import Path

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext
from setuptools.command.build_py import build_py

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
PROTOS = ("types", "sessions", "edits", "queries", "subscriptions")
CORE = ("core/mesh", "core/delta", "core/codec")
STAGE = Path("build/native")
LIBRARIES = (
    "draco",
    "libzstd",
    "libxxhash",
    "absl_cord",
    "absl_flat_hash_map",
    "absl_flat_hash_set",
    "absl_span",
    "absl_status",
    "absl_statusor",
    "absl_strings",
)
STATIC_DEPENDENCIES = ["numpy>=1.23", "meshio>=5.0", "tqdm>=4.60"]


def dependencies() -> list[str]:
    """What the generated code of this build needs, and the rest."""
    protobuf = next(r for r in requires("grpcio-tools") or () if r.startswith("protobuf"))
    oldest = re.search(r">=\s*([0-9.]+)", protobuf).group(1).removesuffix(".dev")
    major = int(oldest.split(".")[0])
    # From 5 on protobuf promises that generated code runs with its own and the next major version.
    bound = f"protobuf>={oldest},<{major + 2}" if major >= 5 else f"protobuf>={oldest}"
    return [f"grpcio>={version('grpcio-tools')}", bound, *STATIC_DEPENDENCIES]


def generate(destination: Path) -> None:
    """Writes the messages and stubs of package dynmesh.v1 below `destination`."""
    from grpc_tools import protoc

    well_known = Path(protoc.__file__).parent / "_proto"
    outputs = [f"--{kind}_out={destination}" for kind in ("python", "pyi", "grpc_python")]
    sources = [str(ROOT / "proto/dynmesh/v1" / f"{name}.proto") for name in PROTOS]
    arguments = ["protoc", f"--proto_path={ROOT / 'proto'}", f"--proto_path={well_known}", *outputs, *sources]
    if protoc.main(arguments) != 0:
        sys.exit("setup.py: protoc failed")


def pkg_config(option: str) -> list[str] | None:
    """What pkg-config says of all libraries; None if it or one of them is not there."""
    if not shutil.which("pkg-config"):
        return None
    run = subprocess.run(["pkg-config", option, *LIBRARIES], capture_output=True, text=True, check=False)
    return run.stdout.split() if run.returncode == 0 else None


def native_module() -> Extension | None:
    """dynmesh._native, or None where Draco, zstd, xxHash or Abseil have no headers."""
    flags, links = pkg_config("--cflags"), pkg_config("--libs")
    if flags is None or links is None:
        print("setup.py: no native module: not all of these are installed:", *LIBRARIES, file=sys.stderr)
        return None
    import pybind11

    core = [
        STAGE / path.relative_to(ROOT) for folder in CORE for path in sorted((ROOT / folder).glob("*.cc"))
    ]
    return Extension(
        "dynmesh._native",
        sources=["src/native/native.cc", *map(str, core)],
        include_dirs=[str(STAGE), pybind11.get_include()],
        extra_compile_args=["-std=c++20", "-O2", "-fvisibility=hidden", *flags],
        extra_link_args=links,
        language="c++",
        optional=True,  # a library of another age may not compile: then there is no native module
    )


class BuildNative(build_ext):
    """Copies core/ below here first, because setuptools puts objects where sources are."""

    def run(self) -> None:
        for folder in CORE if self.extensions else ():
            shutil.copytree(ROOT / folder, HERE / STAGE / folder, dirs_exist_ok=True)
        super().run()


class BuildPython(build_py):
    """Also generates the messages."""

    def run(self) -> None:
        super().run()
        generate(HERE / "src" if self.editable_mode else Path(self.build_lib))


native = native_module()
setup(
    install_requires=dependencies(),
    ext_modules=[native] if native else [],
    cmdclass={"build_py": BuildPython, "build_ext": BuildNative},
)
