"""Every pair of the eight shapes through the dispatch, in both orders and in moved worlds."""

import itertools

from convex_bodies import (
    align,
    answer,
    pose,
    residuals,
    rounded_hull,
    separation,
    sites,
    tetrahedron_mesh,
)
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from scene_graph_ros.geometry import Box, Capsule, Cylinder, Ellipsoid, HalfSpace, Sphere
from scene_graph_ros.geometry.query.distance.driver import solve_pairs, WITHIN
from scene_graph_ros.geometry.query.distance.solved_pairs import BOTH, LOCAL, NO_FAILURE, WORLD
from scene_graph_ros.geometry.tables.held_table import hold
from scene_graph_ros.geometry.tables.shape_table import build_shape_table

BODIES = {
    "sphere": Sphere(1 / 9),
    "capsule": Capsule(1 / 15, 0.2),
    "box": Box(0.2, 1 / 6, 0.12),
    "cylinder": Cylinder(1 / 11, 0.2),
    "ellipsoid": Ellipsoid(0.1, 0.08, 1 / 15),
    "half space": HalfSpace(),
    "convex": rounded_hull(0.2, 40),
    "mesh": tetrahedron_mesh(0.2),
}
PAIRS = [p for p in itertools.product(BODIES, repeat=2) if p != ("half space", "half space")]
SIZE = 0.2
TOLERANCE = 1e-12 * SIZE
ROUND = {"smooth", "side", "face"}
X_WA = pose(Rotation.from_euler("xyz", [0.5, -0.2, 1.1]), [1 / 3, -0.7, 2.0])


def placements(name_A, name_B, distance):
    """Yield (X_AB, A's outward normal) of all feature pairs whose distance is constructed."""
    rng = np.random.default_rng(11)
    for site_A in sites(BODIES[name_A], rng):
        for site_B in sites(BODIES[name_B], rng):
            if distance > 0.0 or {site_A.feature, site_B.feature} & ROUND:
                yield align(site_A, site_B, distance, rng.uniform(0.3, 1.2)), site_A.normal


@pytest.mark.parametrize("distance", [2e-3, 1e-9, 0.0, -2e-3])
@pytest.mark.parametrize(("name_A", "name_B"), PAIRS)
def test_constructed_distance(name_A, name_B, distance):
    """Every pair, in both orders, gives the constructed distance, on the surfaces."""
    A, B = BODIES[name_A], BODIES[name_B]
    for X_AB, normal in placements(name_A, name_B, distance):
        result = answer(A, B, X_AB, X_WA=X_WA)
        # World poses and the way back round a few times the scene's extent of 3 m.
        slack = TOLERANCE + 2e-15
        assert result.distance == pytest.approx(distance, abs=slack)
        values = residuals_of(A, B, X_AB, result)
        assert max(values.values()) <= 10.0 * slack, values
        if abs(distance) > 1e-3:
            assert np.allclose(result.nhat_BA_A, -normal, atol=1e-11, rtol=0.0)
            assert result.unique


def residuals_of(A, B, X_AB, result):
    """Return the residuals; with the half space first, those of the swapped pair."""
    if isinstance(A, HalfSpace):
        R, p = X_AB[:3, :3], X_AB[:3, 3]
        X_BA = pose(R.T, -R.T @ p)
        swapped = result._replace(
            p_ACa=R.T @ (result.p_ACb - p),
            p_ACb=R.T @ (result.p_ACa - p),
            nhat_BA_A=-R.T @ result.nhat_BA_A,
        )
        return residuals(B, A, X_BA, swapped)
    return residuals(A, B, X_AB, result)


@pytest.mark.parametrize(("name_A", "name_B"), PAIRS)
def test_far_from_the_world_origin(name_A, name_B):
    """A scene 1e6 m away answers the same, to the rounding of its poses (1e-10 m)."""
    A, B = BODIES[name_A], BODIES[name_B]
    far = X_WA.copy()
    far[:3, 3] += [1e6, -1e6, 1e6]
    for X_AB, _ in placements(name_A, name_B, 2e-3):
        near = answer(A, B, X_AB, X_WA=X_WA)
        moved = answer(A, B, X_AB, X_WA=far)
        assert moved.distance == pytest.approx(near.distance, abs=1e-9)


@pytest.mark.parametrize(("name_A", "name_B"), PAIRS)
def test_order_of_the_shapes_does_not_matter(name_A, name_B):
    """Swapping the shapes keeps the distance and flips the normal."""
    A, B = BODIES[name_A], BODIES[name_B]
    for X_AB, _ in placements(name_A, name_B, 2e-3):
        R, p = X_AB[:3, :3], X_AB[:3, 3]
        one = answer(A, B, X_AB)
        two = answer(B, A, pose(R.T, -R.T @ p))
        assert two.distance == pytest.approx(one.distance, abs=TOLERANCE)
        assert np.allclose(R @ two.nhat_BA_A, -one.nhat_BA_A, atol=1e-11)


@pytest.mark.parametrize(("name_A", "name_B"), PAIRS)
def test_random_overlaps_are_no_deeper_than_any_direction(name_A, name_B):
    """Depth is at most the way out along any sampled direction, and the way out along nhat."""
    if "half space" in (name_A, name_B):
        pytest.skip("a half space has one way out, tested by construction")
    A, B = BODIES[name_A], BODIES[name_B]
    rng = np.random.default_rng(21)
    n = rng.normal(size=(500, 3))
    n /= np.linalg.norm(n, axis=1)[:, None]
    for _ in range(20):
        X_AB = pose(Rotation.random(random_state=rng), 0.05 * rng.normal(size=3))
        result = answer(A, B, X_AB)
        assert separation(A, B, X_AB, n).max() <= result.distance + TOLERANCE
        along = separation(A, B, X_AB, result.nhat_BA_A)
        assert along == pytest.approx(result.distance, abs=TOLERANCE)


def test_two_half_spaces_have_no_answer():
    """The only refused pair comes back as a failure, not as a number."""
    table = build_shape_table([HalfSpace(), HalfSpace()], [False, False])
    poses = np.ascontiguousarray([np.eye(4), np.eye(4)])
    solved = solve_pairs(hold(table), poses, np.array([[0, 1]]), np.inf, WITHIN)
    assert solved.failed == 0 != NO_FAILURE
    assert len(solved) == len(solved.distance) == 0


@pytest.mark.parametrize(("name_A", "name_B"), list(itertools.combinations(BODIES, 2)))
def test_rows_of_two_kinds_in_either_order_have_the_same_answer(name_A, name_B):
    """To the last bit: what is A in the answer decides where a point goes, not how it is found."""
    table = build_shape_table([BODIES[name_A], BODIES[name_B]], [False, False])
    rng = np.random.default_rng(31)
    for _ in range(5):
        poses = np.array([pose(Rotation.random(random_state=rng), 0.2 * rng.normal(size=3))] * 2)
        poses[1, :3, 3] += 0.2 * rng.normal(size=3)
        one, two = (
            solve_pairs(hold(table), poses, np.array([rows]), np.inf, WITHIN)
            for rows in ((0, 1), (1, 0))
        )
        assert one.distance == two.distance
        np.testing.assert_array_equal(one.p_ACa, two.p_BCb)
        np.testing.assert_array_equal(one.p_BCb, two.p_ACa)
        np.testing.assert_array_equal(one.p_WCa, two.p_WCb)
        np.testing.assert_array_equal(one.p_WCb, two.p_WCa)
        np.testing.assert_array_equal(one.nhat_BA_W, -two.nhat_BA_W)


def test_points_that_are_not_asked_for_are_not_there():
    """The others are the same, wherever they are written."""
    shapes = list(BODIES.values())[:5]
    table = build_shape_table(shapes, [False] * len(shapes))
    rng = np.random.default_rng(32)
    poses = np.array([pose(Rotation.random(random_state=rng), rng.normal(size=3)) for _ in shapes])
    pairs = np.array(list(itertools.combinations(range(len(shapes)), 2)))
    both, local, world = (
        solve_pairs(hold(table), poses, pairs, np.inf, WITHIN, points=points)
        for points in (BOTH, LOCAL, WORLD)
    )
    for solved in (local, world):
        assert len(solved) == len(pairs)
        for name in ("rows", "distance", "nhat_BA_W", "is_unique", "decided_by"):
            np.testing.assert_array_equal(getattr(solved, name), getattr(both, name))
    for name in ("p_ACa", "p_BCb"):
        np.testing.assert_array_equal(getattr(local, name), getattr(both, name))
        with pytest.raises(AssertionError, match="not asked for"):
            getattr(world, name)
    for name in ("p_WCa", "p_WCb"):
        np.testing.assert_array_equal(getattr(world, name), getattr(both, name))
        with pytest.raises(AssertionError, match="not asked for"):
            getattr(local, name)
