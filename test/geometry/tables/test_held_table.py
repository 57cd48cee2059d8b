"""A table handed to kernels as one array is the table that it was made of."""

import numpy as np
import pytest

from scene_graph_ros.geometry import Box, Convex, Sphere
from scene_graph_ros.geometry.compiled.kernel import lean_kernel
from scene_graph_ros.geometry.tables.held_table import borrowed_table, hold
from scene_graph_ros.geometry.tables.shape_table import build_shape_table

CORNERS = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 3.0]])


@lean_kernel
def _sums(places):
    table = borrowed_table(places)
    size = 0.0
    for i in range(table.size.shape[0]):
        for axis in range(3):
            size += table.size[i, axis]
    corners = 0.0
    for v in range(table.hulls.vertices.shape[0]):
        for axis in range(3):
            corners += table.hulls.vertices[v, axis]
    return table.kind.shape[0], size, corners


def test_kernel_reads_the_arrays_of_a_held_table():
    """Lengths and numbers are the table's, also after another table was held."""
    shapes = [Sphere(0.5), Box(0.2, 0.4, 0.6), Convex(vertices=CORNERS)]
    held = hold(build_shape_table(shapes, [False] * 3))
    other = hold(build_shape_table([Sphere(2.0)], [False]))
    assert _sums(held.places) == pytest.approx((3, 0.5 + 0.6, 6.0))
    assert _sums(other.places) == pytest.approx((1, 2.0, 0.0))
    held.table.size[0, 0] = 1.5
    assert _sums(held.places)[1] == pytest.approx(1.5 + 0.6)


def test_other_arrays_than_a_tables_are_refused():
    """A read-only array, or one of another type, is not what the kernels were compiled for."""
    table = build_shape_table([Sphere(0.5)], [False])
    size = table.size.copy()
    size.setflags(write=False)
    with pytest.raises(TypeError, match="build_shape_table"):
        hold(table._replace(size=size))
    with pytest.raises(TypeError, match="build_shape_table"):
        hold(table._replace(kind=table.kind.astype(np.int64)))
