"""Directions of depth, visited one by one: none that is less deep is ever missed."""

from convex_bodies import pose, rounded_hull
import numpy as np
from overlapping_pairs import is_found, overlapping, OverlappingPair
import pytest

from scene_graph_ros.geometry import Box, Capsule, Convex, Cylinder, Ellipsoid
from scene_graph_ros.geometry.narrowphase.contact.contact_of_known import contact_of_known
from scene_graph_ros.geometry.narrowphase.prove.critical_directions import (
    least_depth,
    LESS,
    NONE_LESS,
    UNDECIDED,
)

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


def look(pair, n, depth, a=(0.0, 0.0, 0.0), b=None):
    """Return what ``least_depth`` does."""
    b = pair.p if b is None else b
    return least_depth(pair.pair, a, b, n, depth, 0.5, pair.work.S)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(("shape_A", "shape_B"), LOOKED_THROUGH, ids=repr)
def test_direction_of_least_depth_is_found(shape_A, shape_B, seed):
    """Without a contact to begin with, the direction is the least deep of all."""
    for A, B in ((shape_A, shape_B), (shape_B, shape_A)):
        pair = overlapping(A, B, seed)
        least = pair.least_depth()
        verdict, m, _, _ = look(pair, (0.0, 0.0, 0.0), 1.0)
        assert verdict == LESS
        assert least - 1e-9 <= pair.depth(m) <= least + 1e-8


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(("shape_A", "shape_B"), LOOKED_THROUGH, ids=repr)
def test_features_found_give_the_contact(shape_A, shape_B, seed):
    """The features of the direction that is found, polished, are at the least depth."""
    pair = overlapping(shape_A, shape_B, seed)
    least = pair.least_depth()
    _, m, where, index = look(pair, (0.0, 0.0, 0.0), 1.0)
    proven, found = contact_of_known(pair.pair, m, where, index, 0.5, pair.work)
    n, a, b, distance, error, _ = found
    assert proven
    assert error <= 1e-14
    assert distance == pytest.approx(-pair.depth(n), abs=1e-14)
    assert -distance == pytest.approx(least, abs=1e-8)
    assert np.allclose(np.subtract(a, b), np.multiply(distance, n), atol=1e-14)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(("shape_A", "shape_B"), LOOKED_THROUGH, ids=repr)
def test_what_is_found_in_short_is_the_least_depth(shape_A, shape_B, seed):
    """Whatever a short contact claims to be the depth, no direction undercuts it."""
    for A, B in ((shape_A, shape_B), (shape_B, shape_A)):
        pair = overlapping(A, B, seed)
        decided_by, distance, _, _, n, _ = pair.lift()
        if is_found(decided_by) and distance < 0.0:
            assert pair.depth(n) == pytest.approx(-distance, abs=1e-14)
            assert pair.least_depth() >= -distance - 1e-12


@pytest.mark.parametrize(("shape_A", "shape_B"), LOOKED_THROUGH, ids=repr)
def test_no_overlap_of_these_is_left_to_the_general_algorithm(shape_A, shape_B):
    """Polytopes and cylinders at random poses are all proven in short."""
    for seed in range(8):
        pair = overlapping(shape_A, shape_B, seed)
        decided_by, distance, *_ = pair.lift()
        assert is_found(decided_by) or distance >= 0.0


@pytest.mark.parametrize("ellipsoid", [BALL, PLATE, ROUND_BALL, SPINDLE, LENS], ids=repr)
@pytest.mark.parametrize("polytope", [BOX, HULL, CAPSULE], ids=repr)
def test_depth_in_an_ellipsoid_is_proven(polytope, ellipsoid):
    """A least depth is told to be so, also where vertices could leave otherwise; others are not.

    The contacts are those found in short, by whatever proof; looked at again, hardly any is left
    open, and the same in the opposite direction is never taken for the least depth.
    """
    proven = tried = 0
    for seed in range(100, 112):
        pair = overlapping(polytope, ellipsoid, seed)
        decided_by, distance, a, b, n, _ = pair.lift()
        if is_found(decided_by) and distance < 0.0:
            tried += 1
            proven += look(pair, n, -distance, a, b)[0] == NONE_LESS
            assert look(pair, n, 0.01 - distance, a, b)[0] != NONE_LESS
    assert proven >= tried - 2


def test_vertex_in_the_middle_of_a_ball_is_not_decided():
    """From the centre of a ball, or of a disc of equal axes, all ways out are as long."""
    for ball in (ROUND_BALL, SPINDLE):
        pair = OverlappingPair(
            Box(0.01, 0.01, 0.01), ball, pose(np.eye(3), [-0.005, -0.005, -0.005])
        )
        n = (1.0, 0.0, 0.0)
        depth = float(pair.depth(n))
        a, b = (-0.005, 0.005, 0.005), (ball.a - 0.005, -0.005, -0.005)
        assert look(pair, n, depth, a, b)[0] != NONE_LESS


@pytest.mark.parametrize("axis", [(0.8, 0.5, 0.3), (-0.5, 0.8, 0.3)], ids=str)
def test_segment_across_a_cylinder(axis):
    """Where a segment crosses a cylinder's side, the normal is one that the search starts from.

    It is across both axes; the segment, which passes the axis at 8 cm, is 2 cm below the side and
    1.5 cm below the end there, so that no ball proves it.
    """
    axis = np.array(axis) / np.linalg.norm(axis)
    out = np.array([-axis[1], axis[0], 0.0]) / np.hypot(axis[0], axis[1])
    X_AB = pose(np.column_stack([out, np.cross(axis, out), axis]), 0.08 * out + [0, 0, 0.11])
    for pair in (
        OverlappingPair(CYLINDER, CAPSULE, X_AB),
        OverlappingPair(CAPSULE, CYLINDER, np.linalg.inv(X_AB)),
    ):
        decided_by, distance, *_ = pair.lift()
        assert is_found(decided_by)
        assert distance == pytest.approx(-0.02, abs=1e-15)


def test_other_direction_as_deep_is_no_proof():
    """A cube in the middle of a cube of cylinders' height can go up or down alike."""
    pair = OverlappingPair(Box(0.1, 0.1, 0.2), Cylinder(0.4, 0.3), np.eye(4))
    up = (0.0, 0.0, 1.0)
    verdict, *_ = look(pair, up, 0.25, (0.0, 0.0, -0.1), (0.0, 0.0, 0.15))
    assert verdict == UNDECIDED
    X_AB = pose(np.eye(3), [0.0, 0.0, -0.01])
    pair = OverlappingPair(Box(0.1, 0.1, 0.2), Cylinder(0.4, 0.3), X_AB)
    assert look(pair, up, 0.24, (0.0, 0.0, -0.1), (0.0, 0.0, 0.14))[0] == NONE_LESS
    verdict, m, _, _ = look(pair, (0.0, 0.0, -1.0), 0.26, (0.0, 0.0, 0.1), (0.0, 0.0, -0.16))
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
    assert look(pair, (0.0, 0.0, 1.0), 0.1)[0] == UNDECIDED
