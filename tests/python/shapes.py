"""Small meshes, made by hand."""

from __future__ import annotations

import meshio
import numpy as np

# Faces of each type by local vertices: an oracle that shares nothing with core/mesh/element_type.cc.
FACES = {
    "line": [],
    "triangle": [(0, 1, 2)],
    "quad": [(0, 1, 2, 3)],
    "tetra": [(0, 1, 3), (1, 2, 3), (2, 0, 3), (0, 2, 1)],
    "pyramid": [(0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)],
    "wedge": [(0, 1, 2), (3, 5, 4), (0, 3, 4, 1), (1, 4, 5, 2), (2, 5, 3, 0)],
    "hexahedron": [(0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4), (3, 7, 6, 2), (0, 3, 2, 1), (4, 5, 6, 7)],
}

TET = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)


def two_tets() -> meshio.Mesh:
    """Two tetrahedra that share a face."""
    points = np.vstack([TET, [[1, 1, 1]]])
    return meshio.Mesh(points, [("tetra", [[0, 1, 2, 3], [1, 2, 3, 4]])])


def bow_tie() -> meshio.Mesh:
    """Two triangles that share just vertex 0."""
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [-1, 0, 0], [-1, -1, 0]], dtype=float)
    return meshio.Mesh(points, [("triangle", [[0, 1, 2], [0, 3, 4]])])


def zoo() -> meshio.Mesh:
    """Every type of element, in meshio's node order.

    A hexahedron with a pyramid, a prism and a tetrahedron on it; a dangling quad and triangle, two wire edges
    and an isolated vertex; a duplicate triangle and a degenerate one.
    """
    points = np.array(
        [
            [0, 0, 0],
            [1, 0, 0],
            [1, 1, 0],
            [0, 1, 0],
            [0, 0, 1],
            [1, 0, 1],
            [1, 1, 1],
            [0, 1, 1],
            [0.5, 0.5, 2],
            [2, 0, 0.5],
            [2, 1, 0.5],
            [3, 0, 0],
            [3, 1, 0],
            [4, 0, 0.1],
            [9, 9, 9],
        ],
        dtype=float,
    )
    cells = [
        ("hexahedron", [[0, 1, 2, 3, 4, 5, 6, 7]]),
        ("pyramid", [[4, 5, 6, 7, 8]]),
        ("wedge", [[1, 5, 9, 2, 6, 10]]),
        ("tetra", [[5, 4, 8, 9]]),
        ("quad", [[9, 11, 12, 10]]),
        ("triangle", [[11, 13, 12], [12, 11, 13], [0, 0, 1]]),
        ("line", [[13, 12], [13, 8]]),
    ]
    return meshio.Mesh(points, cells)


def grid_tets(n: int) -> meshio.Mesh:
    """n^3 cubes of six tetrahedra each."""
    axis = np.arange(n + 1)
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3) / n
    corner = np.stack(np.meshgrid(*[np.arange(n)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    base = corner @ [(n + 1) ** 2, n + 1, 1]
    step = {"x": (n + 1) ** 2, "y": n + 1, "z": 1}
    paths = ["xyz", "xzy", "yxz", "yzx", "zxy", "zyx"]
    rows = []
    for path in paths:
        a, b = step[path[0]], step[path[0]] + step[path[1]]
        rows.append(np.stack([base, base + a, base + b, base + sum(step.values())], axis=1))
    return meshio.Mesh(points, [("tetra", np.stack(rows, axis=1).reshape(-1, 4))])
