"""Where the mesh comes from: the demo's own plate through gmsh, or any file that meshio reads."""

from __future__ import annotations

import re
import subprocess
import warnings
from pathlib import Path

import meshio
import numpy as np
from dynmesh import ElementType
from dynmesh.files import read_mesh

from .region import Region, hole_region

_PLATE = Path(__file__).parent.parent / "plate_with_hole.geo"
_NUMBERS = {"hole_x": 3.0, "hole_y": 3.0, "thickness": 0.6, "radius": 0.8}
_TRAVEL = 5.5
_NODES = {t.meshio_name: t.num_vertices for t in ElementType}


def mesh_plate(directory: Path) -> Path:
    """Lets gmsh mesh the plate; returns the file."""
    path = directory / "plate_with_hole.msh"
    numbers = [word for name, value in _NUMBERS.items() for word in ("-setnumber", name, str(value))]
    command = ["gmsh", "-3", str(_PLATE), "-o", str(path), "-v", "2", *numbers]
    subprocess.run(command, check=True, stdin=subprocess.DEVNULL)
    return path


def plate_region() -> Region:
    """The hole of the plate."""
    centre = np.array([_NUMBERS["hole_x"], _NUMBERS["hole_y"], _NUMBERS["thickness"]])
    return hole_region(centre, _NUMBERS["radius"], _TRAVEL)


def load(path: Path) -> tuple[meshio.Mesh, list[str]]:
    """The points and cells of a file, and what had to be left out, for humans.

    Cells with nodes on their edges keep their corners only; cells that dynmesh does not know are left out.
    Raises `dynmesh.FileFormatError` and `OSError`.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        mesh = read_mesh(path)
    cells, notes = [], []
    for block in mesh.cells:
        name = re.sub(r"\d+$", "", block.type)
        if name in _NODES and name == block.type:
            cells.append((name, block.data))
        elif name in _NODES:
            notes.append(f"{len(block.data)} {block.type} cells became {name}")
            cells.append((name, np.asarray(block.data)[:, : _NODES[name]]))
        elif name != "vertex":
            notes.append(f"{len(block.data)} {block.type} cells are left out")
    return meshio.Mesh(mesh.points, cells), notes
