"""The neighbourhood that moves in one step, as the service describes it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from dynmesh import ElementType, Entities, EntityKind, Session
from numpy.typing import NDArray

from .elements import FLIPPED, Floats, Ids, Ints, is_cell, own_normals, qualities

_FLAT_COSINE = np.cos(np.radians(1))

Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Block:
    """Elements of one type: ids int64[n], ascending, and corners int64[n, k], local and in positive order."""

    of_type: ElementType
    ids: Ints
    corners: Ints

    def corners_of(self, ids: Ints) -> Ints:
        """Of some of the elements: int64[n, k]."""
        return self.corners[np.searchsorted(self.ids, ids)]

    def qualities(self, points: Floats, before: Floats) -> Floats:
        """`elements.qualities` at `points`; faces are held against the normals that they had at `before`."""
        normals = None if is_cell(self.of_type) else own_normals(before[self.corners])
        return qualities(self.of_type, points[self.corners], normals)


@dataclass(frozen=True)
class Patch:
    """Some vertices, all edges and elements at them, and the vertices of those.

    Vertices are numbered locally: i stands for the vertex `vertices[i]`.

    Attributes
    ----------
    revision : int
        Of the session that all of this was read at.
    vertices : int64[m]
        Ascending.
    points : float64[m, 3]
    is_known : bool[m]
        Vertices all of whose elements are in the patch.
    on_surface : bool[m]
        On the boundary of the cells; everything where there are none.
    is_flat : bool[m]
        Of known vertices: all faces of the surface there lie in one plane, and go all round.
    is_pinned : bool[m]
        Of known vertices: a wire is there, or a face that is no side of the cells.
    blocks : tuple of Block
    edges : int64[e, 2]
    edge_on_surface : bool[e]
    """

    revision: int
    vertices: Ints
    points: Floats
    is_known: Mask
    on_surface: Mask
    is_flat: Mask
    is_pinned: Mask
    blocks: tuple[Block, ...]
    edges: Ints
    edge_on_surface: Mask

    @cached_property
    def can_slide(self) -> Mask:
        """bool[m]: vertices that can leave their place without changing the form of the mesh."""
        return self.is_known & (self.is_flat | ~self.on_surface) & ~self.is_pinned & ~self.is_spoilt

    @cached_property
    def is_spoilt(self) -> Mask:
        """bool[m]: vertices of elements that are flat or inverted already."""
        spoilt = np.zeros(len(self.vertices), dtype=bool)
        for block, quality in zip(self.blocks, self.qualities):
            spoilt[block.corners[quality <= 0]] = True
        return spoilt

    @cached_property
    def qualities(self) -> list[Floats]:
        """Of the elements of each block: `elements.qualities`."""
        return [block.qualities(self.points, self.points) for block in self.blocks]

    def lengths(self, points: Floats) -> Floats:
        """Of the edges, with the vertices at `points`: float64[e]."""
        return np.linalg.norm(points[self.edges[:, 1]] - points[self.edges[:, 0]], axis=1)


class PatchReader:
    """Reads patches of one session.

    Parameters
    ----------
    kind : EntityKind or None
        Of its elements: CELL or FACE.
    flipped : frozenset of ElementType
        Types whose vertices are in negative order.
    """

    def __init__(self, session: Session, kind: EntityKind | None, flipped: frozenset[ElementType]) -> None:
        self._session = session
        self._kind = kind
        self._flipped = flipped

    def read(self, known: Ints, revision: int) -> Patch:
        """The patch round the vertices `known`, int64[n]. Seven queries, whatever the size."""
        edges = self._around(known, EntityKind.EDGE, revision)
        elements = self._around(known, self._kind or EntityKind.CELL, revision)
        faces = self._around(known, EntityKind.FACE, revision)
        everything = np.concatenate([known, edges.vertices, faces.vertices, elements.vertices])
        found = self._session.entities("vertex", np.unique(everything), as_of_revision=revision)
        vertices = found.ids.astype(np.int64)
        is_solid = self._kind == EntityKind.CELL
        dangling = faces.is_element & ~faces.on_boundary & is_solid
        pins = _vertices_of(edges, edges.is_element), _vertices_of(faces, dangling)
        ends = np.searchsorted(vertices, edges.vertices).reshape(-1, 2)
        return Patch(
            revision=revision,
            vertices=vertices,
            points=found.positions,
            is_known=np.isin(vertices, known),
            on_surface=found.on_boundary | (not is_solid),
            is_flat=self._flatness(found, faces) & (is_solid | ~found.on_boundary),
            is_pinned=np.isin(vertices, np.concatenate(pins)),
            blocks=tuple(self._blocks(elements, vertices)),
            edges=ends,
            edge_on_surface=edges.on_boundary | (not is_solid),
        )

    def _around(self, vertices: Ints, kind: EntityKind, revision: int) -> Entities:
        found = self._session.neighbors("vertex", kind, vertices, as_of_revision=revision)
        return self._session.entities(kind, np.unique(found.neighbors), as_of_revision=revision)

    def _blocks(self, elements: Entities, vertices: Ints) -> list[Block]:
        corners = np.searchsorted(vertices, elements.vertices)
        blocks = []
        for value in np.unique(elements.types[elements.is_element]):
            of_type = ElementType(int(value))
            rows = np.flatnonzero((elements.types == value) & elements.is_element)
            order = FLIPPED[of_type] if of_type in self._flipped else range(of_type.num_vertices)
            columns = elements.vertex_offsets[rows][:, None] + np.array(order)
            blocks.append(Block(of_type, elements.ids[rows].astype(np.int64), corners[columns]))
        return blocks

    def _flatness(self, found: Entities, faces: Entities) -> Mask:
        """bool[m]: whether all normals of the surface at a vertex agree, either way round."""
        last = np.diff(faces.vertex_offsets)[:, None] - 1
        columns = faces.vertex_offsets[:-1, None] + np.minimum(np.arange(4), last)  # triangles repeat the last
        rows = columns[faces.on_boundary | (self._kind != EntityKind.CELL)]
        corners = np.searchsorted(found.ids, faces.vertices)[rows]
        a, b, c, d = np.moveaxis(found.positions[corners], 1, 0)
        normals = np.cross(c - a, d - b)
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
        first = np.zeros((len(found.ids), 3))
        first[corners] = normals[:, None]
        agreement = np.ones(len(found.ids))
        np.minimum.at(agreement, corners, abs(np.einsum("fkc,fc->fk", first[corners], normals)))
        return agreement > _FLAT_COSINE


def _vertices_of(entities: Entities, chosen: Mask) -> Ids:
    return entities.vertices[np.repeat(chosen, np.diff(entities.vertex_offsets))]
