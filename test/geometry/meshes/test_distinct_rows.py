"""Rows that differ, against what they are by definition and against numpy."""

from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
import numpy as np

from scene_graph_ros.geometry.meshes.distinct_rows import distinct_rows, used_indices

FEW = st.sampled_from([-1.5, -0.0, 0.0, 1.0, 2.0])
"""So few values that rows are equal often."""

SHAPES = st.tuples(st.integers(0, 30), st.integers(1, 3))


@given(arrays.arrays(np.float64, SHAPES, elements=FEW))
def test_each_row_is_found_once_in_order_and_where_it_was(rows):
    """The rows ascend, are those that are first, and make up all that was given."""
    found = distinct_rows(rows)
    assert np.array_equal(found.rows[found.inverse], rows)
    assert found.rows.tobytes() == rows[found.first].tobytes()
    listed = [tuple(row) for row in found.rows.tolist()]
    assert listed == sorted(set(listed))
    for row, first in zip(listed, found.first.tolist(), strict=True):
        assert row not in [tuple(before) for before in rows[:first].tolist()]


@given(arrays.arrays(np.int64, SHAPES, elements=st.integers(-3, 3)))
def test_rows_of_integers_are_as_numpy_finds_them(rows):
    """The same rows, places and inverse as ``np.unique``."""
    expected = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    for ours, theirs in zip(distinct_rows(rows), expected, strict=True):
        assert np.array_equal(ours, theirs)


def test_used_indices_are_counted_anew():
    """Of 0 to 7 here 2, 5 and 6 occur, which become 0, 1 and 2."""
    used, anew = used_indices(np.array([[5, 2, 6], [6, 5, 5]]), 8)
    assert used.tolist() == [2, 5, 6]
    assert anew.tolist() == [[1, 0, 2], [2, 1, 1]]


def test_nothing_is_used_of_nothing():
    """Without indices there are none, in the shape that was given."""
    used, anew = used_indices(np.empty((0, 2), dtype=np.int64), 3)
    assert used.shape == (0,)
    assert anew.shape == (0, 2)
