"""The sphere of directions covered by proofs: what is proven is right, what is less is found."""

from convex_bodies import pose, rounded_hull
import numpy as np
from overlapping_pairs import is_found, overlapping, OverlappingPair
import pytest

from scene_graph_ros.geometry import Box, Capsule, Cylinder, Ellipsoid
from scene_graph_ros.geometry.compiled.kernel import lean_kernel
from scene_graph_ros.geometry.compiled.lanes import every, LANES, load_lanes, select, store_lanes
from scene_graph_ros.geometry.narrowphase.prove import cover as module
from scene_graph_ros.geometry.narrowphase.prove.cover import cover
from scene_graph_ros.geometry.narrowphase.prove.critical_directions import (
    LESS,
    NONE_LESS,
    UNDECIDED,
)

BOX = Box(0.2, 0.3, 0.14)
HULL = rounded_hull(0.3, 12)
CAPSULE = Capsule(0.05, 0.3)
CYLINDER = Cylinder(0.1, 0.25)
DISC = Cylinder(0.16, 0.05)
ROD = Cylinder(0.04, 0.3)
BALL = Ellipsoid(0.1, 0.13, 0.16)
PLATE = Ellipsoid(0.15, 0.13, 0.03)
ROUND_BALL = Ellipsoid(0.12, 0.12, 0.12)
SPINDLE = Ellipsoid(0.08, 0.08, 0.16)
LENS = Ellipsoid(0.14, 0.14, 0.05)

ROUND_PAIRS = [
    (A, B)
    for A in (BOX, HULL, CAPSULE, CYLINDER, DISC, ROD, BALL)
    for B in (BALL, PLATE, SPINDLE, LENS)
] + [(A, B) for A in (CYLINDER, DISC, ROD) for B in (CYLINDER, DISC, ROD)]


def look(pair, n, depth, a, b):
    """Return what ``cover`` does for vectors of any kind."""
    a, b, n = (tuple(float(x) for x in v) for v in (a, b, n))
    return cover(pair.pair, a, b, n, depth, 0.5, pair.work.S)


@pytest.mark.parametrize(("shape_A", "shape_B"), ROUND_PAIRS, ids=repr)
def test_what_is_found_is_the_least_depth(shape_A, shape_B):
    """Whatever is claimed to be the depth, no direction undercuts it, and nearly all is found."""
    found = 0
    for seed in range(100, 108):
        for A, B in ((shape_A, shape_B), (shape_B, shape_A)):
            pair = overlapping(A, B, seed)
            decided_by, distance, _, _, n, _ = pair.lift()
            if is_found(decided_by) and distance < 0.0:
                found += 1
                assert pair.depth(n) == pytest.approx(-distance, abs=1e-14)
                assert pair.least_depth() == pytest.approx(-distance, abs=1e-8)
            else:
                found += distance >= 0.0  # the cores of rounded bodies may be apart
    assert found >= 14


def test_far_side_is_deeper_and_the_near_side_is_found():
    """A ball in a disc of 5 cm, 1 cm above its middle, goes up (11.5 cm) and not down (13.5)."""
    pair = OverlappingPair(DISC, ROUND_BALL, pose(np.eye(3), [0.005, 0.0, 0.01]))
    up, down = (0.0, 0.0, -1.0), (0.0, 0.0, 1.0)  # out of B into A
    verdict, _ = look(pair, up, 0.135, (0.005, 0.0, 0.025), (0.005, 0.0, -0.11))
    assert verdict == NONE_LESS
    verdict, m = look(pair, down, 0.155, (0.005, 0.0, -0.025), (0.005, 0.0, 0.13))
    assert verdict == LESS
    assert pair.depth(m) < 0.155


def test_directions_as_deep_are_not_decided():
    """In the middle of a disc a ball may go up or down, and from its own middle anywhere."""
    pair = OverlappingPair(DISC, ROUND_BALL, np.eye(4))
    up = (0.0, 0.0, -1.0)
    assert look(pair, up, 0.145, (0.0, 0.0, 0.025), (0.0, 0.0, -0.12))[0] == UNDECIDED
    pair = OverlappingPair(Box(1e-3, 1e-3, 1e-3), ROUND_BALL, pose(np.eye(3), [-5e-4] * 3))
    a, b = (-5e-4, 5e-4, 5e-4), (0.12 - 5e-4, -5e-4, -5e-4)
    n = (1.0, 0.0, 0.0)
    assert look(pair, n, float(pair.depth(n)), a, b)[0] != NONE_LESS


def test_valley_that_exhausts_the_expanding_polytope():
    """Two edges of a box leave an ellipsoid by lengths that differ by 60 um, and little between.

    EPA of the whole runs out of corners here, and took the longer way out.
    """
    R = [
        [-0.6184732389232611, 0.7804811739259796, 0.09132354506312285],
        [-0.31567158514115107, -0.14034089843137842, -0.9384326734305168],
        [-0.7196126062474477, -0.6092237432787718, 0.33317281935229537],
    ]
    p = [0.11670197363850064, -0.016968519131036596, 0.0035201398583695294]
    box = Box(0.21985813496430728, 0.11513500453222883, 0.18224408855351026)
    ball = Ellipsoid(0.26505290825050304, 0.10886140712442421, 0.1365423934721644)
    pair = OverlappingPair(box, ball, pose(np.array(R), p))
    decided_by, distance, _, _, n, _ = pair.lift()
    assert is_found(decided_by)
    assert -distance == pytest.approx(pair.depth(n), abs=1e-14)
    assert -distance == pytest.approx(pair.least_depth(), abs=1e-8)


def test_less_by_a_millionth_is_not_missed():
    """Of two ways out that differ by a few nanometres, the longer one is never proven."""
    for offset in (1e-3, 1e-5, 1e-7, 1e-9, 0.0):
        pair = OverlappingPair(DISC, ROUND_BALL, pose(np.eye(3), [0.0, 0.0, offset]))
        depth = 0.145 + offset
        verdict, _ = look(
            pair, (0.0, 0.0, 1.0), depth, (0.0, 0.0, -0.025), (0.0, 0.0, 0.12 + offset)
        )
        assert verdict != NONE_LESS


@lean_kernel
def look_at_cells(room):
    """Write 1 for the cells that are covered, 0 for others, and their middles."""
    side, s, q = load_lanes(room, 0), load_lanes(room, LANES), load_lanes(room, 2 * LANES)
    half, x = load_lanes(room, 3 * LANES), load_lanes(room, 4 * LANES)
    w = (x, load_lanes(room, 5 * LANES), load_lanes(room, 6 * LANES))
    is_covered = module._are_covered(w, side, s, q, half, 0.7**2)
    store_lanes(room, 7 * LANES, select(is_covered, every(1.0), every(0.0)))
    x = module._directions(side, s, q)
    store_lanes(room, 8 * LANES, x[0])
    store_lanes(room, 9 * LANES, x[1])
    store_lanes(room, 10 * LANES, x[2])


def on_side(side, s, q):
    """Return the vector to (s, q) on a side of the cube."""
    x = [s, q]
    x.insert(side // 2, -1.0 if side % 2 else 1.0)
    return x


def test_a_cell_is_covered_as_far_as_its_corners_are():
    """What is claimed of a cell holds for random directions in it, and fails for some outside."""
    rng = np.random.default_rng(6)
    covered = 0
    for _ in range(80):
        room = np.zeros((11, LANES))
        room[0], room[3] = rng.integers(6, size=LANES), rng.choice([1.0, 0.5, 0.25], LANES)
        room[1:3] = (1.0 - room[3]) * rng.uniform(-1.0, 1.0, (2, LANES))
        middles = [on_side(int(side), s, q) for side, s, q in room[:3].T]
        room[4:7] = (middles + 0.3 * rng.normal(size=(LANES, 3))).T
        look_at_cells(room)
        assert np.array_equal(room[8:].T, middles)
        for side, s, q, half, *w, claimed, _, _, _ in room.T:
            x = np.array([on_side(int(side), s + half * a, q + half * b) for a, b in GRID])
            depths = (x @ w) / np.linalg.norm(x, axis=1)
            assert bool(claimed) == (depths.min() >= 0.7)
            covered += bool(claimed)
    assert 50 < covered < 590


GRID = [(a, b) for a in np.linspace(-1.0, 1.0, 9) for b in np.linspace(-1.0, 1.0, 9)]
