"""Random edits against a model of plain dicts: whatever is done, everybody agrees on what is there."""

from __future__ import annotations

import itertools

import dynmesh
import numpy as np
import pytest
from dynmesh import ElementType, EntityKind
from dynmesh.delta import HAS_NATIVE
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    RuleBasedStateMachine,
    initialize,
    invariant,
    precondition,
    rule,
    run_state_machine_as_test,
)
from model import Model, Oracle

KINDS = ("vertex", "edge", "face", "cell")
WAIT_S = 30
CODECS = ("auto", "draco", "zstd", "raw") if HAS_NATIVE else ("auto", "raw")
coordinate = st.floats(-1e6, 1e6)
point = st.tuples(coordinate, coordinate, coordinate)
_names = itertools.count()


class SessionMachine(RuleBasedStateMachine):
    """One session, its model, and a mirror that follows from the first revision on."""

    client: dynmesh.Client

    @initialize(codec=st.sampled_from(CODECS))
    def begin(self, codec):
        self.session = self.client.create_session(f"model-{next(_names)}")
        self.mirror = self.session.mirror(codec=codec)
        self.model = Model()
        self.revision = 0

    def teardown(self):
        if not hasattr(self, "session"):
            return
        try:
            assert self.session.validate() == []
            self.check_relations()
        finally:
            self.mirror.close()
            self.session.delete()

    # ---- Edits ----

    @rule(points=st.lists(point, min_size=1, max_size=5))
    def add_vertices(self, points):
        with self.session.edit() as tx:
            handles = tx.add_vertices(points)
        self.committed(tx)
        self.learn_vertices(tx.result.resolve(handles), points)

    @precondition(lambda self: self.model.vertices)
    @rule(data=st.data(), element_type=st.sampled_from(ElementType), count=st.integers(1, 3))
    def add_elements(self, data, element_type, count):
        if len(self.model.vertices) < element_type.num_vertices:
            return
        nodes = st.permutations(sorted(self.model.vertices)).map(lambda p: p[: element_type.num_vertices])
        rows = data.draw(st.lists(nodes, min_size=count, max_size=count))
        with self.session.edit() as tx:
            index = tx.add_elements(element_type, rows)
        self.committed(tx)
        self.learn_elements(element_type, tx.result.new_ids[index], rows)

    @rule(element_type=st.sampled_from(ElementType), data=st.data())
    def add_an_element_of_new_vertices(self, element_type, data):
        points = data.draw(
            st.lists(point, min_size=element_type.num_vertices, max_size=element_type.num_vertices)
        )
        with self.session.edit() as tx:
            handles = tx.add_vertices(points)
            index = tx.add_elements(element_type, [handles])
        self.committed(tx)
        ids = tx.result.resolve(handles)
        self.learn_vertices(ids, points)
        self.learn_elements(element_type, tx.result.new_ids[index], [ids])

    @rule(data=st.data(), kind=st.sampled_from([EntityKind.EDGE, EntityKind.FACE, EntityKind.CELL]))
    def remove_elements(self, data, kind):
        table = self.model.elements[kind]
        if not table:
            return
        victims = data.draw(st.lists(st.sampled_from(sorted(table)), min_size=1, max_size=3, unique=True))
        with self.session.edit() as tx:
            tx.remove_elements(kind, victims)
        self.committed(tx)
        for victim in victims:
            del table[victim]

    @precondition(lambda self: self.model.vertices)
    @rule(data=st.data())
    def move_vertices(self, data):
        ids = data.draw(
            st.lists(st.sampled_from(sorted(self.model.vertices)), min_size=1, max_size=4, unique=True)
        )
        points = data.draw(st.lists(point, min_size=len(ids), max_size=len(ids)))
        with self.session.edit() as tx:
            tx.move_vertices(ids, points)
        self.committed(tx)
        self.model.vertices.update(zip(ids, points))

    @precondition(lambda self: self.model.vertices)
    @rule(data=st.data())
    def remove_a_vertex(self, data):
        victim = data.draw(st.sampled_from(sorted(self.model.vertices)))
        if self.model.uses(victim):
            with pytest.raises(dynmesh.FailedPreconditionError, match="VERTEX_IN_USE"):
                with self.session.edit() as tx:
                    tx.add_vertices([[0, 0, 0]])
                    tx.remove_vertices([victim])
            return
        with self.session.edit() as tx:
            tx.remove_vertices([victim])
        self.committed(tx)
        del self.model.vertices[victim]
        with pytest.raises(dynmesh.NotFoundError, match="ENTITY_REMOVED"):
            self.session.positions([victim])

    @rule()
    def be_refused(self):
        with pytest.raises(dynmesh.NotFoundError):
            with self.session.edit() as tx:
                handles = tx.add_vertices(np.eye(3))
                tx.add_elements("triangle", [handles])
                tx.move_vertices([2**31 - 1], [[0, 0, 0]])

    @precondition(lambda self: self.revision > 0)
    @rule()
    def follow_anew_from_the_copy(self):
        self.mirror.wait(self.revision, timeout=WAIT_S)
        self.mirror.close()
        self.mirror = self.session.mirror(from_mirror=self.mirror)

    # ---- Laws ----

    @invariant()
    def everybody_agrees(self):
        if not hasattr(self, "session"):
            return
        info = self.session.info()
        self.mirror.wait(self.revision, timeout=WAIT_S)
        assert info.revision == self.revision == self.mirror.revision
        assert info.checksum == self.model.checksum() == self.mirror.checksum
        assert Model.of(self.mirror.snapshot()) == self.model
        assert Model.of(self.session.snapshot()) == self.model
        assert info.counts.vertices == len(self.model.vertices)
        assert info.element_counts[1:] == tuple(len(table) for table in self.model.elements.values())

    def check_relations(self):
        oracle = Oracle(self.session, self.model)
        for origin, target in itertools.product(KINDS, KINDS):
            found = self.session.neighbors(origin, target).to_dict()
            assert {i: set(row) for i, row in found.items()} == oracle.relation(origin, target), (
                origin,
                target,
            )
        for kind in KINDS[:3]:
            assert set(self.session.boundary(kind).tolist()) == oracle.boundary(kind)

    def committed(self, tx):
        self.revision += 1
        assert tx.result.revision == self.revision

    def learn_vertices(self, ids, points):
        assert not set(ids.tolist()) & set(self.model.vertices)
        self.model.vertices.update(zip(ids.tolist(), points))

    def learn_elements(self, element_type, ids, rows):
        table = self.model.elements[element_type.kind]
        assert len(set(ids.tolist()) - set(table)) == len(rows)
        for slot, nodes in zip(ids.tolist(), rows):
            table[slot] = (element_type, tuple(int(v) for v in nodes))


def test_random_edits_leave_everybody_agreed(client):
    SessionMachine.client = client
    run_state_machine_as_test(
        SessionMachine,
        settings=settings(max_examples=2 * settings.default.max_examples, stateful_step_count=30),
    )
