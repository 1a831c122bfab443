"""From meshio meshes and numpy arrays to what the server imports, without changing anything on the way."""

from __future__ import annotations

import warnings
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from .arguments import as_list, as_text, bad_argument
from .arrays import Ids, Points, as_array, as_id_rows, as_points
from .columns import Column, cell_columns, point_columns
from .errors import InvalidArgumentError
from .kinds import WEDGE_OF_MESHIO, ElementType, EntityKind, as_element_type

if TYPE_CHECKING:
    import meshio

Cells = Mapping[str, ArrayLike] | Iterable[tuple[str, ArrayLike]]

_MESHIO_TYPES = {t.meshio_name: t for t in ElementType}


@dataclass(frozen=True)
class MeshData:
    """A mesh to import: vertex i gets id i, element i of all blocks of a kind gets id i of that kind.

    Attributes
    ----------
    points : float64[n, 3]
    blocks : list of (ElementType, uint32[m, k])
    columns : list of Column
    """

    points: Points
    blocks: list[tuple[ElementType, Ids]]
    columns: list[Column] = field(default_factory=list)

    @property
    def num_elements(self) -> int:
        """Elements of all blocks."""
        return sum(len(rows) for _, rows in self.blocks)


def from_arrays(points: ArrayLike, cells: Cells) -> MeshData:
    """A mesh from numpy arrays.

    Parameters
    ----------
    points : float[n, 3]
    cells : mapping or iterable of (type, int[m, k])
        Blocks of elements by meshio's names ("tetra", "wedge", ...) or ours ("tetrahedron", "prism").
        Nodes are in VTK's order, those of wedges too, where a `meshio.Mesh` has another.
    """
    items = cells.items() if isinstance(cells, Mapping) else as_list(cells, "cells")
    return MeshData(as_points(points, "points"), [_block(*_pair(item)) for item in items])


def from_meshio(mesh: meshio.Mesh, attributes: Collection[str] | None = None) -> MeshData:
    """A mesh from a `meshio.Mesh`: points, blocks, point_data and cell_data, in their order.

    Nodes of wedges are put from meshio's order (gmsh's) into VTK's.

    Points of the plane get z = 0. "vertex" blocks are left out with a warning: every point is a vertex
    already. Names of data with characters other than letters, digits, ``_``, ``.`` and ``-`` have those
    replaced by ``_``, with a warning. Sets and field data are left out with a warning.

    Parameters
    ----------
    attributes : collection of str, optional
        Names of the point and cell data to take. Default: all.

    Raises
    ------
    InvalidArgumentError
        A type of cells that dynmesh has not (the message names the block), a name in `attributes` that the mesh
        has not, or data that no type of columns holds exactly.
    """
    _check_names(mesh, attributes)
    kinds: list[EntityKind | None] = []
    blocks = []
    for number, block in enumerate(mesh.cells):
        element_type = _type_of_block(number, block.type)
        kinds.append(element_type.kind if element_type else None)
        if element_type:
            blocks.append(_from_meshio_order(*_block(element_type, block.data)))
    _warn_of_sets(mesh)
    columns = point_columns(mesh.point_data, attributes) + cell_columns(mesh.cell_data, kinds, attributes)
    return MeshData(_points_3d(mesh.points), blocks, columns)


def as_mesh_data(mesh: Any, cells: Cells | None, attributes: Collection[str] | None) -> MeshData:
    """`MeshData` of whatever `Session.import_mesh` was given, but file names."""
    if isinstance(mesh, MeshData):
        return mesh
    if cells is not None:
        return from_arrays(mesh, cells)
    if hasattr(mesh, "points") and hasattr(mesh, "cells"):
        return from_meshio(mesh, attributes)
    return from_arrays(mesh, ())


def _check_names(mesh: meshio.Mesh, attributes: Collection[str] | None) -> None:
    wanted = {as_text(name, "attributes") for name in as_list(attributes or (), "attributes")}
    there = set(mesh.point_data) | set(mesh.cell_data)
    if missing := sorted(wanted - there):
        raise InvalidArgumentError(
            f"the mesh has no data named {', '.join(missing)}; it has {', '.join(sorted(there)) or 'none'}",
            reason="UNKNOWN_ATTRIBUTE",
            metadata={"attribute": missing[0]},
        )


def _pair(item: Any) -> tuple[ElementType | str, ArrayLike]:
    if isinstance(item, (tuple, list)) and len(item) == 2:
        return item[0], item[1]
    raise bad_argument("cells", f"cells are pairs of a type and rows of vertices, not {item!r}")


def _block(name: ElementType | str, rows: ArrayLike) -> tuple[ElementType, Ids]:
    element_type = as_element_type(name)
    return element_type, as_id_rows(rows, element_type.num_vertices, f"{element_type.meshio_name} cells")


def _from_meshio_order(element_type: ElementType, rows: Ids) -> tuple[ElementType, Ids]:
    return element_type, rows[:, WEDGE_OF_MESHIO] if element_type == ElementType.PRISM else rows


def _type_of_block(number: int, name: str) -> ElementType | None:
    if name == "vertex":
        warnings.warn(f"block {number} (vertex) is left out: every point is a vertex", stacklevel=3)
        return None
    if name not in _MESHIO_TYPES:
        raise InvalidArgumentError(
            f"block {number} holds {name} cells; dynmesh has {', '.join(_MESHIO_TYPES)}",
            reason="BAD_ELEMENT_TYPE",
            metadata={"block": str(number), "type": name},
        )
    return _MESHIO_TYPES[name]


def _points_3d(points: ArrayLike) -> Points:
    array = as_array(points, "points")
    if array.ndim == 2 and array.shape[1] == 2:
        array = np.column_stack([array, np.zeros(len(array), dtype=array.dtype)])
    return as_points(array, "points")


def _warn_of_sets(mesh: meshio.Mesh) -> None:
    lost = [name for name in ("point_sets", "cell_sets", "field_data") if getattr(mesh, name, None)]
    if lost:
        warnings.warn(f"{', '.join(lost)} of the mesh are left out: dynmesh has no such thing", stacklevel=3)
