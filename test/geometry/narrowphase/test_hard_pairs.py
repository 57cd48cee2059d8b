"""Degenerate, extreme and adversarial pairs: every answer must prove itself, none may be NaN."""

from convex_bodies import answer_convex, outside, points_of, pose, residuals, separation, support
from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from scene_graph_ros.geometry import Box, Capsule, Convex, Cylinder, Ellipsoid, Sphere

DIRECTIONS = np.random.default_rng(0).normal(size=(400, 3))
DIRECTIONS /= np.linalg.norm(DIRECTIONS, axis=1)[:, None]
ROUNDING = 1e-12
# Where cores overlap deeply, near ties of directions leave a certified gap; the hard corpus may
# be off by 1e-9 of the size.
HARD = 1e-9


def extent(shape):
    """Return the largest extent of a shape along its axes."""
    return 2.0 * max(support(shape, axis) for axis in np.eye(3))


def check(A, B, X_AB, tolerance=ROUNDING):
    """Check what must hold for every pair; return the result."""
    result = answer_convex(A, B, X_AB)
    scale = max(extent(A), extent(B), np.linalg.norm(X_AB[:3, 3]))
    values = residuals(A, B, X_AB, result)
    assert np.isfinite([result.distance, result.gap, *values.values()]).all()
    assert values.pop("unit") <= ROUNDING
    for name, value in values.items():
        assert value <= tolerance * scale, (name, value / scale)
    # No sampled direction separates the bodies more (or needs less depth) than the answer.
    best = separation(A, B, X_AB, DIRECTIONS).max()
    assert best <= result.distance + tolerance * scale
    return result


SHARED = [
    Sphere(0.1),
    Capsule(0.05, 0.2),
    Box(0.2, 0.15, 0.1),
    Cylinder(0.1, 0.15),
    Ellipsoid(0.1, 0.08, 0.06),
    Convex(vertices=np.vstack([np.zeros(3), 0.2 * np.eye(3)])),
]


@pytest.mark.parametrize("shape", SHARED, ids=lambda s: type(s).__name__)
def test_identical_shapes_at_one_pose(shape):
    """A shape on itself is as deep as its least width, and the direction is a choice."""
    result = check(shape, shape, np.eye(4))
    width = support(shape, DIRECTIONS) + support(shape, -DIRECTIONS)
    assert -result.distance <= width.min() + ROUNDING
    assert not result.unique


@pytest.mark.parametrize("angle", [1e-3, 1e-6, 1e-9, 1e-12, 1e-15, 0.0])
@pytest.mark.parametrize("gap", [2e-3, 1e-9, 0.0, -2e-3])
def test_nearly_parallel_faces_edges_and_axes(angle, gap):
    """Tilts of 0 to a milliradian about each axis, of bodies that lie flat on each other."""
    for A in SHARED[1:]:
        for B in SHARED[1:]:
            for axis in np.eye(3):
                tilt = Rotation.from_rotvec(angle * axis)
                down = np.array([0.0, 0.0, 1.0])
                z = support(A, down) + support(B, -down @ tilt.as_matrix()) + gap
                check(A, B, pose(tilt, [0.01, 0.005, z]), HARD)


def test_parallel_cylinders_side_by_side():
    """Parallel cylinders are apart by the distance of their axes less the radii, n across."""
    A, B = Cylinder(0.1, 0.3), Cylinder(0.05, 0.2)
    result = check(A, B, pose(np.eye(3), [0.12, 0.16, 0.1]))
    assert result.distance == pytest.approx(0.2 - 0.15, abs=1e-16)
    assert np.allclose(result.nhat_BA_A, [-0.6, -0.8, 0.0], atol=1e-14)
    # The sides face each other for z in [0, 0.15]: a witness pair is somewhere on there.
    assert 0.0 - 1e-15 <= result.p_ACa[2] <= 0.15 + 1e-15


def test_coaxial_cylinders_have_no_single_direction():
    """A pin inside a tube's volume can leave to every side: depth is known, direction a choice."""
    result = check(Cylinder(0.1, 0.5), Cylinder(0.02, 0.5), np.eye(4))
    assert result.distance == pytest.approx(-0.12, abs=1e-15)
    assert not result.unique


def test_box_inside_box_equal_depths_are_flagged():
    """A cube in the middle of a cube has six equally short ways out."""
    result = check(Box(0.4, 0.4, 0.4), Box(0.2, 0.2, 0.2), np.eye(4))
    assert result.distance == pytest.approx(-0.3, abs=1e-15)
    assert not result.unique
    moved = check(Box(0.4, 0.4, 0.4), Box(0.2, 0.2, 0.2), pose(np.eye(3), [0.01, 0, 0]))
    assert moved.unique
    assert np.allclose(moved.nhat_BA_A, [-1.0, 0.0, 0.0], atol=1e-15)


def test_parallel_faces_keep_the_normal_unique():
    """Coplanar faces leave the witness points a choice, but not the normal."""
    for gap in (0.01, -0.01):
        result = check(
            Box(0.2, 0.2, 0.2), Box(0.2, 0.2, 0.2), pose(np.eye(3), [0, 0.05, 0.2 + gap])
        )
        assert result.distance == pytest.approx(gap, abs=1e-15)
        assert np.allclose(result.nhat_BA_A, [0, 0, -1], atol=1e-15)
        assert result.unique


@pytest.mark.parametrize("ratio", [1e-3, 1e-6])
def test_tiny_body_inside_and_beside_a_huge_one(ratio):
    """Sizes a million apart: exact to rounding of the larger."""
    turn = Rotation.from_euler("xyz", [0.3, -0.5, 0.9])
    for A in SHARED:
        for B in (Box(*(0.2 * ratio,) * 3), Cylinder(0.1 * ratio, 0.2 * ratio), Sphere(ratio)):
            for p in ([0.02, 0.01, 0.01], [0.3, 0.2, 0.1], [0.0, 0.0, 0.0]):
                check(A, B, pose(turn, p), HARD)


def test_needles_and_plates():
    """Aspects of 1 : 10000, crossing, touching and apart."""
    needle = Box(1.0, 1e-4, 1e-4)
    plate = Box(1.0, 1.0, 1e-4)
    rod = Cylinder(5e-5, 1.0)
    disc = Cylinder(0.5, 1e-4)
    splinter = Convex(vertices=points_of(needle))
    rng = np.random.default_rng(4)
    bodies = [needle, plate, rod, disc, splinter]
    for A in bodies:
        for B in bodies:
            for p in ([0, 0, 0], [0, 0, 1e-4], [0.1, 0.2, 1e-3], [0, 0, 0.1]):
                check(A, B, pose(Rotation.random(random_state=rng), p), HARD)


def test_ellipsoids_of_aspect_1_to_1000():
    """Ellipsoids like needles and discs, apart."""
    rng = np.random.default_rng(5)
    bodies = [Ellipsoid(1e-3, 1e-3, 1.0), Ellipsoid(1.0, 1.0, 1e-3), Ellipsoid(0.5, 0.1, 1e-3)]
    for A in bodies:
        for B in bodies:
            for _ in range(5):
                p = rng.normal(size=3)
                p *= rng.uniform(1.0, 2.5) / np.linalg.norm(p)
                check(A, B, pose(Rotation.random(random_state=rng), p))


def test_hulls_of_a_flat_polygon_a_segment_and_a_point():
    """Degenerate hulls are bodies without volume: distance and touching work all the same."""
    flat = Convex(vertices=np.array([[0, 0, 0], [0.2, 0, 0], [0.2, 0.1, 0], [0, 0.1, 0]]))
    segment = Convex(vertices=np.array([[-0.1, 0, 0], [0.1, 0, 0]]))
    point = Convex(vertices=np.array([[0.05, 0.02, 0.01]]))
    for A in (flat, segment, point):
        for B in (*SHARED, segment, point):
            for z in (0.4, 0.03, 0.0):
                X_AB = pose(Rotation.from_euler("xyz", [0.2, 0.1, -0.3]), [0.05, 0.04, z])
                result = answer_convex(A, B, X_AB)
                rest = result.p_ACa - result.p_ACb - result.distance * result.nhat_BA_A
                assert np.linalg.norm(rest) <= ROUNDING
                assert abs(np.linalg.norm(result.nhat_BA_A) - 1.0) <= ROUNDING
                gap = -(result.nhat_BA_A @ X_AB[:3, 3])
                gap -= (points_of(A) @ -result.nhat_BA_A).max()
                gap -= support(B, result.nhat_BA_A @ X_AB[:3, :3])
                assert gap == pytest.approx(result.distance, abs=ROUNDING)


def test_duplicate_coplanar_and_collinear_vertices_change_nothing():
    """A hull given with redundant points answers like the plain one."""
    plain = np.array([[x, y, z] for x in (0, 0.2) for y in (0, 0.1) for z in (0, 0.3)])
    rng = np.random.default_rng(8)
    extra = rng.dirichlet(np.ones(8), size=40) @ plain
    on_face = extra * [1, 1, 0]
    crowded = np.vstack([plain, plain, extra, on_face, 0.5 * (plain[:1] + plain[1:])])
    for B in SHARED:
        X_AB = pose(Rotation.from_euler("xyz", [0.4, 0.2, 0.1]), [0.3, 0.2, 0.1])
        one = check(Convex(vertices=plain), B, X_AB)
        two = check(Convex(vertices=crowded), B, X_AB)
        assert one.distance == pytest.approx(two.distance, abs=1e-15)


sizes = st.floats(0.02, 2.0)
angles = st.floats(-3.2, 3.2)
shapes = st.one_of(
    st.builds(Sphere, sizes),
    st.builds(Capsule, sizes, sizes),
    st.builds(Box, sizes, sizes, sizes),
    st.builds(Cylinder, sizes, sizes),
    st.builds(Ellipsoid, sizes, sizes, sizes),
    st.integers(0, 50).map(
        lambda seed: Convex(vertices=np.random.default_rng(seed).normal(size=(6 + seed, 3)))
    ),
)
positions = st.tuples(*[st.floats(-2.0, 2.0)] * 3)


@settings(max_examples=300, deadline=None, derandomize=True)
@given(shapes, shapes, angles, angles, angles, positions, st.floats(-4.0, 4.0))
def test_random_pairs_prove_themselves_at_every_scale(A, B, roll, pitch, yaw, p, exponent):
    """Random pairs satisfy the invariants, scaled by anything between 1e-4 and 1e4."""
    scale = 10.0**exponent
    X_AB = pose(Rotation.from_euler("xyz", [roll, pitch, yaw]), scale * np.array(p))
    check(rescaled(A, scale), rescaled(B, scale), X_AB, HARD)


def rescaled(shape, scale):
    """Return the shape grown by a factor."""
    if isinstance(shape, Convex):
        return Convex(vertices=scale * np.asarray(shape.vertices))
    names = {
        Sphere: ("radius",),
        Capsule: ("radius", "length"),
        Box: ("width", "depth", "height"),
        Cylinder: ("radius", "length"),
        Ellipsoid: ("a", "b", "c"),
    }
    return type(shape)(*(scale * getattr(shape, name) for name in names[type(shape)]))


@settings(max_examples=100, deadline=None, derandomize=True)
@given(shapes, shapes, angles, angles, angles, positions)
def test_swapping_the_bodies_flips_the_answer(A, B, roll, pitch, yaw, p):
    """Distance of (B, A) is that of (A, B), and the normal is opposite where it is unique."""
    X_AB = pose(Rotation.from_euler("xyz", [roll, pitch, yaw]), p)
    X_BA = np.linalg.inv(X_AB)
    X_BA[:3, :3] = X_AB[:3, :3].T
    X_BA[:3, 3] = -X_AB[:3, :3].T @ X_AB[:3, 3]
    one, two = answer_convex(A, B, X_AB), answer_convex(B, A, X_BA)
    scale = max(extent(A), extent(B), np.linalg.norm(p))
    assert one.distance == pytest.approx(two.distance, abs=HARD * scale)


@settings(max_examples=100, deadline=None, derandomize=True)
@given(shapes, shapes, angles, angles, angles, positions, positions)
def test_a_small_move_changes_the_distance_by_at_most_its_length(A, B, r, q, y, p, move):
    """Distance and depth are Lipschitz: moving B by 1e-9 m changes them by at most that."""
    X_AB = pose(Rotation.from_euler("xyz", [r, q, y]), p)
    moved = X_AB.copy()
    moved[:3, 3] += 1e-9 * np.array(move) / max(np.linalg.norm(move), 1e-3)
    change = answer_convex(A, B, moved).distance - answer_convex(A, B, X_AB).distance
    assert abs(change) <= np.linalg.norm(moved[:3, 3] - X_AB[:3, 3]) + 1e-14 * 10


def test_outside_is_zero_on_surfaces():
    """The tests' own measure of being outside vanishes on known surface points."""
    assert outside(Ellipsoid(0.1, 0.2, 0.3), [0.0, 0.0, 0.3]) == pytest.approx(0.0, abs=1e-16)
    assert outside(Box(0.2, 0.4, 0.6), [0.1, 0.2, 0.1]) == pytest.approx(0.0, abs=1e-16)
