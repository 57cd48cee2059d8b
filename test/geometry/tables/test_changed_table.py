"""A table made from the one before is the one that is built of the same shapes."""

import numpy as np
import pytest

from scene_graph_ros.geometry import Box, Convex, HalfSpace, Mesh, Sphere
from scene_graph_ros.geometry.tables import changed_table as module
from scene_graph_ros.geometry.tables.changed_table import changed_table
from scene_graph_ros.geometry.tables.shape_table import build_shape_table

CORNERS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
# The bottom is missing, so that it is not the surface of its hull.
OPEN = Mesh(vertices=CORNERS, faces=[[0, 1, 3], [0, 3, 2], [1, 2, 3]])
WEDGE = Convex(vertices=CORNERS, scale=2.0)
BALL, BRICK, GROUND = Sphere(1.0 / 3.0), Box(0.1, 0.2, 0.3), HalfSpace()
SHAPES = [BALL, OPEN, BRICK, WEDGE, GROUND, OPEN]
EXACT = [False, True, False, False, False, False]

CHANGES = {
    "nothing": (SHAPES, EXACT),
    "a sphere comes": ([*SHAPES, Sphere(0.7)], [*EXACT, False]),
    "a sphere comes between": ([Sphere(0.7), *SHAPES], [False, *EXACT]),
    "a box goes": (SHAPES[:2] + SHAPES[3:], EXACT[:2] + EXACT[3:]),
    "one of two meshes goes": (SHAPES[:5], EXACT[:5]),
    "all of a mesh goes": ([BALL, BRICK, WEDGE], [False] * 3),
    "meshes change places": ([BALL, WEDGE, BRICK, OPEN], [False, False, False, True]),
    "another mesh comes": ([*SHAPES, Convex(vertices=3.0 * CORNERS)], [*EXACT, False]),
    "a mesh is exact from now on": (SHAPES, [*EXACT[:5], True]),
    "all shapes go": ([], []),
    "all shapes are others": ([Sphere(0.7), Box(1.0, 1.0, 1.0)], [False, False]),
}


def arrays_of(table):
    """Return all arrays of a table, those of hulls and surfaces included."""
    for column in table:
        yield from column if isinstance(column, tuple) else (column,)


@pytest.mark.parametrize("change", CHANGES)
def test_a_changed_table_is_the_one_that_is_built_anew(change):
    """Bit for bit, with types and layout, so that kernels read the same."""
    shapes, exact = CHANGES[change]
    changed = changed_table(changed_table(None, SHAPES, EXACT), shapes, exact)
    assert (changed.shapes, changed.exact) == (shapes, exact)
    expected = build_shape_table(shapes, exact)
    for ours, theirs in zip(arrays_of(changed.table), arrays_of(expected), strict=True):
        assert (ours.dtype, ours.shape) == (theirs.dtype, theirs.shape)
        assert ours.tobytes() == theirs.tobytes()
        assert ours.flags.c_contiguous
        assert ours.flags.writeable


@pytest.mark.parametrize("change", ["a sphere comes between", "a box goes"])
def test_meshes_that_stay_are_not_packed_anew(change, monkeypatch):
    """Nothing is built but the rows of what is new."""
    before = changed_table(None, SHAPES, EXACT)
    built = []

    def build(shapes, exact):
        built.extend(shapes)
        return build_shape_table(shapes, exact)

    monkeypatch.setattr(module, "build_shape_table", build)
    shapes, exact = CHANGES[change]
    changed = changed_table(before, shapes, exact)
    assert built == [shape for shape in shapes if shape not in SHAPES]
    assert changed.table.hulls is before.table.hulls
    assert changed.table.surfaces is before.table.surfaces
