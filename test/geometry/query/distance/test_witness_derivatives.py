"""Derivatives of the witness points: against central differences, and where there are none."""

import itertools

from convex_bodies import pose, rounded_hull, tetrahedron_mesh
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from scene_graph_ros.geometry import Box, Capsule, Cylinder, Ellipsoid, HalfSpace, Mesh, Sphere
from scene_graph_ros.geometry.query.distance.driver import solve_pairs, WITHIN
from scene_graph_ros.geometry.query.distance.witness_derivatives import witness_derivatives
from scene_graph_ros.geometry.tables.held_table import hold
from scene_graph_ros.geometry.tables.shape_table import build_shape_table

# A square pyramid whose base is pushed in a little from below, so that it is not convex.
DENTED = Mesh(
    vertices=[
        [0.1, 0.1, -0.1],
        [-0.1, 0.1, -0.1],
        [-0.1, -0.1, -0.1],
        [0.1, -0.1, -0.1],
        [0.0, 0.0, 0.1],
        [0.0, 0.0, -0.08],
    ],
    faces=[
        [0, 1, 4],
        [1, 2, 4],
        [2, 3, 4],
        [3, 0, 4],
        [1, 0, 5],
        [2, 1, 5],
        [3, 2, 5],
        [0, 3, 5],
    ],
)
BODIES = {
    "sphere": Sphere(1 / 9),
    "capsule": Capsule(1 / 15, 0.2),
    "box": Box(0.2, 1 / 6, 0.12),
    "cylinder": Cylinder(1 / 11, 0.2),
    "ellipsoid": Ellipsoid(0.1, 0.08, 1 / 15),
    "half space": HalfSpace(),
    "convex": rounded_hull(0.2, 20),
    "mesh": tetrahedron_mesh(0.2),
}
PAIRS = list(itertools.combinations_with_replacement(BODIES, 2))
PAIRS.remove(("half space", "half space"))
NAMES = ("dp_WCa_dX_WA", "dp_WCa_dX_WB", "dp_WCb_dX_WA", "dp_WCb_dX_WB")
STEP = 1e-6
"""Metres and radians: the error of a central difference is of its square, or rounding over it."""


def moved(X, k, step):
    """Return poses (n, 4, 4) moved along axis k of the spatial velocity (angular, linear) in W."""
    X = X.copy()
    if k < 3:
        X[:, :3, :3] = Rotation.from_rotvec(step * np.eye(3)[k]).as_matrix() @ X[:, :3, :3]
    else:
        X[:, k - 3, 3] += step
    return X


def solved(table, X_WA, X_WB):
    """Return the poses and answers of the pairs (row k, row n + k)."""
    n = len(X_WA)
    pairs = np.stack([np.arange(n), np.arange(n, 2 * n)], axis=1)
    X_WG = np.ascontiguousarray(np.concatenate([X_WA, X_WB]))
    return X_WG, solve_pairs(hold(table), X_WG, pairs, np.inf, WITHIN)


def differences(table, X_WA, X_WB):
    """Return the central differences of both witnesses by both poses, as in NAMES."""
    result = {name: np.zeros((len(X_WA), 3, 6)) for name in NAMES}
    for k in range(6):
        for body in "AB":
            ends = []
            for step in (STEP, -STEP):
                poses = (
                    (moved(X_WA, k, step), X_WB)
                    if body == "A"
                    else (
                        X_WA,
                        moved(X_WB, k, step),
                    )
                )
                ends.append(solved(table, *poses)[1])
            for witness in "ab":
                after, before = (getattr(end, f"p_WC{witness}") for end in ends)
                rate = (after - before) / (2.0 * STEP)
                result[f"dp_WC{witness}_dX_W{body}"][:, :, k] = rate
    return result


def scattered(name_A, name_B, n=40, exact=False):
    """Return (table, X_WA, X_WB) of n pairs in general position, apart and overlapping."""
    rng = np.random.default_rng(17)
    A, B = BODIES[name_A], BODIES[name_B]
    table = build_shape_table([A] * n + [B] * n, [exact] * n + [exact] * n)
    X_WA = np.array([pose(Rotation.random(random_state=rng), [0.3, -0.2, 0.5]) for _ in range(n)])
    X_WB = np.array([pose(Rotation.random(random_state=rng), np.zeros(3)) for _ in range(n)])
    X_WB[:, :3, 3] = X_WA[:, :3, 3] + rng.uniform(-0.25, 0.25, (n, 3))
    return table, X_WA, X_WB


@pytest.mark.parametrize(("name_A", "name_B"), PAIRS)
def test_derivatives_are_the_central_differences(name_A, name_B):
    """In general position nearly all pairs are differentiable, by the right amount."""
    table, X_WA, X_WB = scattered(name_A, name_B)
    X_WG, pairs = solved(table, X_WA, X_WB)
    found = witness_derivatives(table, X_WG, pairs)
    smooth = found["is_witness_differentiable"]
    assert smooth.sum() >= 30
    numeric = differences(table, X_WA, X_WB)
    for name in NAMES:
        # Second differences grow with the square of the derivative where a normal turns fast.
        scale = 1.0 + np.abs(found[name][smooth]).max(axis=(1, 2)) ** 2
        error = np.abs(found[name] - numeric[name])[smooth].max(axis=(1, 2))
        assert np.quantile(error / scale, 0.9) <= 1e-7, name
        assert (error / scale).max() <= 1e-4, name


def test_triangles_of_a_mesh():
    """A mesh measured by its triangles: faces, edges and vertices of it, apart."""
    n = 60
    rng = np.random.default_rng(3)
    table = build_shape_table([BODIES["ellipsoid"]] * n + [DENTED] * n, [False] * n + [True] * n)
    X_WA = np.array([pose(Rotation.random(random_state=rng), np.zeros(3)) for _ in range(n)])
    X_WB = np.array([pose(Rotation.random(random_state=rng), np.zeros(3)) for _ in range(n)])
    directions = rng.normal(size=(n, 3))
    X_WB[:, :3, 3] = 0.4 * directions / np.linalg.norm(directions, axis=1)[:, None]
    X_WG, pairs = solved(table, X_WA, X_WB)
    assert pairs.distance.min() > 0.0
    found = witness_derivatives(table, X_WG, pairs)
    smooth = found["is_witness_differentiable"]
    assert smooth.sum() >= 50
    numeric = differences(table, X_WA, X_WB)
    for name in NAMES:
        assert np.abs(found[name] - numeric[name])[smooth].max() <= 1e-6


@pytest.mark.parametrize(("name_A", "name_B"), PAIRS)
def test_the_way_between_the_witnesses_stays_along_the_normal(name_A, name_B):
    """``d(p_WCa - p_WCb) . nhat`` is the derivative of the distance, for every rate."""
    table, X_WA, X_WB = scattered(name_A, name_B)
    X_WG, pairs = solved(table, X_WA, X_WB)
    p_WCa, nhat = pairs.p_WCa, pairs.nhat_BA_W
    found = witness_derivatives(table, X_WG, pairs)
    along = np.einsum("ki,kij->kj", nhat, found["dp_WCa_dX_WA"] - found["dp_WCb_dX_WA"])
    arm = p_WCa - X_WA[:, :3, 3]
    expected = np.concatenate([np.cross(arm, nhat), nhat], axis=1)
    smooth = found["is_witness_differentiable"]
    size = 1.0 + np.abs(found["dp_WCa_dX_WA"]).max(axis=(1, 2))
    assert (np.abs(along - expected).max(axis=1) / size)[smooth].max() <= 1e-10


def test_moving_both_shapes_moves_the_witnesses_with_them():
    """A common motion of both shapes is one of the witnesses: the derivatives add up to it."""
    for name_A, name_B in PAIRS:
        table, X_WA, X_WB = scattered(name_A, name_B, 10)
        X_WG, pairs = solved(table, X_WA, X_WB)
        found = witness_derivatives(table, X_WG, pairs)
        for witness, point in (("a", pairs.p_WCa), ("b", pairs.p_WCb)):
            by_A = found[f"dp_WC{witness}_dX_WA"]
            total = by_A[:, :, 3:] + found[f"dp_WC{witness}_dX_WB"][:, :, 3:]
            size = 1.0 + np.abs(by_A).max()
            assert np.abs(total - np.eye(3)).max() <= 1e-9 * size
            assert np.isfinite(point).all()


def test_a_choice_is_told_and_stated():
    """Where faces are flat on each other the witnesses count as fixed to their shapes."""
    table = build_shape_table([Box(0.2, 0.2, 0.2), Box(0.1, 0.1, 0.1)], [False, False])
    X_WA, X_WB = pose(np.eye(3), np.zeros(3)), pose(np.eye(3), [0.02, 0.01, 0.2])
    X_WG, pairs = solved(table, X_WA[None], X_WB[None])
    found = witness_derivatives(table, X_WG, pairs)
    assert not found["is_witness_differentiable"][0]
    x, y, z = pairs.p_WCa[0]
    # v + omega x r at the witness, r from A's origin.
    fixed = [[0, z, -y, 1, 0, 0], [-z, 0, x, 0, 1, 0], [y, -x, 0, 0, 0, 1]]
    assert np.allclose(found["dp_WCa_dX_WA"][0], fixed, atol=1e-15)
    assert np.abs(found["dp_WCa_dX_WB"]).max() == 0.0


@pytest.mark.parametrize(
    ("A", "p_AB"),
    [
        (Capsule(0.1, 0.2), [0.3, 0.0, 0.1]),
        (Cylinder(0.1, 0.2), [0.3, 0.0, 0.1]),
        (Cylinder(0.1, 0.2), [0.1, 0.0, 0.3]),
        (Box(0.2, 0.2, 0.2), [0.1, 0.02, 0.3]),
        (Box(0.2, 0.2, 0.2), [0.1, 0.1, 0.3]),
        (rounded_hull(0.2, 20), None),
    ],
)
def test_kinks_are_told(A, p_AB):
    """A sphere over the border between two features of a surface has no derivative there."""
    if p_AB is None:
        corners = np.asarray(A.vertices)
        p_AB = 3.0 * corners[0]
        from scipy.spatial import ConvexHull

        hull = ConvexHull(corners)
        face = next(k for k, f in enumerate(hull.simplices) if 0 in f)
        p_AB = corners[0] + 0.2 * hull.equations[face, :3]
    table = build_shape_table([A, Sphere(0.05)], [False, False])
    X_WG, pairs = solved(table, np.eye(4)[None], pose(np.eye(3), p_AB)[None])
    found = witness_derivatives(table, X_WG, pairs)
    assert not found["is_witness_differentiable"][0]


def test_no_pairs():
    """Nothing in, nothing out, of the right shapes."""
    table = build_shape_table([Sphere(1.0), Sphere(1.0)], [False, False])
    X_WG = np.tile(np.eye(4), (2, 1, 1))
    pairs = solve_pairs(hold(table), X_WG, np.zeros((0, 2), np.int64), np.inf, WITHIN)
    found = witness_derivatives(table, X_WG, pairs)
    assert found["dp_WCa_dX_WA"].shape == (0, 3, 6)
