"""Directions of depth, visited one by one: none that is less deep is ever missed."""

from convex_bodies import plain_core, pose, rounded_hull, support
import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from scene_graph_ros.geometry import Box, Capsule, Convex, Cylinder, Ellipsoid
from scene_graph_ros.geometry.meshes.shape_table import build_shape_table
from scene_graph_ros.geometry.narrowphase.known_features import contact_of_known
from scene_graph_ros.geometry.narrowphase.lift import FOUND, lifted_contact
from scene_graph_ros.geometry.narrowphase.other_depths import (
    LESS,
    look_for_less,
    NONE_LESS,
    UNDECIDED,
)
from scene_graph_ros.geometry.narrowphase.polytope_rows import FIRST_FACE, MAX_FACES

BOX = Box(0.2, 0.3, 0.14)
HULL = rounded_hull(0.3, 12)
ROUND = rounded_hull(0.3, 32, seed=5)
CYLINDER = Cylinder(0.1, 0.25)
DISC = Cylinder(0.16, 0.05)
CAPSULE = Capsule(0.05, 0.3)
BALL = Ellipsoid(0.1, 0.13, 0.16)
PLATE = Ellipsoid(0.15, 0.13, 0.03)

LOOKED_THROUGH = [
    (BOX, CYLINDER),
    (BOX, DISC),
    (BOX, HULL),
    (HULL, CYLINDER),
    (HULL, ROUND),
    (CAPSULE, CYLINDER),
    (CAPSULE, DISC),
    (CAPSULE, HULL),
]
ROUND_BALL = Ellipsoid(0.12, 0.12, 0.12)
SPINDLE = Ellipsoid(0.08, 0.08, 0.16)
LENS = Ellipsoid(0.14, 0.14, 0.05)
PROVEN = [(BOX, BALL), (BOX, PLATE), (HULL, BALL), (HULL, PLATE), (CAPSULE, PLATE)]


class Pair:
    """Two cores at a pose, and how deep they are along any direction, by plain numpy."""

    def __init__(self, shape_A, shape_B, X_AB):
        self.shapes, self.X_AB = (shape_A, shape_B), X_AB
        table = build_shape_table(list(self.shapes), [False, False])
        self.cores = plain_core(table, 0), plain_core(table, 1)
        self.hulls = table.hulls.blocks
        self.R = tuple(float(x) for x in X_AB[:3, :3].ravel())
        self.p = tuple(float(x) for x in X_AB[:3, 3])
        self.S = np.zeros((FIRST_FACE + MAX_FACES, 9))
        self.ids = np.zeros((FIRST_FACE, 2), np.int64)

    def depth(self, n):
        """Return how far the cores are from being apart along unit vectors n (..., 3)."""
        n = np.asarray(n)
        radius = sum(core[2] for core in self.cores)
        outer = support(self.shapes[0], -n) + support(self.shapes[1], n @ self.X_AB[:3, :3])
        return outer + n @ self.X_AB[:3, 3] - radius

    def least_depth(self):
        """Return the least depth of many directions and of what is around the best."""
        n = np.vstack([DIRECTIONS, np.eye(3), -np.eye(3)])
        depth = self.depth(n)
        best = depth.min()
        for k in np.argsort(depth)[:5]:
            found = minimize(
                lambda x: self.depth(x / np.linalg.norm(x)),
                n[k],
                method="Nelder-Mead",
                options={"xatol": 1e-9, "fatol": 1e-12},
            )
            best = min(best, found.fun)
        return best

    def look(self, n, depth, a=(0.0, 0.0, 0.0), b=None):
        """Return what ``look_for_less`` does."""
        b = self.p if b is None else b
        size = 0.5
        return look_for_less(*self.cores, self.R, self.p, self.hulls, a, b, n, depth, size, self.S)


def _directions(count):
    n = np.random.default_rng(1).normal(size=(count, 3))
    return n / np.linalg.norm(n, axis=1)[:, None]


DIRECTIONS = _directions(4000)


def overlapping(shape_A, shape_B, seed):
    """Return a pair whose centres are some centimetres apart, less if the cores are apart then."""
    rng = np.random.default_rng(seed)
    X_AB = pose(Rotation.random(random_state=rng), rng.uniform(-0.08, 0.08, 3))
    pair = Pair(shape_A, shape_B, X_AB)
    while pair.depth(DIRECTIONS).min() < 0.01:
        X_AB[:3, 3] *= 0.5
        pair = Pair(shape_A, shape_B, X_AB)
    return pair


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(("shape_A", "shape_B"), LOOKED_THROUGH, ids=repr)
def test_direction_of_least_depth_is_found(shape_A, shape_B, seed):
    """Without a contact to begin with, the direction is the least deep of all."""
    for A, B in ((shape_A, shape_B), (shape_B, shape_A)):
        pair = overlapping(A, B, seed)
        least = pair.least_depth()
        verdict, m, _, _ = pair.look((0.0, 0.0, 0.0), 1.0)
        assert verdict == LESS
        assert least - 1e-9 <= pair.depth(m) <= least + 1e-8


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(("shape_A", "shape_B"), LOOKED_THROUGH, ids=repr)
def test_features_found_give_the_contact(shape_A, shape_B, seed):
    """The features of the direction that is found, polished, are at the least depth."""
    pair = overlapping(shape_A, shape_B, seed)
    least = pair.least_depth()
    _, m, where, index = pair.look((0.0, 0.0, 0.0), 1.0)
    proven, n, a, b, distance, error, _ = contact_of_known(
        *pair.cores, pair.R, pair.p, pair.hulls, m, where, index, 0.5, pair.S, pair.ids
    )
    assert proven
    assert error <= 1e-14
    assert distance == pytest.approx(-pair.depth(n), abs=1e-14)
    assert -distance == pytest.approx(least, abs=1e-8)
    assert np.allclose(np.subtract(a, b), np.multiply(distance, n), atol=1e-14)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(("shape_A", "shape_B"), LOOKED_THROUGH + PROVEN, ids=repr)
def test_what_is_found_in_short_is_the_least_depth(shape_A, shape_B, seed):
    """Whatever a short contact claims to be the depth, no direction undercuts it."""
    for A, B in ((shape_A, shape_B), (shape_B, shape_A)):
        pair = overlapping(A, B, seed)
        status, distance, _, _, n, _ = lifted_contact(
            *pair.cores, pair.R, pair.p, pair.hulls, np.inf, pair.S, pair.ids, np.zeros(4)
        )
        if status == FOUND and distance < 0.0:
            assert pair.depth(n) == pytest.approx(-distance, abs=1e-14)
            assert pair.least_depth() >= -distance - 1e-12


@pytest.mark.parametrize(("shape_A", "shape_B"), LOOKED_THROUGH, ids=repr)
def test_no_overlap_of_these_is_left_to_the_general_algorithm(shape_A, shape_B):
    """Polytopes and cylinders at random poses are all proven in short."""
    for seed in range(8):
        pair = overlapping(shape_A, shape_B, seed)
        status, distance, *_ = lifted_contact(
            *pair.cores, pair.R, pair.p, pair.hulls, np.inf, pair.S, pair.ids, np.zeros(4)
        )
        assert status == FOUND or distance >= 0.0


@pytest.mark.parametrize("ellipsoid", [BALL, PLATE, ROUND_BALL, SPINDLE, LENS], ids=repr)
@pytest.mark.parametrize("polytope", [BOX, HULL, CAPSULE], ids=repr)
def test_overlap_with_an_ellipsoid_is_proven_and_right(polytope, ellipsoid):
    """Also deep ones, which vertices could leave otherwise, are hardly ever left to others."""
    proven = 0
    for seed in range(100, 112):
        pair = overlapping(polytope, ellipsoid, seed)
        status, distance, *_ = lifted_contact(
            *pair.cores, pair.R, pair.p, pair.hulls, np.inf, pair.S, pair.ids, np.zeros(4)
        )
        if status == FOUND and distance < 0.0:
            proven += 1
            assert pair.least_depth() == pytest.approx(-distance, abs=1e-8)
        else:
            proven += distance >= 0.0  # the cores of rounded bodies may be apart
    assert proven >= 10


def test_vertex_in_the_middle_of_a_ball_is_not_decided():
    """From the centre of a ball, or of a disc of equal axes, all ways out are as long."""
    for ball in (ROUND_BALL, SPINDLE):
        pair = Pair(Box(0.01, 0.01, 0.01), ball, pose(np.eye(3), [-0.005, -0.005, -0.005]))
        n = (1.0, 0.0, 0.0)
        depth = float(pair.depth(n))
        a, b = (-0.005, 0.005, 0.005), (ball.a - 0.005, -0.005, -0.005)
        assert pair.look(n, depth, a, b)[0] != NONE_LESS


def test_other_direction_as_deep_is_no_proof():
    """A cube in the middle of a cube of cylinders' height can go up or down alike."""
    pair = Pair(Box(0.1, 0.1, 0.2), Cylinder(0.4, 0.3), np.eye(4))
    up = (0.0, 0.0, 1.0)
    verdict, *_ = pair.look(up, 0.25, (0.0, 0.0, -0.1), (0.0, 0.0, 0.15))
    assert verdict == UNDECIDED
    X_AB = pose(np.eye(3), [0.0, 0.0, -0.01])
    pair = Pair(Box(0.1, 0.1, 0.2), Cylinder(0.4, 0.3), X_AB)
    assert pair.look(up, 0.24, (0.0, 0.0, -0.1), (0.0, 0.0, 0.14))[0] == NONE_LESS
    verdict, m, _, _ = pair.look((0.0, 0.0, -1.0), 0.26, (0.0, 0.0, 0.1), (0.0, 0.0, -0.16))
    assert verdict == LESS
    assert np.allclose(m, up)


@pytest.mark.parametrize(
    ("shape_A", "shape_B"),
    [
        (CYLINDER, DISC),
        (BALL, CYLINDER),
        (rounded_hull(0.3, 60), BOX),
        (BOX, Convex(vertices=[[0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0], [0, 0.1, 0]])),
    ],
    ids=["cylinders", "no polytope", "large hull", "flat hull"],
)
def test_other_cores_are_left_undecided(shape_A, shape_B):
    """Two curved bodies, large hulls against others that are, and flat hulls are not for this."""
    pair = overlapping(shape_A, shape_B, 3)
    if isinstance(shape_B, Box):
        pair = overlapping(shape_A, rounded_hull(0.2, 50), 3)
    assert pair.look((0.0, 0.0, 1.0), 0.1)[0] == UNDECIDED
