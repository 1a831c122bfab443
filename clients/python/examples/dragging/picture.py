"""The boundary surface at the end, as a picture and as VTU.

Painted back to front in numpy and matplotlib, because Debian's VTK draws on an X server only.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import meshio
import numpy as np
from dynmesh import Session
from matplotlib import pyplot
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import Normalize
from PIL import Image

from .elements import Floats, Ints
from .region import Region

_SIZE_INCHES = (12.0, 6.0)
_DPI = 100
_COLOURS = 256  # in the file: half its size in full colour
_MOST_OUTLINED = 40000  # faces: beyond, the lines between them would hide the colours
_OLD = np.array([0.80, 0.82, 0.85])
_LIGHT = np.array([0.30, 0.35, 0.89])  # towards the light, in the frame of the camera


@dataclass(frozen=True)
class Surface:
    """Boundary faces of a session.

    Attributes
    ----------
    points : float64[n, 3]
    corners : int64[f, 4]
        Triangles repeat their last corner.
    sizes : int64[f]
        3 or 4.
    born : int64[f]
        Revision at which each face came to be.
    slots : int64[n]
        Ids of the vertices.
    """

    points: Floats
    corners: Ints
    sizes: Ints
    born: Ints
    slots: Ints


def read_surface(session: Session) -> Surface | None:
    """The boundary of a volume, or all faces of a surface, as the service lists them; None without any."""
    volume = session.info().element_counts.cells > 0
    found = session.entities("face", session.boundary("face") if volume else None)
    if not found.ids.size:
        return None
    sizes = np.diff(found.vertex_offsets)
    slots = np.unique(found.vertices)
    columns = found.vertex_offsets[:-1, None] + np.minimum(np.arange(4), sizes[:, None] - 1)
    corners = np.searchsorted(slots, found.vertices)[columns]
    return Surface(session.positions(slots), corners, sizes, found.born_revisions, slots.astype(np.int64))


def write_vtu(path: Path, surface: Surface) -> None:
    """Writes the surface with the revision at which each face was born."""
    blocks, born = [], []
    for size, name in ((3, "triangle"), (4, "quad")):
        rows = np.flatnonzero(surface.sizes == size)
        if rows.size:
            blocks.append((name, surface.corners[rows, :size]))
            born.append(surface.born[rows])
    point_data = {"dynmesh:slot": surface.slots}
    meshio.write(path, meshio.Mesh(surface.points, blocks, point_data, {"born_revision": born}))


def draw(path: Path, surface: Surface, region: Region | None, caption: str) -> None:
    """Paints the surface: grey where faces are as old as the import, by age where they are new."""
    camera = _camera(surface, region)
    seen = surface.points @ camera.T
    depth = seen[surface.corners][..., 2].mean(axis=1)
    order = np.argsort(depth)
    figure = pyplot.figure(figsize=_SIZE_INCHES, dpi=_DPI)
    axes = figure.add_axes((0.01, 0.11, 0.98, 0.82))
    colours, scale = _colours(surface, seen)
    outlined = len(order) <= _MOST_OUTLINED
    lines = np.clip(colours - 0.22, 0, 1) if outlined else colours
    outlines = seen[surface.corners[order]][..., :2]
    axes.add_collection(
        PolyCollection(outlines, facecolors=colours[order], edgecolors=lines[order], linewidths=0.3)
    )
    if region is not None:
        _draw_path(axes, region, camera, seen)
    _frame(axes, seen)
    bar = figure.colorbar(scale, cax=figure.add_axes((0.2, 0.075, 0.6, 0.02)), orientation="horizontal")
    bar.set_label("revision at which a face came to be (grey: with the import)", fontsize=9, labelpad=1)
    bar.ax.tick_params(labelsize=8)
    figure.text(0.5, 0.95, caption, ha="center", fontsize=11)
    _save(path, figure)


def _save(path: Path, figure: pyplot.Figure) -> None:
    figure.canvas.draw()
    image = Image.fromarray(np.asarray(figure.canvas.buffer_rgba())[..., :3])
    image.quantize(_COLOURS, dither=Image.Dither.NONE).save(path, optimize=True)
    pyplot.close(figure)


def _camera(surface: Surface, region: Region | None) -> Floats:
    """Rows: right, up, and towards the eye, which looks across the thinnest axis at the side of the region."""
    middle = surface.points.mean(axis=0)
    some = surface.points[:: max(len(surface.points) // 2000, 1)] - middle
    thin, _, right = np.linalg.eigh(some.T @ some)[1].T
    right *= np.sign(right[np.abs(right).argmax()])
    goal = region.path(1.0) - middle if region is not None else np.ones(3)
    eye = thin if thin @ goal >= 0 else -thin
    up = np.cross(eye, right)
    tilt = 0.7 if up @ goal > 0.3 * np.linalg.norm(goal) else -0.7
    eye = eye + tilt * up - 0.15 * right
    eye /= np.linalg.norm(eye)
    right = right - (right @ eye) * eye
    right /= np.linalg.norm(right)
    return np.array([right, np.cross(eye, right), eye])


def _colours(surface: Surface, seen: Floats) -> tuple[Floats, pyplot.cm.ScalarMappable]:
    scale = pyplot.cm.ScalarMappable(Normalize(1, max(int(surface.born.max()), 2)), "plasma_r")
    base = np.where((surface.born <= 1)[:, None], _OLD, scale.to_rgba(surface.born)[:, :3])
    corners = seen[surface.corners]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    normals *= np.where(normals[:, 2:] < 0, -1, 1)  # towards the eye
    light = _LIGHT / np.linalg.norm(_LIGHT)
    return np.clip(base * (0.5 + 0.55 * np.clip(normals @ light, 0, 1))[:, None], 0, 1), scale


def _draw_path(axes: pyplot.Axes, region: Region, camera: Floats, seen: Floats) -> None:
    """The way of the centre, and the rim of what it carried when it set out."""
    angles = np.linspace(0, 2 * np.pi, 100)
    plane = np.eye(3)[:2] if region.extent[2] == 0 else camera[:2]
    circle = np.column_stack([np.cos(angles), np.sin(angles)])
    rim = (region.path(0.0) + region.inner * circle @ plane) @ camera.T
    axes.add_collection(LineCollection([rim[:, :2]], colors="black", linewidths=1.2, linestyles="dotted"))
    way = np.array([region.path(t) for t in np.linspace(0, 1, 100)]) @ camera.T
    axes.add_collection(LineCollection([way[:, :2]], colors="black", linewidths=1.2, linestyles="dashed"))
    axes.plot(*way[0, :2], "o", color="white", markeredgecolor="black", markersize=5)
    axes.plot(*way[-1, :2], "o", color="black", markersize=5)


def _frame(axes: pyplot.Axes, seen: Floats) -> None:
    low, high = seen[:, :2].min(axis=0), seen[:, :2].max(axis=0)
    margin = 0.02 * (high - low).max()
    axes.set_xlim(low[0] - margin, high[0] + margin)
    axes.set_ylim(low[1] - margin, high[1] + margin)
    axes.set_aspect("equal")
    axes.set_axis_off()
