"""Entity kinds and element types, as the wire numbers them (proto/dynmesh/v1/types.proto)."""

from __future__ import annotations

import enum

import numpy as np

from .errors import InvalidArgumentError


class EntityKind(enum.IntEnum):
    """Dimension of an entity, plus one: the value of ``dynmesh.v1.EntityKind``."""

    VERTEX = 1
    EDGE = 2
    FACE = 3
    CELL = 4

    @property
    def dimension(self) -> int:
        """0 for vertices to 3 for cells."""
        return self.value - 1

    def __str__(self) -> str:
        return self.name.lower()


class ElementType(enum.IntEnum):
    """Types of elements; nodes are in VTK's order."""

    WIRE_EDGE = 1
    TRIANGLE = 2
    QUAD = 3
    TETRAHEDRON = 4
    PYRAMID = 5
    PRISM = 6
    HEXAHEDRON = 7

    @property
    def kind(self) -> EntityKind:
        """EDGE, FACE or CELL."""
        return _KIND_OF[self]

    @property
    def num_vertices(self) -> int:
        """Vertices of an element."""
        return int(NUM_VERTICES[self])

    @property
    def meshio_name(self) -> str:
        """What meshio calls it: "line", "triangle", "quad", "tetra", "pyramid", "wedge", "hexahedron"."""
        return _MESHIO_NAMES[self - 1]

    def __str__(self) -> str:
        return self.name.lower()


# meshio's wedge has its triangles the other way round than VTK's; the permutation is its own inverse.
WEDGE_OF_MESHIO = np.array([0, 2, 1, 3, 5, 4])

KindLike = EntityKind | str
TypeLike = ElementType | str

# Vertices of an element by type; [0] stands for "no element".
NUM_VERTICES = np.array([0, 2, 3, 4, 4, 5, 6, 8], dtype=np.intp)
ELEMENT_KINDS = (EntityKind.EDGE, EntityKind.FACE, EntityKind.CELL)

_KIND_OF = {
    ElementType.WIRE_EDGE: EntityKind.EDGE,
    ElementType.TRIANGLE: EntityKind.FACE,
    ElementType.QUAD: EntityKind.FACE,
    ElementType.TETRAHEDRON: EntityKind.CELL,
    ElementType.PYRAMID: EntityKind.CELL,
    ElementType.PRISM: EntityKind.CELL,
    ElementType.HEXAHEDRON: EntityKind.CELL,
}
_MESHIO_NAMES = ("line", "triangle", "quad", "tetra", "pyramid", "wedge", "hexahedron")
_TYPES_BY_NAME = {t.meshio_name: t for t in ElementType} | {str(t): t for t in ElementType}
_KINDS_BY_NAME = {str(kind): kind for kind in EntityKind}


def as_kind(kind: KindLike) -> EntityKind:
    """`kind` as `EntityKind`. Accepts "vertex", "edge", "face", "cell". Raises `InvalidArgumentError`."""
    if isinstance(kind, EntityKind):
        return kind
    found = _KINDS_BY_NAME.get(kind) if isinstance(kind, str) else None
    if found is None:
        raise InvalidArgumentError(
            f"an entity kind is one of {', '.join(_KINDS_BY_NAME)}, not {kind!r}", reason="BAD_ENTITY_KIND"
        )
    return found


def as_element_type(name: TypeLike) -> ElementType:
    """`name` as `ElementType`: meshio's names ("tetra", "wedge") and ours ("tetrahedron", "prism").

    Raises `InvalidArgumentError`.
    """
    if isinstance(name, ElementType):
        return name
    found = _TYPES_BY_NAME.get(name) if isinstance(name, str) else None
    if found is None:
        raise InvalidArgumentError(
            f"an element type is one of {', '.join(_MESHIO_NAMES)}, not {name!r}", reason="BAD_ELEMENT_TYPE"
        )
    return found
