"""Balls inside of cores, and the proof by them that no depth is less than a known one."""

from convex_bodies import plain_core, rounded_hull, support
import numpy as np
import pytest

from scene_graph_ros.geometry import Box, Cylinder, Ellipsoid
from scene_graph_ros.geometry.narrowphase.cores import questions
from scene_graph_ros.geometry.narrowphase.pair import at_origin, Pair
from scene_graph_ros.geometry.narrowphase.prove import inner_ball
from scene_graph_ros.geometry.tables.shape_table import build_shape_table


def read(function):
    """Return a kernel as plain Python."""
    return getattr(function, "py_func", function)


def directions(count):
    """Return unit vectors all around, the axes among them."""
    d = np.vstack([np.random.default_rng(3).normal(size=(count, 3)), np.eye(3), -np.eye(3)])
    return d / np.linalg.norm(d, axis=1)[:, None]


def largest_ball(shape, q, m):
    """Return the least r over many planes: q - r m is r from the plane across d where it touches.

    An upper bound of the radius, near to it where a tangent plane that stops it is among them.
    """
    d = directions(4000)
    room = np.array([support(shape, x) for x in d]) - d @ q
    opening = 1.0 - d @ m
    return (room[opening > 1e-6] / opening[opening > 1e-6]).min()


def contacts(shape):
    """Return points of the surface that have one normal, with it."""
    if isinstance(shape, Box):
        half = 0.5 * np.array([shape.width, shape.depth, shape.height])
        for k in range(3):
            q = half * np.array([0.3, -0.6, 0.8])
            q[k] = -half[k]
            yield q, -np.eye(3)[k]
    elif isinstance(shape, Cylinder):
        yield np.array([0.6, 0.8, 0.0]) * shape.radius + [0, 0, 0.2 * shape.length], [0.6, 0.8, 0]
        yield np.array([0.02, 0.03, 0.5 * shape.length]), [0.0, 0.0, 1.0]
    else:
        axes = np.array([shape.a, shape.b, shape.c])
        for d in directions(20):
            yield axes**2 * d / np.linalg.norm(axes * d), d


@pytest.mark.parametrize(
    "shape",
    [Box(0.2, 0.3, 0.4), Cylinder(0.1, 0.3), Cylinder(0.3, 0.1), Ellipsoid(0.1, 0.2, 0.3)],
    ids=repr,
)
def test_ball_is_inside_and_cannot_be_larger(shape):
    """No plane cuts the ball; for flat and round surfaces one touches it (20 cm: to 1 mm)."""
    core = plain_core(build_shape_table([shape], [False]), 0)
    for q, m in contacts(shape):
        q, m = np.array(q), np.array(m, dtype=float)
        radius = read(questions.placed_inner_radius)(
            read(at_origin)(core), np.zeros(0), tuple(q), tuple(m)
        )
        bound = largest_ball(shape, q, m)
        assert 0.0 < radius <= bound + 1e-12
        if not isinstance(shape, Ellipsoid):
            assert radius >= bound - 1e-3


def test_ball_at_a_face_of_a_hull():
    """The largest ball at a face's centre touches another face, and no plane cuts it."""
    shape = rounded_hull(0.2, 40)
    table = build_shape_table([shape], [False])
    hulls, core = table.hulls, plain_core(table, 0)
    for f in range(0, len(hulls.face_offsets), 5):
        rows = hulls.face_vertices[slice(*hulls.face_vertex_start[f : f + 2])]
        q, m = hulls.vertices[rows].mean(axis=0), hulls.face_normals[f]
        radius = read(questions.placed_inner_radius)(
            read(at_origin)(core), hulls.blocks, tuple(q), tuple(m)
        )
        centre = q - radius * m
        room = hulls.face_offsets - hulls.face_normals @ centre - radius
        assert radius > 0.0
        assert room.min() == pytest.approx(0.0, abs=1e-13)
        assert np.sum(room < 1e-12) >= 2


def test_no_ball_at_edges_and_corners():
    """Where the surface has many normals, or the normal given is none, there is no ball."""
    box = plain_core(build_shape_table([Box(0.2, 0.2, 0.2)], [False]), 0)
    rim = plain_core(build_shape_table([Cylinder(0.1, 0.2)], [False]), 0)
    s = np.sqrt(0.5)
    radius = read(questions.placed_inner_radius)
    none = np.zeros(0)
    assert radius(read(at_origin)(box), none, (0.1, 0.1, 0.0), (s, s, 0.0)) == 0.0
    assert radius(read(at_origin)(rim), none, (0.1, 0.0, 0.1), (s, 0.0, s)) == 0.0


@pytest.mark.parametrize(("depth", "expected"), [(0.02, True), (0.05, True), (0.11, False)])
def test_depth_of_a_corner_below_a_face(depth, expected):
    """A corner below the middle of a face leaves through it as long as all others are deeper.

    The other box is so small that its corner alone counts; the box is 0.2 m thick.
    """
    table = build_shape_table([Box(0.6, 0.6, 0.2), Box(0.6, 0.6, 0.6)], [False, False])
    core_A, core_B = plain_core(table, 0), plain_core(table, 1)
    a, b = (0.0, 0.0, 0.1), (0.0, 0.0, 0.1 - depth)
    # B stands on its corner (-0.3, -0.3, -0.3), which is at b.
    z = np.ones(3) / np.sqrt(3.0)
    x = np.array([1.0, -1.0, 0.0]) / np.sqrt(2.0)
    R = np.array([x, np.cross(z, x), z])
    p = np.array(b) - R @ np.full(3, -0.3)
    pair = Pair(core_A, core_B, tuple(R.ravel()), tuple(p), np.zeros(0))
    found = read(inner_ball.is_least_depth)(pair, a, b, (0.0, 0.0, -1.0), depth, 0.6)
    assert found is expected or found == expected
