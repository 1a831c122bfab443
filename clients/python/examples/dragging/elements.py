"""Shapes of elements in numpy: whether they are inverted, how large they are, and their faces.

Everything here takes cells in *positive* order: seen from inside, the vertices of each face run against the
clock. That is VTK's order but for wedges, whose triangle 0 1 2 looks outward there. `FLIPPED` turns over.
"""

from __future__ import annotations

import numpy as np
from dynmesh import ElementType
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Ids = NDArray[np.uint32]

TETRAHEDRON, TRIANGLE, QUAD = ElementType.TETRAHEDRON, ElementType.TRIANGLE, ElementType.QUAD
PYRAMID, PRISM, HEXAHEDRON = ElementType.PYRAMID, ElementType.PRISM, ElementType.HEXAHEDRON

# Faces of cells, edges of triangles and quads: each with a point inside makes a positive element.
FACES: dict[ElementType, tuple[tuple[int, ...], ...]] = {
    TRIANGLE: ((0, 1), (1, 2), (2, 0)),
    QUAD: ((0, 1), (1, 2), (2, 3), (3, 0)),
    TETRAHEDRON: ((0, 1, 2), (0, 3, 1), (0, 2, 3), (1, 3, 2)),
    PYRAMID: ((0, 1, 2, 3), (0, 4, 1), (1, 4, 2), (2, 4, 3), (3, 4, 0)),
    PRISM: ((0, 1, 2), (3, 5, 4), (0, 3, 4, 1), (1, 4, 5, 2), (2, 5, 3, 0)),
    HEXAHEDRON: ((0, 1, 2, 3), (4, 7, 6, 5), (0, 3, 7, 4), (1, 5, 6, 2), (0, 4, 5, 1), (3, 2, 6, 7)),
}

# The same element, turned over.
FLIPPED: dict[ElementType, tuple[int, ...]] = {
    TRIANGLE: (1, 0, 2),
    QUAD: (3, 2, 1, 0),
    TETRAHEDRON: (1, 0, 2, 3),
    PYRAMID: (3, 2, 1, 0, 4),
    PRISM: (0, 2, 1, 3, 5, 4),
    HEXAHEDRON: (3, 2, 1, 0, 7, 6, 5, 4),
}

# A vertex and its neighbours, counter-clockwise seen from inside: one row for each corner that is looked at.
_CORNERS: dict[ElementType, Ints] = {
    TRIANGLE: np.array([(0, 1, 2), (1, 2, 0), (2, 0, 1)]),
    QUAD: np.array([(0, 1, 3), (1, 2, 0), (2, 3, 1), (3, 0, 2)]),
    TETRAHEDRON: np.array([(0, 1, 2, 3), (1, 2, 0, 3), (2, 0, 1, 3), (3, 1, 0, 2)]),
    PYRAMID: np.array([(0, 1, 3, 4), (1, 2, 0, 4), (2, 3, 1, 4), (3, 0, 2, 4)]),
    PRISM: np.array([(0, 1, 2, 3), (1, 2, 0, 4), (2, 0, 1, 5), (3, 5, 4, 0), (4, 3, 5, 1), (5, 4, 3, 2)]),
    HEXAHEDRON: np.array(
        [(0, 1, 3, 4), (1, 2, 0, 5), (2, 3, 1, 6), (3, 0, 2, 7),
         (4, 7, 5, 0), (5, 4, 6, 1), (6, 5, 7, 2), (7, 6, 4, 3)]
    ),
}


def is_cell(of_type: ElementType) -> bool:
    """Whether elements of this type have a volume."""
    return of_type >= TETRAHEDRON


def qualities(of_type: ElementType, corners: Floats, normals: Floats | None = None) -> Floats:
    """How far elements are from being inverted: float64[...]; not positive where they are.

    The smallest corner counts: for cells the determinant of its three unit edges, for triangles and quads the
    sine of its angle, seen against `normals`.

    Parameters
    ----------
    corners : float64[..., k, 3]
    normals : float64[..., 3], optional
        Unit normals; default: each element's own, so that none counts as inverted.
    """
    table = _CORNERS[of_type]
    edges = corners[..., table[:, 1:], :] - corners[..., table[:, :1], :]
    lengths = np.sqrt(np.einsum("...i,...i->...", edges, edges)).prod(axis=-1)
    if not is_cell(of_type):
        third = own_normals(corners) if normals is None else normals
        volumes = determinants(edges[..., 0, :], edges[..., 1, :], third[..., None, :])
    else:
        volumes = determinants(edges[..., 0, :], edges[..., 1, :], edges[..., 2, :])
    return np.divide(volumes, lengths, out=np.zeros_like(volumes), where=lengths > 0).min(axis=-1)


def sizes(of_type: ElementType, corners: Floats) -> Floats:
    """Signed volumes of cells, areas of triangles and quads: float64[...]. Faces of four vertices count as
    four triangles round their centre.

    Parameters
    ----------
    corners : float64[..., k, 3]
    """
    centre = corners.mean(axis=-2)
    if not is_cell(of_type):
        parts = [corners[..., list(edge), :] for edge in FACES[of_type]]
        return sum(triangle_areas(part[..., 0, :], part[..., 1, :], centre) for part in parts)
    if of_type == TETRAHEDRON:
        return tetrahedron_volumes(*(corners[..., i, :] for i in range(4)))
    return sum(_cone_volume(corners[..., list(face), :], centre) for face in FACES[of_type])


def tetrahedron_volumes(a: Floats, b: Floats, c: Floats, d: Floats) -> Floats:
    """Signed volumes, float64[...], of tetrahedra with these corners, float64[..., 3] each."""
    return determinants(b - a, c - a, d - a) / 6


def triangle_areas(a: Floats, b: Floats, c: Floats) -> Floats:
    """Areas, float64[...], of triangles with these corners, float64[..., 3] each."""
    return np.linalg.norm(np.cross(b - a, c - a), axis=-1) / 2


def own_normals(corners: Floats) -> Floats:
    """Unit normals, float64[..., 3], of triangles and quads; zero for those without area."""
    normals = np.cross(corners[..., 1, :] - corners[..., 0, :], corners[..., -1, :] - corners[..., 0, :])
    lengths = np.linalg.norm(normals, axis=-1, keepdims=True)
    return np.divide(normals, lengths, out=np.zeros_like(normals), where=lengths > 0)


def _cone_volume(face: Floats, apex: Floats) -> Floats:
    centre = face.mean(axis=-2)
    pairs = [(face[..., i, :], face[..., (i + 1) % face.shape[-2], :]) for i in range(face.shape[-2])]
    return sum(tetrahedron_volumes(a, b, centre, apex) for a, b in pairs)


def determinants(a: Floats, b: Floats, c: Floats) -> Floats:
    """Of three vectors each: float64[...] of float64[..., 3]. On few vectors faster than numpy's cross."""
    a0, a1, a2 = a[..., 0], a[..., 1], a[..., 2]
    b0, b1, b2 = b[..., 0], b[..., 1], b[..., 2]
    c0, c1, c2 = c[..., 0], c[..., 1], c[..., 2]
    return (a1 * b2 - a2 * b1) * c0 + (a2 * b0 - a0 * b2) * c1 + (a0 * b1 - a1 * b0) * c2
