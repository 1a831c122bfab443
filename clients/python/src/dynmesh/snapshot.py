"""The whole of a session at one revision, as numpy arrays."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .arrays import Ids, Points
from .checksum import MASK, Checksum, element_sum, position_sum, vertex_sum
from .columns import SLOT_COLUMN
from .files import PathLike, write_mesh
from .kinds import WEDGE_OF_MESHIO, ElementType, EntityKind, KindLike, as_kind

if TYPE_CHECKING:
    import meshio


@dataclass(frozen=True)
class Block:
    """Elements of one type: ids uint32[n], ascending, and their vertices uint32[n, k]."""

    type: ElementType
    ids: Ids
    vertices: Ids


@dataclass(frozen=True)
class Attribute:
    """Rows of an attribute: ids uint32[n], ascending, values [n, components], and the row [components] of all
    other entities of its kind."""

    name: str
    kind: EntityKind
    ids: Ids
    values: NDArray[Any]
    default: NDArray[Any]


@dataclass(frozen=True)
class Snapshot:
    """Vertices, elements and attributes of a session at `revision`.

    Attributes
    ----------
    vertex_ids : uint32[n]
        Ascending.
    positions : float64[n, 3]
    blocks : tuple of Block
        At most one for each type, by type.
    attributes : tuple of Attribute
    """

    revision: int
    vertex_ids: Ids
    positions: Points
    blocks: tuple[Block, ...]
    attributes: tuple[Attribute, ...]

    def blocks_of(self, kind: KindLike) -> tuple[Block, ...]:
        """The blocks of one kind: "edge", "face" or "cell"."""
        wanted = as_kind(kind)
        return tuple(block for block in self.blocks if block.type.kind == wanted)

    def checksum(self) -> Checksum:
        """Of this content, computed here: equal to the session's if nothing was lost on the way."""
        topology = vertex_sum(self.vertex_ids)
        for block in self.blocks:
            types = np.full(block.ids.size, block.type, dtype=np.uint8)
            topology += element_sum(types, block.ids, block.vertices)
        return Checksum(topology & MASK, position_sum(self.vertex_ids, self.positions))

    def to_meshio(self, *, slots: bool = True) -> meshio.Mesh:
        """This mesh for meshio.

        Vertices are numbered densely in order of their ids; there is one block for each type, in order of
        `ElementType`, with its elements by id. Degenerate and duplicate elements stay, isolated vertices
        too. Wedges are in meshio's node order (gmsh's, not VTK's).

        An attribute of one kind has its default in the blocks of other kinds, which is what the server holds
        for rows never set; attributes of derived faces and edges have no place in meshio and are left out.
        Attributes of the same name and different shape on two kinds are called ``name:kind``.

        Parameters
        ----------
        slots : bool
            Whether point_data and cell_data ``"dynmesh:slot"`` (int64) hold the ids.
        """
        import meshio

        dense = np.zeros(int(self.vertex_ids.max(initial=0)) + 1, dtype=np.int64)
        dense[self.vertex_ids] = np.arange(self.vertex_ids.size)
        point_data = {
            a.name: _flat(a.values) for a in self._attributes_of(EntityKind.VERTEX, self.vertex_ids)
        }
        cell_data = self._cell_data()
        if slots:
            point_data[SLOT_COLUMN] = self.vertex_ids.astype(np.int64)
            cell_data[SLOT_COLUMN] = [block.ids.astype(np.int64) for block in self.blocks]
        cells = [(block.type.meshio_name, dense[_meshio_order(block)]) for block in self.blocks]
        return meshio.Mesh(self.positions, cells, point_data, cell_data)

    def write(self, path: PathLike, file_format: str | None = None, *, slots: bool = True) -> None:
        """Writes the mesh to a file in whatever format meshio knows by its name."""
        write_mesh(path, self.to_meshio(slots=slots), file_format)

    def _attributes_of(self, kind: EntityKind, ids: Ids) -> list[Attribute]:
        """Attributes of a kind with one row for each of `ids`."""
        rows = [(a, _rows_at(a, ids)) for a in self.attributes if a.kind == kind]
        return [Attribute(a.name, kind, ids, values, a.default) for a, values in rows]

    def _cell_data(self) -> dict[str, list[NDArray[Any]]]:
        kinds = {block.type.kind for block in self.blocks}
        columns = [a for a in self.attributes if a.kind in kinds]
        shapes = {(a.name, a.values.dtype, a.values.shape[1]) for a in columns}
        clashes = {name for name, uses in Counter(name for name, *_ in shapes).items() if uses > 1}
        data: dict[str, list[NDArray[Any]]] = {}
        for a in columns:
            key = f"{a.name}:{a.kind}" if a.name in clashes else a.name
            blocks = data.setdefault(key, [_flat(_defaults(a, block.ids.size)) for block in self.blocks])
            for i, block in enumerate(self.blocks):
                if block.type.kind == a.kind:
                    blocks[i] = _flat(_rows_at(a, block.ids))
        return data


def _meshio_order(block: Block) -> Ids:
    return block.vertices[:, WEDGE_OF_MESHIO] if block.type == ElementType.PRISM else block.vertices


def _rows_at(attribute: Attribute, ids: Ids) -> NDArray[Any]:
    """The rows of `ids`; the default where there is none."""
    rows = _defaults(attribute, ids.size)
    at = np.searchsorted(attribute.ids, ids)
    known = at < attribute.ids.size
    known[known] = attribute.ids[at[known]] == ids[known]
    rows[known] = attribute.values[at[known]]
    return rows


def _defaults(attribute: Attribute, count: int) -> NDArray[Any]:
    return np.tile(attribute.default, (count, 1))


def _flat(values: NDArray[Any]) -> NDArray[Any]:
    """Scalars as [n], vectors as [n, k]."""
    return values[:, 0] if values.shape[1] == 1 else values
