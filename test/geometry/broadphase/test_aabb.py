import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from scene_graph_ros.geometry import (
    Box,
    Capsule,
    Convex,
    Cylinder,
    Ellipsoid,
    HalfSpace,
    Sphere,
)
from scene_graph_ros.geometry.broadphase.aabb import MAX_HULL_VERTICES, world_boxes
from scene_graph_ros.geometry.tables.shape_table import build_shape_table


def _poses(n, seed, offset=0.0):
    X = np.tile(np.eye(4), (n, 1, 1))
    X[:, :3, :3] = Rotation.random(n, rng=np.random.default_rng(seed)).as_matrix()
    X[:, :3, 3] = np.random.default_rng(seed).normal(size=(n, 3)) + offset
    return X


def _support(shape, d):
    """Return how far the shape reaches along unit vectors d (3, k) in G, from its definition."""
    match shape:
        case Sphere():
            return np.full(d.shape[1], shape.radius)
        case Capsule():
            return shape.radius + np.abs(d[2]) * shape.length / 2
        case Box():
            return np.abs(d).T @ shape.size / 2
        case Cylinder():
            return shape.radius * np.hypot(d[0], d[1]) + np.abs(d[2]) * shape.length / 2
        case Ellipsoid():
            return np.linalg.norm(d.T * [shape.a, shape.b, shape.c], axis=1)
    return (shape.vertices @ d).max(axis=0)


_SHAPES = [
    Sphere(1 / 3),
    Capsule(0.1, 0.7),
    Box(0.2, 0.5, 1.1),
    Cylinder(0.3, 0.5),
    Ellipsoid(0.1, 0.4, 0.9),
    Convex(vertices=np.random.default_rng(0).normal((1.0, 2.0, 3.0), size=(20, 3))),
]


@pytest.mark.parametrize("offset", [0.0, 1e6])
@pytest.mark.parametrize("shape", _SHAPES, ids=lambda s: type(s).__name__)
def test_box_is_tight_and_rounded_outwards(shape, offset):
    """The box ends at the support points along the world's axes, and never before."""
    X_WG = _poses(50, seed=3, offset=offset)
    lower, upper = world_boxes(build_shape_table([shape] * 50, [False] * 50), X_WG)
    reach = np.array([_support(shape, X[:3, :3].T) for X in X_WG])
    reach_down = np.array([_support(shape, -X[:3, :3].T) for X in X_WG])
    rounding = 1e-14 * (10.0 + offset)
    for bound, exact in ((upper, X_WG[:, :3, 3] + reach), (-lower, reach_down - X_WG[:, :3, 3])):
        assert (bound >= exact).all()
        assert (bound <= exact + rounding).all()


def test_large_hull_is_bounded_by_its_turned_box():
    """A hull with many vertices gets a looser box, which still holds all of them."""
    points = np.random.default_rng(1).normal(size=(500, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    assert len(points) > MAX_HULL_VERTICES
    X_WG = _poses(10, seed=4)
    lower, upper = world_boxes(build_shape_table([Convex(vertices=points)] * 10, [0] * 10), X_WG)
    for X, low, high in zip(X_WG, lower, upper, strict=True):
        placed = points @ X[:3, :3].T + X[:3, 3]
        assert (placed >= low).all()
        assert (placed <= high).all()


def test_half_space_is_unbounded():
    """A half space is bounded on no side, however it is turned."""
    lower, upper = world_boxes(build_shape_table([HalfSpace()], [False]), _poses(1, seed=5))
    assert (lower == -np.inf).all()
    assert (upper == np.inf).all()
