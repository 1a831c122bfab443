"""Mesh files, read and written by meshio."""

from __future__ import annotations

import contextlib
import io
import os
import re
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from .errors import FileFormatError

if TYPE_CHECKING:
    import meshio

PathLike = str | os.PathLike[str]

# How meshio's writers say that a format does not hold some of the cells.
_LEFT_OUT = re.compile("skipping|discarding", re.IGNORECASE)


def read_mesh(path: PathLike, file_format: str | None = None) -> meshio.Mesh:
    """The mesh in a file. Raises `FileFormatError`, or `OSError` when it cannot be opened."""
    import meshio

    if not Path(path).exists():
        raise FileNotFoundError(f"no such file: {path}")
    printed = io.StringIO()  # meshio prints why a reader gave up, and exits when the last one did
    try:
        with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(printed):
            return meshio.read(path, file_format)
    except OSError:
        raise
    except (Exception, SystemExit) as error:  # readers raise whatever their parsing runs into
        said = " ".join(printed.getvalue().split())
        why = said if isinstance(error, SystemExit) else f"{type(error).__name__}: {error}"
        raise FileFormatError(f"cannot read {path}: {why}", reason="BAD_FILE") from None


def write_mesh(path: PathLike, mesh: meshio.Mesh, file_format: str | None = None) -> None:
    """Writes `mesh` to a file; one that was there stays as it is unless the new one is whole.

    Raises `FileFormatError` when the format cannot hold all elements of `mesh`, or `OSError` when the file
    cannot be written.
    """
    target = Path(path)
    if not target.parent.is_dir():
        raise FileNotFoundError(f"no such folder: {target.parent}")
    with tempfile.TemporaryDirectory(prefix=f".{target.name}.", dir=target.parent) as folder:
        draft = Path(folder) / target.name
        _write_draft(draft, target, mesh, file_format)
        for part in Path(folder).iterdir():  # some formats write a second file beside the first
            os.replace(part, target.parent / part.name)


def _write_draft(draft: Path, target: Path, mesh: meshio.Mesh, file_format: str | None) -> None:
    import meshio

    printed = io.StringIO()  # meshio prints what a format leaves out
    try:
        with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(printed):
            meshio.write(draft, mesh, file_format)
    except OSError:
        raise
    except Exception as error:  # writers raise whatever their format forbids
        why = f"{type(error).__name__}: {error}"
        raise FileFormatError(f"the format of {target.name} cannot hold this mesh ({why})", reason="BAD_FILE") from error
    said = " ".join(printed.getvalue().split())
    if _LEFT_OUT.search(said):
        raise FileFormatError(f"the format of {target.name} cannot hold this mesh ({said})", reason="BAD_FILE")
