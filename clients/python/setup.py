"""Builds what cannot be committed: the generated messages and, where its libraries are, the native module.

Everything static is in pyproject.toml. The dependencies are not: generated code works with the protobuf and
grpcio that it was generated for and newer ones, so they are bounded by the generator that this build uses.

What is generated and compiled lies outside of this folder in a checkout, and in vendor/ in a source
distribution, which is thereby complete.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext
from setuptools.command.build_py import build_py
from setuptools.command.sdist import sdist

HERE = Path(__file__).resolve().parent
VENDOR = "vendor"
ROOT = HERE / VENDOR if (HERE / VENDOR).is_dir() else HERE.parent.parent
PROTOS = (
    "types", "sessions", "edits", "history", "adapt", "backups", "queries", "checks", "repairs", "subscriptions"
)
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
    try:
        return [*_generator_bounds(), *STATIC_DEPENDENCIES]
    except PackageNotFoundError:  # a distribution's own generator, which goes with the packages beside it
        return ["grpcio>=1.51", "protobuf>=4.21", *STATIC_DEPENDENCIES]


def _generator_bounds() -> list[str]:
    protobuf = next(r for r in requires("grpcio-tools") or () if r.startswith("protobuf"))
    oldest = re.search(r">=\s*([0-9.]+)", protobuf).group(1).removesuffix(".dev")
    major = int(oldest.split(".")[0])
    # From 5 on protobuf promises that generated code runs with its own and the next major version.
    bound = f"protobuf>={oldest},<{major + 2}" if major >= 5 else f"protobuf>={oldest}"
    return [f"grpcio>={version('grpcio-tools')}", bound]


def generate(destination: Path) -> None:
    """Writes the messages and stubs of package dynmesh.v1 below `destination`."""
    sources = [ROOT / "proto/dynmesh/v1" / f"{name}.proto" for name in PROTOS]
    if not all(source.is_file() for source in sources):
        sys.exit(
            f"setup.py: no .proto files in {ROOT / 'proto'}: this folder can be built inside a checkout of dynmesh, "
            "or from a source distribution, which has them in vendor/"
        )
    outputs = [f"--{kind}_out={destination}" for kind in ("python", "pyi", "grpc_python")]
    if _protoc([f"--proto_path={ROOT / 'proto'}", *outputs, *map(str, sources)]) != 0:
        sys.exit("setup.py: protoc failed")


def _protoc(arguments: list[str]) -> int:
    """Runs the generator of grpcio-tools, or that of the distribution."""
    try:
        from grpc_tools import protoc
    except ImportError:
        plugin = shutil.which("grpc_python_plugin")
        if not plugin or not shutil.which("protoc"):
            sys.exit("setup.py: needs grpcio-tools, or protoc and grpc_python_plugin")
        return subprocess.run(["protoc", f"--plugin=protoc-gen-grpc_python={plugin}", *arguments]).returncode
    well_known = Path(protoc.__file__).parent / "_proto"
    return protoc.main(["protoc", f"--proto_path={well_known}", *arguments])


def pkg_config(option: str) -> list[str] | None:
    """What pkg-config says of all libraries; None if it or one of them is not there."""
    if not shutil.which("pkg-config"):
        return None
    run = subprocess.run(["pkg-config", option, *LIBRARIES], capture_output=True, text=True, check=False)
    return run.stdout.split() if run.returncode == 0 else None


def native_module() -> Extension | None:
    """dynmesh._native, or None without core/ or where Draco, zstd, xxHash or Abseil have no headers."""
    if not all((ROOT / folder).is_dir() for folder in CORE):
        print(f"setup.py: no native module: no core/ in {ROOT}", file=sys.stderr)
        return None
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


class CompleteSdist(sdist):
    """Also takes what lies outside of this folder."""

    def make_release_tree(self, base_dir: str, files: list[str]) -> None:
        super().make_release_tree(base_dir, files)
        for home in (HERE, ROOT):
            if (home / "LICENSE").is_file():
                self.copy_file(str(home / "LICENSE"), str(Path(base_dir) / "LICENSE"))
        patterns = {"proto/dynmesh/v1": ["*.proto"], **{folder: ["*.cc", "*.h"] for folder in CORE}}
        for folder, wanted in patterns.items():
            target = Path(base_dir) / VENDOR / folder
            target.mkdir(parents=True, exist_ok=True)
            for path in (p for pattern in wanted for p in sorted((ROOT / folder).glob(pattern))):
                self.copy_file(str(path), str(target / path.name))


native = native_module()
setup(
    license="Apache-2.0",  # here, because the form in pyproject.toml differs between the ages of setuptools
    install_requires=dependencies(),
    ext_modules=[native] if native else [],
    cmdclass={"build_py": BuildPython, "build_ext": BuildNative, "sdist": CompleteSdist},
)
