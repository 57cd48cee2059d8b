"""Pairs thrown out by a few directions are apart; those that touch are never thrown out."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from scene_graph_ros.geometry import Box, Capsule, Convex, Cylinder, Ellipsoid, HalfSpace, Sphere
from scene_graph_ros.geometry.broadphase.aabb import box_geometry, place_rows
from scene_graph_ros.geometry.broadphase.extents import OFFSET
from scene_graph_ros.geometry.broadphase.separating_axes import drop_separated
from scene_graph_ros.geometry.tables.shape_table import build_shape_table

OCTAHEDRON = 0.3 * np.concatenate([np.eye(3), -np.eye(3)])
MANY = np.random.default_rng(1).normal(size=(60, 3))
MANY *= 0.3 / np.linalg.norm(MANY, axis=1, keepdims=True)
SHAPES = [
    Sphere(0.3),
    Capsule(0.2, 0.4),
    Box(0.2, 0.4, 0.6),
    Cylinder(0.3, 0.5),
    Ellipsoid(0.1, 0.2, 0.4),
    Convex(vertices=np.add(OCTAHEDRON, [0.5, 0.2, 0.1])),  # its origin is not inside
    Convex(vertices=MANY),  # bounded by its box
]


def are_kept(A, X_WA, B, X_WB, margin: float = 0.0) -> bool:
    """Tell whether the pair is kept."""
    table = build_shape_table([A, B], [False, False])
    X_WG = np.array([X_WA, X_WB])
    geometry = box_geometry(table)
    centres = place_rows(geometry, X_WG).centre
    pairs = np.array([[0, 1]])
    return drop_separated(geometry.extents, centres, X_WG, pairs, 1, margin) == 1


def pose(p, R=None) -> np.ndarray:
    """Return a pose."""
    X = np.eye(4)
    X[:3, 3] = p
    if R is not None:
        X[:3, :3] = R.as_matrix()
    return X


def inner_point(shape, rng) -> np.ndarray:
    """Return a point inside of a shape, in its frame: all shapes but hulls are star-shaped."""
    if isinstance(shape, Convex):
        weights = rng.dirichlet(np.ones(len(shape.vertices)))
        return weights @ np.asarray(shape.vertices)
    return np.zeros(3)


@pytest.mark.parametrize("A", SHAPES, ids=lambda s: type(s).__name__)
@pytest.mark.parametrize("B", SHAPES, ids=lambda s: type(s).__name__)
@pytest.mark.parametrize("far", [0.0, 1e6])
def test_pairs_with_a_common_point_are_kept(A, B, far: float) -> None:
    """Two shapes that share an inner point, turned any way and anywhere, stay a pair."""
    rng = np.random.default_rng(7)
    for turns in Rotation.random(40, random_state=8).as_matrix().reshape(20, 2, 3, 3):
        R_A, R_B = map(Rotation.from_matrix, turns)
        common = far + rng.normal(size=3)
        X_WA = pose(common - R_A.apply(inner_point(A, rng)), R_A)
        X_WB = pose(common - R_B.apply(inner_point(B, rng)), R_B)
        assert are_kept(A, X_WA, B, X_WB)


@pytest.mark.parametrize("gap", [0.0, 1e-16, 1e-9])
def test_touching_is_kept_and_the_margin_counts(gap: float) -> None:
    """Balls are dropped exactly when the gap between them is more than the margin."""
    X_WB = pose([0.6 + 0.1 + gap, 0.0, 0.0])
    assert are_kept(Sphere(0.3), pose([0.0, 0.0, 0.0]), Sphere(0.3), X_WB, 0.1 + gap)
    assert not are_kept(Sphere(0.3), pose([0.0, 0.0, 0.0]), Sphere(0.3), X_WB, 0.1 + gap - 1e-9)


def test_boxes_whose_bounds_meet_are_dropped() -> None:
    """A cube turned by 45 degrees leaves its bound's corners empty: a ball there is no pair.

    The cube's face with the normal (1, 1, 0) is 0.5 from the origin; the ball's centre is 0.71
    along it, so they are 0.11 apart, though the ball reaches into the bound, which ends at 0.71.
    """
    turned = pose([0, 0, 0], Rotation.from_euler("z", 45, degrees=True))
    assert not are_kept(Box(1, 1, 1), turned, Sphere(0.1), pose([0.5, 0.5, 0.0]))
    assert are_kept(Box(1, 1, 1), turned, Sphere(0.1), pose([0.5, 0.5, 0.0]), 0.12)


def test_hulls_are_bounded_by_a_ball_and_by_a_box() -> None:
    """Along the diagonal of a hull's box, the ball around it ends before the box does."""
    hull = Convex(vertices=OCTAHEDRON)  # 0.3 at most; its box reaches 0.52 along the diagonal
    diagonal = np.ones(3) / np.sqrt(3)
    assert not are_kept(hull, pose([0, 0, 0]), Sphere(0.1), pose(0.41 * diagonal))
    flat = Convex(vertices=OCTAHEDRON * [1, 1, 0.1])
    assert not are_kept(flat, pose([0, 0, 0]), Sphere(0.1), pose([0, 0, 0.14]))
    assert are_kept(flat, pose([0, 0, 0]), Sphere(0.1), pose([0, 0, 0.12]))


def test_each_row_has_the_centre_and_the_ball_of_its_own_hull() -> None:
    """Rows of several hulls, some of them shared, between others: as computed one by one."""
    flat = Convex(vertices=np.add(OCTAHEDRON * [1, 1, 0.1], [0.0, 0.3, -0.2]))
    shapes = [HalfSpace(), SHAPES[5], Sphere(0.1), flat, SHAPES[6], SHAPES[5], flat, Box(1, 1, 1)]
    geometry = box_geometry(build_shape_table(shapes, [False] * len(shapes)))
    for shape, row, extents in zip(shapes, geometry.centres, geometry.extents, strict=True):
        centre, radius = np.zeros(3), np.inf
        if isinstance(shape, Convex):
            points = np.asarray(shape.vertices)
            centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
            radius = np.linalg.norm(points - centre, axis=1).max()
        np.testing.assert_allclose(row, [*centre, radius], rtol=1e-15, atol=1e-16)
        assert extents[OFFSET] == pytest.approx(np.abs(centre).sum(), rel=1e-15, abs=1e-16)


def test_half_spaces_are_never_dropped() -> None:
    """A half space has no extent to compare: its pairs are left to the exact distance."""
    assert are_kept(Sphere(0.1), pose([0, 0, 9]), HalfSpace(), pose([0, 0, 0]))
