"""Repairs of tetrahedra and triangles: a cavity is emptied, and filled with the cone from one point.

    o-------o          o-------o      A vertex disappears, an edge swaps, an edge is cut in two, a ruin is
    | \   / |          | \     |      built anew round a vertex in its middle: each time the elements of a
    |   x   |   --->   |   \   |      cavity go, and its faces are joined to one point p, old or new. If all
    | /   \ |          |     \ |      new elements are positive and fill what was emptied, the neighbours
    o-------p          o-------p      notice nothing.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from dynmesh import ElementType
from numpy.typing import NDArray

from .elements import FACES, Floats, Ints, determinants, is_cell, qualities

NEW = -1  # stands for the new vertex in the corners of a proposal

# Elements of a quality (`elements.qualities`) below this are replaced, if by better ones.
POOR = 0.05

_LONG, _SHORT = 3.5, 0.5  # in units of the spacing
_MAY_COST = 0.7  # part of the quality that must be left when long edges are cut and short ones disappear
_KEEPS_SIZE = 1e-9  # relative error allowed between the sizes of what goes and what comes
_MOST_GROWTH = 5
_MOST_CELLS = 40


@dataclass(frozen=True)
class Proposal:
    """A cavity and what could fill it.

    Attributes
    ----------
    removed : int64[r]
        Elements of the cavity.
    corners : int64[a, k]
        New elements; `NEW` is the new vertex.
    quality : float64[a]
        Of the new elements.
    point : float64[3] or None
        Where the new vertex would be.
    """

    removed: Ints
    corners: Ints
    quality: Floats
    point: Floats | None = None

    @property
    def worst(self) -> float:
        """Quality of the worst new element."""
        return float(self.quality.min(initial=np.inf))


class Cavities:
    """Elements of one type, tetrahedra or triangles, in which cavities are emptied and filled.

    Vertices and elements are numbered locally, in order of the arrays given; new ones get the next numbers.

    Parameters
    ----------
    of_type : ElementType
        TETRAHEDRON or TRIANGLE.
    corners : int64[n, k]
        In positive order.
    quality : float64[n]
    points : float64[m, 3]
        Where the vertices are now.
    known : bool[m]
        Vertices all of whose elements are given. Others may lose some, but never disappear.
    pinned : bool[m]
        Vertices that other things hang on: they and the edges between them stay.
    spacing : float
        How long an edge ought to be.
    """

    def __init__(
        self,
        of_type: ElementType,
        corners: Ints,
        quality: Floats,
        points: Floats,
        known: NDArray[np.bool_],
        pinned: NDArray[np.bool_],
        spacing: float,
    ) -> None:
        self.of_type = of_type
        self.corners = corners
        self.quality = quality
        self.points = points
        self.alive = np.ones(len(corners), dtype=bool)
        self._faces = np.array(FACES[of_type])
        self._edges = [(i, j) for i in range(corners.shape[1]) for j in range(i)]
        self._known = known.copy()
        self._pinned = pinned.copy()
        self._spacing = spacing
        self._order = np.argsort(corners, axis=None, kind="stable")
        self._starts = np.searchsorted(corners.ravel()[self._order], np.arange(len(points) + 1))
        self._added: dict[int, list[int]] = {}

    # ---- Result ----

    def lost_vertices(self) -> Ints:
        """Vertices that had elements and have none any more: all of those can go."""
        touched = np.unique(self.corners[~self.alive])
        free = touched[self._known[touched] & ~self._pinned[touched]]
        return np.array([v for v in free if self.star(v).size == 0], dtype=np.int64)

    # ---- Repairs ----

    def repair(self, element: int) -> bool:
        """Replaces the surroundings of an element by better ones; False if nothing better was found.

        An element that has become long is cut, and a short edge disappears, even if that costs a little
        quality. For a poor one the first proposal without poor elements is taken, else the best of all.
        """
        edges = self._edges_by_length(element)
        (short, a, b), (long, c, d) = edges[0], edges[-1]
        if long > _LONG * self._spacing and self._accept(self._with_cut_edge(c, d), _MAY_COST):
            return True
        if short < _SHORT * self._spacing:
            if any(self._accept(self._without_vertex(v), _MAY_COST) for v in (a, b)):
                return True
        return self.quality[element] < POOR and self._accept(self._best_of_all(element, edges), 1.0)

    def is_worn(self, quality: Floats, before: Floats) -> NDArray[np.bool_]:
        """Which of the elements given deserve a repair, bool[n]: those that are inverted; of those that are
        worse than `before` the poor, the long and the short ones."""
        ends = self.points[self.corners[: len(quality)]]
        lengths = np.stack([np.linalg.norm(ends[:, i] - ends[:, j], axis=1) for i, j in self._edges])
        long = lengths.max(axis=0) > _LONG * self._spacing
        short = lengths.min(axis=0) < _SHORT * self._spacing
        return (quality <= 0) | ((quality < 0.999 * before) & ((quality < POOR) | long | short))

    def _accept(self, proposal: Proposal | None, part: float) -> bool:
        """Applies a proposal, if it is better than `part` of what is there."""
        if proposal is None or proposal.worst <= max(part * self.quality[proposal.removed].min(), 0.0):
            return False
        if proposal.point is None and self._clashes(proposal):
            return False
        self._apply(proposal)
        return True

    def _best_of_all(self, element: int, edges: list[tuple[float, int, int]]) -> Proposal | None:
        best: Proposal | None = None
        for proposal in self._proposals(element, edges):
            if proposal is not None and (best is None or proposal.worst > best.worst):
                best = proposal
                if best.worst >= POOR:
                    break
        return best

    def _proposals(self, element: int, edges: list[tuple[float, int, int]]) -> Iterator[Proposal | None]:
        for vertex in self.corners[element].tolist():
            yield self._without_vertex(vertex)
        for _, a, b in edges:
            yield self._without_edge(a, b)
        yield self._with_cut_edge(*edges[-1][1:])
        yield self._refilled(element)

    def _edges_by_length(self, element: int) -> list[tuple[float, int, int]]:
        corners = self.corners[element].tolist()
        ends = self.points[corners]
        i, j = np.array(self._edges).T
        lengths = np.linalg.norm(ends[i] - ends[j], axis=1).tolist()
        return sorted((length, corners[k], corners[l]) for length, (k, l) in zip(lengths, self._edges))

    def star(self, vertex: int) -> Ints:
        """Elements round a vertex, as far as they were given."""
        begin, end = self._starts[vertex : vertex + 2] if vertex + 1 < len(self._starts) else (0, 0)
        added = np.array(self._added.get(int(vertex), ()), dtype=np.int64)
        elements = np.concatenate([self._order[begin:end] // self.corners.shape[1], added])
        return elements[self.alive[elements]]

    def _without_vertex(self, vertex: int) -> Proposal | None:
        """The vertex moves onto one of its neighbours; along the boundary, if it is there."""
        if not self._known[vertex] or self._pinned[vertex]:
            return None
        cavity = self.star(vertex)
        shell = self._shell(cavity)
        on_boundary = shell[(shell == vertex).any(axis=1)]
        link = shell[(shell != vertex).all(axis=1)]
        ends = np.unique(on_boundary if on_boundary.size else link)
        return self._best_cone(cavity, link, ends[ends != vertex])

    def _without_edge(self, a: int, b: int) -> Proposal | None:
        """The edge swaps: its ring is joined to one vertex of the ring."""
        cavity = self._ring(a, b)
        if cavity is None:
            return None
        around = np.unique(self.corners[cavity])
        return self._best_cone(cavity, self._shell(cavity), around[(around != a) & (around != b)])

    def _with_cut_edge(self, a: int, b: int) -> Proposal | None:
        """A new vertex in the middle of the edge."""
        cavity = self._ring(a, b)
        if cavity is None:
            return None
        old = self.corners[cavity]
        corners = np.concatenate([np.where(old == a, NEW, old), np.where(old == b, NEW, old)])
        return self._with_point(cavity, corners, (self.points[a] + self.points[b]) / 2)

    def _refilled(self, element: int) -> Proposal | None:
        """A new vertex in the middle of a cavity that grows until it is star-shaped."""
        cavity = np.array([element])
        for _ in range(_MOST_GROWTH):
            faces = self._shell(cavity)
            centre = self.points[np.unique(faces)].mean(axis=0)
            corners = np.column_stack([faces, np.full(len(faces), NEW)])
            proposal = self._with_point(cavity, corners, centre)
            if proposal.worst > 0 and self._fills(cavity, self._measures(corners, centre, cavity)):
                return proposal
            grown = self._grown(cavity, faces[proposal.quality <= 0])
            if grown.size == cavity.size or grown.size > _MOST_CELLS:
                return None
            cavity = grown
        return None

    # ---- Cones ----

    def _best_cone(self, cavity: Ints, faces: Ints, apexes: Ints) -> Proposal | None:
        """The cone over `faces`, int64[f, k - 1], from that of the vertices `apexes` which is best in its
        worst element; None if no cone fills the cavity."""
        corners = np.empty((len(apexes), len(faces), faces.shape[1] + 1), dtype=np.int64)
        corners[..., :-1] = faces
        corners[..., -1] = apexes[:, None]
        flat = (faces == apexes[:, None, None]).any(axis=2)  # faces that hold the apex already
        measures = np.where(flat, 0.0, self._measures(corners, None, cavity))
        fits = (flat | (measures > 0)).all(axis=1) & ~flat.all(axis=1) & self._fills(cavity, measures)
        if not fits.any():
            return None
        quality = np.where(flat[fits], np.inf, self._quality(corners[fits], None, cavity))
        best = int(quality.min(axis=1).argmax())
        kept = ~flat[fits][best]
        return Proposal(cavity, corners[fits][best][kept], quality[best][kept])

    def _with_point(self, cavity: Ints, corners: Ints, point: Floats) -> Proposal:
        return Proposal(cavity, corners, self._quality(corners, point, cavity), point)

    def _fills(self, cavity: Ints, measures: Floats) -> NDArray[np.bool_]:
        """Whether elements of sizes `measures`, float64[..., f], fill the cavity."""
        old = self._measures(self.corners[cavity], None, cavity)
        return abs(measures.sum(axis=-1) - old.sum()) <= _KEEPS_SIZE * abs(old).sum()

    def _quality(self, corners: Ints, point: Floats | None, cavity: Ints) -> Floats:
        normal = None if is_cell(self.of_type) else _direction(self._area_vector(cavity))
        return qualities(self.of_type, self._positions(corners, point), normal)

    def _measures(self, corners: Ints, point: Floats | None, cavity: Ints) -> Floats:
        """Signed volumes; of triangles the areas as seen along the normal of the cavity."""
        positions = self._positions(corners, point)
        edges = positions[..., 1:, :] - positions[..., :1, :]
        third = edges[..., 2, :] if is_cell(self.of_type) else _direction(self._area_vector(cavity))
        return determinants(edges[..., 0, :], edges[..., 1, :], third)

    def _area_vector(self, cavity: Ints) -> Floats:
        corners = self.points[self.corners[cavity]]
        return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]).sum(axis=0)

    def _positions(self, corners: Ints, point: Floats | None) -> Floats:
        positions = self.points[corners]  # NEW reads the last point, which is then replaced
        if point is not None:
            positions[corners == NEW] = point
        return positions

    # ---- Topology ----

    def _ring(self, a: int, b: int) -> Ints | None:
        """Elements round an edge; None if they are not all known, or if something else hangs on it."""
        if not (self._known[a] or self._known[b]) or (self._pinned[a] and self._pinned[b]):
            return None
        elements = self.star(a if self._known[a] else b)
        corners = self.corners[elements]
        return elements[(corners == a).any(axis=1) & (corners == b).any(axis=1)]

    def _shell(self, cavity: Ints) -> Ints:
        """Faces that belong to one element of the cavity only."""
        faces = self._faces_of(self.corners[cavity])
        _, first, count = np.unique(self._keys(faces), return_index=True, return_counts=True)
        return faces[first[count == 1]]

    def _clashes(self, proposal: Proposal) -> bool:
        """Whether a new face exists already outside of the cavity: where inverted elements overlap others."""
        apex = proposal.corners[0, -1]
        outside = np.setdiff1d(self.star(apex), proposal.removed)
        shell = self._keys(self._shell(proposal.removed))
        new = np.setdiff1d(self._keys(self._faces_of(proposal.corners)), shell)
        return bool(np.isin(new, self._keys(self._faces_of(self.corners[outside]))).any())

    def _faces_of(self, corners: Ints) -> Ints:
        return corners[:, self._faces].reshape(-1, self._faces.shape[1])

    def _keys(self, faces: Ints) -> Ints:
        """One number for each set of vertices."""
        return np.sort(faces, axis=1) @ (len(self.points) + 1) ** np.arange(faces.shape[1])

    def _grown(self, cavity: Ints, faces: Ints) -> Ints:
        """The cavity with its known neighbours across `faces`."""
        behind = [self._at_face(face) for face in faces]
        return np.unique(np.concatenate([cavity, *behind]))

    def _at_face(self, face: Ints) -> Ints:
        known = face[self._known[face]]
        if not known.size:
            return np.zeros(0, dtype=np.int64)
        elements = self.star(known[0])
        return elements[np.isin(self.corners[elements], face).sum(axis=1) == len(face)]

    def _apply(self, proposal: Proposal) -> None:
        corners = proposal.corners
        if proposal.point is not None:
            corners = np.where(corners == NEW, len(self.points), corners)
            self._add_vertex(proposal.point)
        self.alive[proposal.removed] = False
        first = len(self.corners)
        self.corners = np.concatenate([self.corners, corners])
        self.alive = np.concatenate([self.alive, np.ones(len(corners), dtype=bool)])
        self.quality = np.concatenate([self.quality, proposal.quality])
        for i, row in enumerate(corners.tolist(), start=first):
            for vertex in row:
                self._added.setdefault(vertex, []).append(i)

    def _add_vertex(self, point: Floats) -> None:
        self.points = np.vstack([self.points, point])
        self._known = np.append(self._known, True)
        self._pinned = np.append(self._pinned, False)


def _direction(vector: Floats) -> Floats:
    length = np.linalg.norm(vector)
    return vector / length if length > 0 else vector
