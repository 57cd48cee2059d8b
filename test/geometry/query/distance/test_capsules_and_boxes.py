"""Spheres, capsules and boxes against each other: known answers, and hulls of differences."""

import math

from hypothesis import given, settings
from hypothesis import strategies as st
from measuring import box_vertices, measure_both_ways, polytope_distance, pose
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from scene_graph_ros.geometry import Box, Capsule, Cylinder, Ellipsoid, Sphere
from scene_graph_ros.geometry.query.distance.distance_capsule_box import distance_capsule_box

QUARTER = np.pi / 2


@pytest.mark.parametrize("scale", [1e-4, 1.0, 1e4])
@pytest.mark.parametrize("gap", [-0.3, -0.002, 0.0, 1e-9, 0.002, 3.0])
def test_spheres(scale, gap):
    """Two spheres are their centres' distance apart, minus both radii."""
    direction = np.array([2.0, -3.0, 6.0]) / 7
    a, b = scale / 3, scale * 2 / 7
    X_WB = pose((a + b + scale * gap) * direction)
    pair = measure_both_ways(Sphere(a), Sphere(b), pose(), X_WB)
    assert pair.distance == pytest.approx(scale * gap, abs=2e-15 * scale * 4)
    np.testing.assert_allclose(pair.nhat_BA_W, -direction, atol=1e-15)
    np.testing.assert_allclose(pair.p_WCa, a * direction, atol=2e-15 * scale)
    assert pair.unique


def test_concentric_spheres():
    """Concentric spheres overlap by the sum of their radii, in a direction that is a choice."""
    pair = measure_both_ways(Sphere(1 / 3), Sphere(0.2), pose(), pose())
    assert pair.distance == pytest.approx(-1 / 3 - 0.2, abs=1e-15)
    assert not pair.unique


@pytest.mark.parametrize(
    ("shape", "p", "distance"),
    [
        (Capsule(0.1, 0.6), (0.3, 0.4, 0.2), 0.5 - 0.1 - 0.25),
        (Capsule(0.1, 0.6), (0.0, 0.0, 0.2), -0.1 - 0.25),
        (Box(0.2, 0.4, 0.6), (0.1 + 0.3, 0.1, -0.3 - 0.4), 0.5 - 0.25),
        (Box(0.2, 0.4, 0.6), (0.05, 0.0, 0.0), -0.05 - 0.25),
        (Cylinder(0.3, 0.4), (0.3 + 0.6, 0.0, 0.2 + 0.8), 1.0 - 0.25),
        (Cylinder(0.3, 0.4), (0.1, 0.0, -0.15), -0.05 - 0.25),
        (Ellipsoid(0.2, 0.3, 0.4), (0.0, 0.0, 1.0), 0.6 - 0.25),
        (Ellipsoid(0.2, 0.3, 0.4), (0.0, 0.0, 0.0), -0.2 - 0.25),
    ],
)
def test_sphere_with_its_centre_anywhere(shape, p, distance):
    """A sphere is as far as its centre minus its radius, also with the centre inside."""
    X_WG = pose((1 / 3, 0.2, -0.5), (0.2, 0.5, -0.4))
    X_WS = X_WG @ pose(p)
    pair = measure_both_ways(Sphere(0.25), shape, X_WS, X_WG)
    assert pair.distance == pytest.approx(distance, abs=2e-15)
    assert np.linalg.norm(pair.p_WCa - X_WS[:3, 3]) == pytest.approx(0.25, abs=2e-15)


@pytest.mark.parametrize(
    ("p", "turn", "distance", "nhat", "unique"),
    [
        # Axes: A along z from -0.5 to 0.5, B of half length 0.25; radii 0.1 and 0.2.
        ((0.6, 0, 0.4), (0, 0, 0), 0.3, (-1, 0, 0), True),  # parallel, side by side
        ((0, 0, 1.25), (0, 0, 0), 0.2, (0, 0, -1), True),  # on one line, apart
        ((0.3, 0, 1.15), (0, 0, 0), 0.5 - 0.3, (-0.6, 0, -0.8), True),  # parallel, past the end
        ((0, 0.5, 0.1), (0, QUARTER, 0), 0.2, (0, -1, 0), True),  # crossing at a distance
        ((0, 0.05, 0.1), (0, QUARTER, 0), -0.25, (0, -1, 0), True),  # crossing closely
        ((0.65, 0, 0), (0, QUARTER, 0), 0.1, (-1, 0, 0), True),  # B's end against A's side
        ((0, 0, 0.1), (0, QUARTER, 0), -0.3, (0, 1, 0), False),  # axes cross: along z_A x z_B
        ((0, 0, 0.3), (0, 0, 0), -0.3, None, False),  # axes overlap
    ],
)
def test_capsules_by_position(p, turn, distance, nhat, unique):
    """Parallel, crossing, aligned and overlapping capsules give the constructed answer."""
    X_WA = pose((0.2, -1 / 3, 0.1), (0.3, -0.7, 0.4))
    pair = measure_both_ways(Capsule(0.1, 1.0), Capsule(0.2, 0.5), X_WA, X_WA @ pose(p, turn))
    assert pair.distance == pytest.approx(distance, abs=4e-15)
    assert pair.unique is unique
    if nhat is not None:
        np.testing.assert_allclose(X_WA[:3, :3].T @ pair.nhat_BA_W, nhat, atol=1e-14)


def test_parallel_capsules_touch_half_way():
    """The witnesses of parallel capsules are in the middle of their overlap.

    A covers z in [-0.5, 0.5], B in [0.15, 0.65]: the middle of [0.15, 0.5] is 0.325.
    """
    pair = measure_both_ways(Capsule(0.1, 1.0), Capsule(0.2, 0.5), pose(), pose((0.6, 0, 0.4)))
    np.testing.assert_allclose(pair.p_WCa, (0.1, 0, 0.325), atol=1e-15)
    np.testing.assert_allclose(pair.p_WCb, (0.4, 0, 0.325), atol=1e-15)


@pytest.mark.parametrize("length", [1e-6, 3e-4, 0.1])
def test_capsule_whose_end_touches_an_edge_has_its_witness_there(length):
    """However little it is tilted: its other end, which is as deep to rounding, is beside."""
    rng = np.random.default_rng(1)
    h = np.array([0.11, 0.1, 0.065])
    for _ in range(200):
        tilt = 10.0 ** rng.uniform(-15.0, -11.0, 2) * rng.choice([-1.0, 1.0], 2)
        u = 0.5 * length * np.array([tilt[0], -1.0, tilt[1]])
        c = np.array([h[0], h[1], rng.uniform(-h[2], h[2])]) - u
        c[:2] += 2e-17 * rng.integers(-3, 4, 2)
        # Along the capsule's own axis, z: R_AB is made of the box's axes in the capsule's frame.
        z = u / np.linalg.norm(u)
        x = np.cross([0.0, 0.0, 1.0], z)
        x /= np.linalg.norm(x)
        R = np.array([x, np.cross(z, x), z])
        phi, p_ACa, p_ACb, _, _ = distance_capsule_box(
            (0.001, 0.5 * length, 0.0), tuple(h), tuple(R.ravel()), tuple(-R @ c)
        )
        assert phi == pytest.approx(-0.001, abs=2e-15)
        assert np.all(np.abs(R.T @ np.array(p_ACb) + c) <= h + 2e-15)
        assert math.dist(p_ACa, (0.0, 0.0, 0.5 * length)) == pytest.approx(0.001, abs=2e-15)


@pytest.mark.parametrize("angle", 10.0 ** -np.arange(1, 17))
@pytest.mark.parametrize("height", [1e-12, 1e-6, 0.002, 0.5])
def test_nearly_parallel_axes(angle, height):
    """Two axes that cross at a height stay that high above each other at any angle."""
    X_WB = pose((0, height, 0), (0, angle, 0))
    pair = measure_both_ways(Capsule(0.1, 1.0), Capsule(0.2, 1.2), pose(), X_WB)
    assert pair.distance == pytest.approx(height - 0.3, abs=1e-15)
    if angle > 1e-9:
        np.testing.assert_allclose(pair.nhat_BA_W, (0, -1, 0), atol=1e-6)


@pytest.mark.parametrize("angle", [1e-9, 1e-11, 1e-13, 3e-14, 1e-15, 0.0])
@pytest.mark.parametrize("offset", [0.0, 1e-12, 1e-9, 1e-6])
def test_nearly_coinciding_axes_keep_witnesses_on_the_surface(angle, offset):
    """Where axes nearly coincide, the witnesses stay a radius away from their axes."""
    X_AB = pose((offset, 0.3 * offset, 1 / 3), (angle, 0.7 * angle, 0))
    pair = measure_both_ways(Capsule(0.178, 0.231), Capsule(1.0, 1.0), pose(), X_AB)
    for radius, half, p, X in ((0.178, 0.1155, pair.p_WCa, pose()), (1.0, 0.5, pair.p_WCb, X_AB)):
        q = X[:3, :3].T @ (p - X[:3, 3])
        distance = np.linalg.norm(q - (0, 0, np.clip(q[2], -half, half)))
        assert distance == pytest.approx(radius, abs=4e-15)


@settings(max_examples=150, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_capsule_and_box_against_the_hull_of_differences(seed):
    """A capsule is a segment and a radius: the hull of segment minus box gives the truth."""
    rng = np.random.default_rng(seed)
    X_WA, X_WB, size = _random_pair(rng)
    radius, length = rng.uniform(0.05, 0.5, 2)
    ends = np.array([(0, 0, length / 2), (0, 0, -length / 2)]) @ X_WA[:3, :3].T + X_WA[:3, 3]
    truth = polytope_distance(ends, box_vertices(size, X_WB)) - radius
    pair = measure_both_ways(Capsule(radius, length), Box(*size), X_WA, X_WB)
    assert pair.distance == pytest.approx(truth, abs=2e-14)


@settings(max_examples=150, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_boxes_against_the_hull_of_differences(seed):
    """The hull of the differences of two boxes' corners gives their signed distance."""
    rng = np.random.default_rng(seed)
    X_WA, X_WB, size = _random_pair(rng)
    other = rng.uniform(0.1, 0.8, 3)
    truth = polytope_distance(box_vertices(other, X_WA), box_vertices(size, X_WB))
    pair = measure_both_ways(Box(*other), Box(*size), X_WA, X_WB)
    assert pair.distance == pytest.approx(truth, abs=2e-14)
    for p_WC, X, extents in ((pair.p_WCa, X_WA, other), (pair.p_WCb, X_WB, size)):
        inside = np.abs(X[:3, :3].T @ (p_WC - X[:3, 3])) - extents / 2
        assert abs(inside.max()) <= 1e-13


def _random_pair(rng):
    """Return two poses, turned anyhow, a little, by quarters or not, and a box's extents."""
    turns = [
        Rotation.random(random_state=rng.integers(2**31)).as_rotvec(),
        rng.normal(size=3) * 10.0 ** -rng.uniform(1, 12),
        QUARTER * np.eye(3)[rng.integers(3)],
        np.zeros(3),
    ]
    X_WA = pose(rng.normal(size=3), rng.normal(size=3))
    X_AB = pose(rng.normal(size=3) * rng.choice([0.05, 0.3, 1.0]), turns[rng.integers(4)])
    return X_WA, X_WA @ X_AB, rng.uniform(0.1, 0.8, 3)


@pytest.mark.parametrize("gap", [-0.01, -1e-9, 0.0, 1e-9, 0.002])
def test_stacked_boxes_touch_in_the_middle(gap):
    """Faces flat on each other touch in the centroid of what they share, turned by any angle.

    The upper box covers x in [0.1, 0.7], the lower [-0.5, 0.5]: the middle is 0.3.
    """
    X_WL = pose((0.2, 1 / 3, -0.1), (0.4, 0.2, -0.6))
    X_WU = X_WL @ pose((0.4, 0.0, 0.5 + 0.25 + gap))
    pair = measure_both_ways(Box(0.6, 0.4, 0.5), Box(1, 1, 1), X_WU, X_WL)
    assert pair.distance == pytest.approx(gap, abs=2e-15)
    np.testing.assert_allclose(pair.nhat_BA_W, X_WL[:3, 2], atol=1e-15)
    expected = X_WL @ np.array([0.3, 0.0, 0.5, 1.0])
    np.testing.assert_allclose(pair.p_WCb, expected[:3], atol=1e-14)


def test_crossed_edges():
    """Two cubes edge to edge, a quarter turned, touch where the edges cross."""
    half_diagonal = np.sqrt(0.5)
    A = pose((0, 0, half_diagonal + 0.002)) @ pose((0, 0, 0), (np.pi / 4, 0, 0))
    B = pose((0.1, 0.2, -half_diagonal)) @ pose((0, 0, 0), (0, np.pi / 4, 0))
    pair = measure_both_ways(Box(1, 1, 1), Box(1, 1, 1), A, B)
    assert pair.distance == pytest.approx(0.002, abs=1e-15)
    np.testing.assert_allclose(pair.nhat_BA_W, (0, 0, 1), atol=1e-14)
    np.testing.assert_allclose(pair.p_WCa, (0.1, 0.0, 0.002), atol=1e-14)
    np.testing.assert_allclose(pair.p_WCb, (0.1, 0.0, 0.0), atol=1e-14)


def test_corner_to_corner():
    """Cubes apart along their diagonal are as far as their corners."""
    gap = np.array([0.2, 0.3, 0.6])
    pair = measure_both_ways(Box(1, 1, 1), Box(1, 1, 1), pose(), pose(1 + gap))
    assert pair.distance == pytest.approx(0.7, abs=2e-15)
    np.testing.assert_allclose(pair.p_WCa, (0.5, 0.5, 0.5), atol=1e-15)
    np.testing.assert_allclose(pair.p_WCb, 0.5 + gap, atol=1e-15)


def test_concentric_cubes_choose():
    """Concentric equal cubes leave through a face, which is a choice."""
    pair = measure_both_ways(Box(1, 1, 1), Box(1, 1, 1), pose(), pose())
    assert pair.distance == pytest.approx(-1.0, abs=1e-15)
    assert not pair.unique


def test_max_distance_leaves_near_answers_alone():
    """A pair within ``max_distance`` has the same answer as without."""
    boxes = Box(1, 1, 1), Box(1, 1, 1), pose(), pose((1.2, 1.3, 1.6), (0.3, 0.2, 0.1))
    free = measure_both_ways(*boxes)
    bound = measure_both_ways(*boxes, max_distance=free.distance + 1e-9)
    assert bound.distance == free.distance
    np.testing.assert_array_equal(bound.p_WCa, free.p_WCa)
