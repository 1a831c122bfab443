"""Repairs of pyramids, prisms, hexahedra and quads: one element becomes a fan round its centre.

The faces of the element stay as they are, so its neighbours notice nothing: each face of four vertices
becomes the base of a pyramid, each triangle that of a tetrahedron, each side of a quad a triangle.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from dynmesh import ElementType

from .elements import FACES, PYRAMID, TETRAHEDRON, TRIANGLE, Floats, Ints, is_cell, own_normals, qualities

CENTRE = -1  # stands for the new vertex in the corners of a fan


@dataclass(frozen=True)
class Fan:
    """What takes the place of one element: blocks of (type, corners int64[n, k]), and the new vertex."""

    point: Floats
    blocks: tuple[tuple[ElementType, Ints], ...]


def fan(of_type: ElementType, corners: Ints, points: Floats) -> Fan | None:
    """The fan of an element, or None if one of its parts would be inverted.

    Parameters
    ----------
    corners : int64[k]
        In positive order.
    points : float64[m, 3]
    """
    centre = points[corners].mean(axis=0)
    blocks = []
    for size in sorted({len(face) for face in FACES[of_type]}):
        faces = corners[np.array([face for face in FACES[of_type] if len(face) == size])]
        part = _part(size)
        positions = np.concatenate([points[faces], np.broadcast_to(centre, (len(faces), 1, 3))], axis=1)
        normal = None if is_cell(part) else own_normals(points[corners])
        if qualities(part, positions, normal).min() <= 0:
            return None
        blocks.append((part, np.column_stack([faces, np.full(len(faces), CENTRE)])))
    return Fan(centre, tuple(blocks))


def _part(face_size: int) -> ElementType:
    return {2: TRIANGLE, 3: TETRAHEDRON, 4: PYRAMID}[face_size]
