"""Mesh files, read and written by meshio."""

from __future__ import annotations

import contextlib
import io
import os
from pathlib import Path
from typing import TYPE_CHECKING

from .errors import FileFormatError

if TYPE_CHECKING:
    import meshio

PathLike = str | os.PathLike[str]


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
    """Writes `mesh` to a file. Raises `FileFormatError`, or `OSError` when it cannot be written."""
    import meshio

    try:
        meshio.write(path, mesh, file_format)
    except OSError:
        raise
    except Exception as error:  # writers raise whatever their format forbids
        raise FileFormatError(f"cannot write {path}: {error}", reason="BAD_FILE") from error
