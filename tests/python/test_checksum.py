"""The numpy and the native checksum agree with each other and with the definition."""

import numpy as np
import pytest
from dynmesh import ElementType, checksum
from dynmesh.delta import element_rows
from hypothesis import given
from hypothesis import strategies as st

MASK = (1 << 64) - 1
native = pytest.importorskip("dynmesh._native")


def mix(z: int) -> int:
    """The finaliser of SplitMix64 in integers without a width."""
    z = (z + 0x9E3779B97F4A7C15) & MASK
    z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & MASK
    z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & MASK
    return z ^ (z >> 31)


def fold(*words: int) -> int:
    """The term of the words of one entity."""
    h = 0
    for word in words:
        h = mix(h ^ word)
    return h


slots = st.integers(0, 2**32 - 2)
finite = st.floats(allow_nan=False, allow_infinity=False)


@st.composite
def elements(draw):
    """Slots, types and rows of some elements."""
    types = draw(st.lists(st.sampled_from(list(ElementType)), max_size=8))
    nodes = [draw(st.lists(slots, min_size=t.num_vertices, max_size=t.num_vertices)) for t in types]
    ids = draw(st.lists(slots, min_size=len(types), max_size=len(types)))
    return types, ids, nodes


@given(elements())
def test_element_terms_are_as_defined(given_elements):
    types, ids, nodes = given_elements
    expected = (
        sum(fold(t.kind.dimension << 40 | t << 32 | i, *n) for t, i, n in zip(types, ids, nodes)) & MASK
    )
    type_array, id_array = np.array(types, np.uint8), np.array(ids, np.uint32)
    rows = element_rows(type_array, np.array([v for n in nodes for v in n], np.uint32), 8)
    assert checksum.element_sum_numpy(type_array, id_array, rows) == expected
    assert native.element_sum(type_array, id_array, rows) == expected


@given(st.lists(st.tuples(slots, finite, finite, finite), max_size=8))
def test_vertex_terms_are_as_defined(vertices):
    ids = np.array([v[0] for v in vertices], np.uint32)
    points = np.array([v[1:] for v in vertices], float).reshape(-1, 3)
    bits = points.view(np.uint64).tolist()
    assert checksum.vertex_sum(ids) == sum(fold(i) for i in ids.tolist()) & MASK
    expected = sum(fold(i, *b) for i, b in zip(ids.tolist(), bits)) & MASK
    assert checksum.position_sum_numpy(ids, points) == expected
    assert native.position_sum(ids, points) == expected


def test_minus_zero_is_not_zero():
    ids = np.zeros(1, np.uint32)
    plus, minus = np.zeros((1, 3)), np.full((1, 3), -0.0)
    assert checksum.position_sum(ids, plus) != checksum.position_sum(ids, minus)


@pytest.mark.parametrize(
    ("types", "ids", "rows"),
    [([8], [0], [[0] * 8]), ([0], [0], [[0] * 8]), ([7], [0], [[0] * 4]), ([2, 2], [0], [[0] * 3])],
)
def test_the_native_sum_refuses_what_would_read_past_its_arrays(types, ids, rows):
    with pytest.raises(ValueError):
        native.element_sum(np.array(types, np.uint8), np.array(ids, np.uint32), np.array(rows, np.uint32))
