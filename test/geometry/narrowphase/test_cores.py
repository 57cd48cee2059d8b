"""Support points of cores."""

from convex_bodies import plain_core, rounded_hull, support
import numpy as np
import pytest

from scene_graph_ros.geometry import Box, Convex, Cylinder, Ellipsoid
from scene_graph_ros.geometry.meshes.vertex_cells import CELL_LIMIT
from scene_graph_ros.geometry.narrowphase.cores.kinds import TRIANGLE
from scene_graph_ros.geometry.narrowphase.pair import Pair, Workspace
from scene_graph_ros.geometry.narrowphase.propose.gjk import store_support
from scene_graph_ros.geometry.tables.hull_blocks import vertex_number, vertex_place
from scene_graph_ros.geometry.tables.shape_table import build_shape_table

IDENTITY = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
PLACE, NUMBER = (getattr(f, "py_func", f) for f in (vertex_place, vertex_number))
CORNERS = (0.1, 0.0, 0.0, 0.0, 0.2, 0.0, 0.0, 0.0, 0.3)


def support_point(core, hulls, d):
    """Return the support point of a core against a point at the origin."""
    point = (0, -1, 0.0, (0.0,) * 9)
    S, ids = np.zeros((1, 9)), np.zeros((1, 2), np.int64)
    minus_d = tuple(-float(x) for x in d)
    read = getattr(store_support, "py_func", store_support)
    pair = Pair(core, point, IDENTITY, (0.0, 0.0, 0.0), hulls)
    read(pair, minus_d, Workspace(S, ids, np.zeros(4)), 0)
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


@pytest.mark.parametrize("count", [64, CELL_LIMIT, CELL_LIMIT + 1, 700, 3000])
def test_large_hulls_give_the_first_of_their_furthest_vertices(count):
    """Also where many lie as far, and along the borders of cells, where rounding may decide."""
    ball = np.random.default_rng(count).normal(size=(count, 3))
    ball /= np.linalg.norm(ball, axis=1)[:, None]
    check_supports(ball + np.array([3.0, 0.0, -2.0]), np.vstack([directions(), *ball[:50, None]]))


def test_large_hulls_of_other_forms():
    """A prism, many of whose vertices tie; a needle; a flat polygon; a ball far away."""
    angle = np.linspace(0.0, 2.0 * np.pi, 301)[:-1]
    ring = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(300)])
    up = np.array([0.0, 0.0, 1.0])
    prism = np.vstack([ring - up, ring + up])
    ball = np.random.default_rng(5).normal(size=(300, 3))
    ball /= np.linalg.norm(ball, axis=1)[:, None]
    for points in (prism, prism * [1e-6, 1e-6, 1.0], ring, ball + 1e6, 1e-5 * ball):
        check_supports(points, directions())


def directions():
    """Return directions: along axes, diagonals and borders of cells, and any others."""
    grid = np.stack(np.meshgrid(*[np.linspace(-1.0, 1.0, 9)] * 3), axis=-1).reshape(-1, 3)
    around = np.random.default_rng(0).normal(size=(500, 3))
    return np.vstack([grid[np.abs(grid).max(axis=1) > 0.0], around, 1e-200 * around[:5]])


def check_supports(points, along):
    """Check the support points of the points' hull, its vertices one by one being the truth."""
    table = build_shape_table([Convex(vertices=points)], [False])
    vertices = table.hulls.vertices
    for d in along:
        point, place = support_point(plain_core(table, 0), table.hulls.blocks, d)
        heights = [v[0] * d[0] + v[1] * d[1] + v[2] * d[2] for v in vertices]
        assert NUMBER(0, place) == int(np.argmax(heights))
        assert np.array_equal(point, vertices[NUMBER(0, place)])


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
