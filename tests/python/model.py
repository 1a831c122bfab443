"""What a session holds, as plain dicts, and what follows from that by brute force."""

from __future__ import annotations

from collections import Counter, defaultdict

import numpy as np
from dynmesh import Checksum, ElementType, EntityKind, checksum
from shapes import FACES

MASK = (1 << 64) - 1


class Model:
    """Vertices by id and elements by kind and id."""

    def __init__(self) -> None:
        self.vertices: dict[int, tuple[float, float, float]] = {}
        self.elements: dict[EntityKind, dict[int, tuple[ElementType, tuple[int, ...]]]] = {
            kind: {} for kind in (EntityKind.EDGE, EntityKind.FACE, EntityKind.CELL)
        }

    def uses(self, vertex: int) -> bool:
        """Whether an element names the vertex."""
        return any(vertex in nodes for table in self.elements.values() for _, nodes in table.values())

    def checksum(self) -> Checksum:
        """By numpy, from nothing but this model."""
        ids = np.array(sorted(self.vertices), dtype=np.uint32)
        points = np.array([self.vertices[i] for i in ids.tolist()], dtype=float).reshape(-1, 3)
        topology = checksum.vertex_sum(ids)
        for table in self.elements.values():
            for slot, (element_type, nodes) in table.items():
                types, slots = np.array([element_type], np.uint8), np.array([slot], np.uint32)
                topology += checksum.element_sum_numpy(types, slots, np.array([nodes], np.uint32))
        return Checksum(topology & MASK, checksum.position_sum_numpy(ids, points))

    @classmethod
    def of(cls, snapshot) -> Model:
        """The model that a snapshot holds."""
        model = cls()
        model.vertices = dict(zip(snapshot.vertex_ids.tolist(), map(tuple, snapshot.positions.tolist())))
        for block in snapshot.blocks:
            table = model.elements[block.type.kind]
            for slot, nodes in zip(block.ids.tolist(), block.vertices.tolist()):
                table[slot] = (block.type, tuple(nodes))
        return model

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Model) and (self.vertices, self.elements) == (other.vertices, other.elements)


def cycle_key(nodes: tuple[int, ...]) -> tuple[int, ...]:
    """The same for all rotations and both directions of a face."""
    turns = [cycle[i:] + cycle[:i] for cycle in (nodes, nodes[::-1]) for i in range(len(nodes))]
    return min(turns)


def faces_of(element_type: ElementType, nodes: tuple[int, ...]) -> list[tuple[int, ...]]:
    """Vertex cycles of an element's faces."""
    return [tuple(nodes[i] for i in face) for face in FACES[element_type.meshio_name]]


def edges_of(cycle: tuple[int, ...]) -> list[tuple[int, int]]:
    """Sorted vertex pairs round a face."""
    return [tuple(sorted(pair)) for pair in zip(cycle, cycle[1:] + cycle[:1])]  # type: ignore[misc]


class Oracle:
    """All relations of a session, by brute force over its elements. Ids of derived entities are the server's,
    matched by vertices; that there are neither more nor fewer of them is checked on the way."""

    def __init__(self, session, model: Model) -> None:
        self._session = session
        self._model = model
        self.nodes: dict[str, dict[int, tuple[int, ...]]] = {"cell": {}}
        self._types = {i: t for i, (t, _) in model.elements[EntityKind.CELL].items()}
        self.nodes["vertex"] = {i: (i,) for i in model.vertices}
        self.nodes["cell"] = {i: n for i, (_, n) in model.elements[EntityKind.CELL].items()}
        face_ids = self._match_faces()
        edge_ids = self._match_edges()
        down = {
            ("face", "edge"): {f: [edge_ids[e] for e in edges_of(n)] for f, n in self.nodes["face"].items()},
            ("cell", "face"): {
                c: [face_ids[cycle_key(f)] for f in faces_of(self._types[c], n)]
                for c, n in self.nodes["cell"].items()
            },
        }
        down["cell", "edge"] = {
            c: [e for f in faces for e in down["face", "edge"][f]]
            for c, faces in down["cell", "face"].items()
        }
        for kind in ("edge", "face", "cell"):
            down[kind, "vertex"] = {i: list(n) for i, n in self.nodes[kind].items()}
        self._down = {relation: {i: set(row) for i, row in rows.items()} for relation, rows in down.items()}

    def relation(self, origin: str, target: str) -> dict[int, set[int]]:
        """Neighbours of every entity, without order."""
        order = ("vertex", "edge", "face", "cell")
        if order.index(origin) > order.index(target):
            return self._down[origin, target]
        if origin != target:
            return self._up(origin, target)
        through = {"vertex": "edge", "edge": "vertex", "face": "edge", "cell": "face"}[origin]
        return self._adjacent(origin, through)

    def boundary(self, kind: str) -> set[int]:
        """Faces with one cell; edges of those and with one face; vertices of those."""
        faces = {f for f, cells in self.relation("face", "cell").items() if self._uses(f) == 1}
        edges = {e for e, of in self.relation("edge", "face").items() if len(of) == 1}
        edges |= {e for f in faces for e in self._down["face", "edge"][f]}
        vertices = {v for e in edges for v in self._down["edge", "vertex"][e]}
        return {"face": faces, "edge": edges, "vertex": vertices}[kind]

    def _uses(self, face: int) -> int:
        return sum(face in faces for faces in self._down["cell", "face"].values())

    def _up(self, origin: str, target: str) -> dict[int, set[int]]:
        rows: dict[int, set[int]] = {i: set() for i in self.nodes[origin]}
        for high, lows in self._down[target, origin].items():
            for low in lows:
                rows[low].add(high)
        return rows

    def _adjacent(self, kind: str, through: str) -> dict[int, set[int]]:
        there, back = self.relation(kind, through), self.relation(through, kind)
        return {i: {j for t in row for j in back[t]} - {i} for i, row in there.items()}

    def _match_faces(self) -> dict[tuple[int, ...], int]:
        """Ids of the faces that cells use, by cycle."""
        elements = self._model.elements[EntityKind.FACE]
        wanted = Counter(cycle_key(n) for _, n in elements.values())
        for cell, nodes in self.nodes["cell"].items():
            for face in faces_of(self._types[cell], nodes):
                wanted[cycle_key(face)] = max(wanted[cycle_key(face)], 1)
        return self._match("face", wanted, cycle_key)

    def _match_edges(self) -> dict[tuple[int, int], int]:
        """Ids of the edges that faces use, by vertex pair."""
        elements = self._model.elements[EntityKind.EDGE]
        wanted = Counter(tuple(sorted(n)) for _, n in elements.values())
        for cycle in self.nodes["face"].values():
            for edge in edges_of(cycle):
                wanted[edge] = max(wanted[edge], 1)
        return self._match("edge", wanted, lambda nodes: tuple(sorted(nodes)))

    def _match(self, kind: str, wanted: Counter, key_of) -> dict:
        listed = self._session.entities(kind)
        ends = listed.vertex_offsets
        self.nodes[kind] = {
            int(i): tuple(listed.vertices[ends[k] : ends[k + 1]].tolist()) for k, i in enumerate(listed.ids)
        }
        by_key = defaultdict(list)
        for k, i in enumerate(listed.ids.tolist()):
            by_key[key_of(self.nodes[kind][i])].append((bool(listed.is_duplicate[k]), i))
        assert {key: len(ids) for key, ids in by_key.items()} == dict(wanted)
        for ids in by_key.values():
            assert sum(not duplicate for duplicate, _ in ids) == 1
        return {key: min(ids)[1] for key, ids in by_key.items()}
