#!/usr/bin/env python3
"""Writes a mesh file that meshio reads as the arrays that the benchmarks load.

usage: to_arrays.py MESH FOLDER

FOLDER gets points.f64 and one of tetra.u32, hexahedron.u32, triangle.u32: little-endian rows, VTK node order.
"""
import pathlib
import sys

import meshio
import numpy

KINDS = ("tetra", "hexahedron", "triangle")


def main(path, folder):
    mesh = meshio.read(path)
    kinds = {block.type for block in mesh.cells}
    if len(kinds) != 1 or not kinds <= set(KINDS):
        sys.exit(f"{path}: elements are {sorted(kinds)}, wanted is one of {', '.join(KINDS)}")
    cells = numpy.concatenate([block.data for block in mesh.cells])
    if cells.min() < 0 or cells.max() >= len(mesh.points) or mesh.points.shape[1] != 3:
        sys.exit(f"{path}: not a mesh of points in space")
    folder = pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    numpy.asarray(mesh.points, "<f8").tofile(folder / "points.f64")
    numpy.asarray(cells, "<u4").tofile(folder / f"{kinds.pop()}.u32")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
