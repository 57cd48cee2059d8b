"""Support points of cores."""

from convex_bodies import plain_core, rounded_hull, support
import numpy as np
import pytest

from scene_graph_ros.geometry import Box, Convex, Cylinder, Ellipsoid
from scene_graph_ros.geometry.narrowphase.cores.kinds import TRIANGLE
from scene_graph_ros.geometry.narrowphase.pair import Pair, Workspace
from scene_graph_ros.geometry.narrowphase.propose.gjk import store_support
from scene_graph_ros.geometry.tables.hull_blocks import CLIMB_LIMIT, vertex_number, vertex_place
from scene_graph_ros.geometry.tables.shape_table import build_shape_table

IDENTITY = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
PLACE, NUMBER = (getattr(f, "py_func", f) for f in (vertex_place, vertex_number))
CORNERS = (0.1, 0.0, 0.0, 0.0, 0.2, 0.0, 0.0, 0.0, 0.3)


def support_point(core, hulls, d, hint=-1):
    """Return the support point of a core against a point at the origin."""
    point = (0, -1, 0.0, (0.0,) * 9)
    S, ids = np.zeros((1, 9)), np.zeros((1, 2), np.int64)
    minus_d = tuple(-float(x) for x in d)
    read = getattr(store_support, "py_func", store_support)
    pair = Pair(core, point, IDENTITY, (0.0, 0.0, 0.0), hulls)
    read(pair, minus_d, Workspace(S, ids, np.zeros(4)), 0, (hint, -1))
    return S[0, 3:6], int(ids[0, 0])


@pytest.mark.parametrize(
    "shape",
    [Box(0.2, 0.3, 0.4), Cylinder(0.1, 0.3), Ellipsoid(0.1, 0.2, 0.3), rounded_hull(0.2, 500)],
    ids=lambda s: type(s).__name__,
)
def test_support_point_reaches_the_support_value(shape):
    """The point lies as far along every direction as the body does."""
    table = build_shape_table([shape], [False])
    core = plain_core(table, 0)
    directions = np.vstack([np.random.default_rng(0).normal(size=(200, 3)), np.eye(3), -np.eye(3)])
    for d in directions:
        point, _ = support_point(core, table.hulls.blocks, d)
        assert d @ point == pytest.approx(support(shape, d), rel=1e-15, abs=1e-16)


def test_climb_from_any_vertex_ends_at_the_same_height():
    """A large hull's climb does not depend on the vertex it starts from."""
    shape = rounded_hull(0.2, 700)
    table = build_shape_table([shape], [False])
    count = table.hulls.vertex_start[1]
    assert count > CLIMB_LIMIT
    d = np.array([0.3, -0.7, 0.2])
    for start in range(0, count, 41):
        hint = PLACE(0, start)
        point, place = support_point(plain_core(table, 0), table.hulls.blocks, d, hint)
        assert d @ point == pytest.approx(support(shape, d), rel=1e-15)
        assert np.array_equal(point, table.hulls.vertices[NUMBER(0, place)])


def test_climb_over_a_fine_grid_of_a_plateau():
    """Directions orthogonal to a face of a many-sided prism, where many vertices tie."""
    angle = np.linspace(0.0, 2.0 * np.pi, 301)[:-1]
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    points = np.vstack([np.column_stack([ring, np.full(300, z)]) for z in (-1.0, 1.0)])
    table = build_shape_table([Convex(vertices=points)], [False])
    for d in np.vstack([np.eye(3), -np.eye(3)]):
        for start in range(0, 600, 47):
            hint = PLACE(0, start)
            point, _ = support_point(plain_core(table, 0), table.hulls.blocks, d, hint)
            assert d @ point == pytest.approx(1.0, abs=1e-15)


def test_triangle_core_returns_its_corners():
    """A triangle's support points are its corners, and the index says which."""
    hulls = build_shape_table([Box(1.0, 1.0, 1.0)], [False]).hulls.blocks
    core = (TRIANGLE, -1, 0.0, CORNERS)
    for k, d in enumerate(np.eye(3)):
        point, index = support_point(core, hulls, d)
        assert index == k
        assert np.array_equal(point, np.reshape(CORNERS, (3, 3))[k])


def test_zero_direction_gives_a_point_of_the_body():
    """No direction is no reason for NaN."""
    for shape in (Box(0.2, 0.3, 0.4), Cylinder(0.1, 0.3), Ellipsoid(0.1, 0.2, 0.3)):
        table = build_shape_table([shape], [False])
        point, _ = support_point(plain_core(table, 0), table.hulls.blocks, (0.0, 0.0, 0.0))
        assert np.isfinite(point).all()
