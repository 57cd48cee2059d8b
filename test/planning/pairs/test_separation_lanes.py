"""Lower bounds of eight pairs' distances: never above the truth, and exact where faces decide."""

from typing import NamedTuple

import numpy as np
import pytest
from scipy.optimize import lsq_linear
from scipy.spatial.transform import Rotation

from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.geometry.compiled.lanes import store_lanes
from scene_graph_ros.planning.pairs.separation_lanes import (
    COVER,
    new_covers,
    place_cover,
    separations,
)

EIGHT = 8
A = tuple(COVER * k for k in range(EIGHT))
B = tuple(COVER * (EIGHT + k) for k in range(EIGHT))


class _Places(NamedTuple):
    X_WG: np.ndarray
    centers: np.ndarray


@kernel
def _write(covers, at_A, at_B, out):
    store_lanes(out, 0, separations(covers, at_A, at_B))


@kernel
def _place(places, b, k, covers):
    place_cover(places, b, k, covers)


def _bounds(halves, radii, rotations, centers):
    """Return the bounds of eight pairs; body k of A comes before all of B."""
    covers = new_covers(-halves, halves, radii)
    rows = covers.reshape(-1, COVER)
    rows[:, :9] = rotations.transpose(0, 2, 1).reshape(-1, 9)
    rows[:, 12:15] = centers
    out = np.empty(EIGHT)
    _write(covers, A, B, out)
    return out


def _distance_of_boxes(half_A, R_A, p_A, half_B, R_B, p_B):
    """Return the distance of boxes, by least squares within bounds."""
    limits = np.concatenate([half_A, half_B])
    found = lsq_linear(np.hstack([R_A, -R_B]), p_B - p_A, (-limits, limits), tol=1e-14)
    return np.linalg.norm(found.fun)


@pytest.mark.parametrize("far", [0.5, 2.0, 20.0])
def test_bounds_of_boxes_are_never_above_their_distance(far):
    """Random boxes, thin ones too; most of those that are apart are told to be."""
    rng, apart, told = np.random.default_rng(1), 0, 0
    for _ in range(40):
        halves = np.exp(rng.uniform(-4.0, 0.0, (2 * EIGHT, 3)))
        rotations = Rotation.random(2 * EIGHT, random_state=rng).as_matrix()
        centers = far * rng.uniform(-1.0, 1.0, (2 * EIGHT, 3))
        radii = np.linalg.norm(halves, axis=1)
        bounds = _bounds(halves, radii, rotations, centers)
        for k in range(EIGHT):
            a, b = k, EIGHT + k
            truth = _distance_of_boxes(
                halves[a], rotations[a], centers[a], halves[b], rotations[b], centers[b]
            )
            # Least squares end at points of both boxes, so what they find is no less.
            assert bounds[k] <= truth + 1e-14
            apart += truth > 1e-6
            told += bounds[k] > 0.0 and truth > 1e-6
    assert apart > 100
    assert told > 0.9 * apart


def test_bounds_of_balls_and_of_boxes_face_to_face():
    """Balls, d apart, in boxes that reach out of them; boxes turned alike, d apart, to 1e-13 m."""
    rng = np.random.default_rng(2)
    radii = rng.uniform(0.1, 1.0, 2 * EIGHT)
    rotations = Rotation.random(2 * EIGHT, random_state=rng).as_matrix()
    ways = rng.normal(size=(EIGHT, 3))
    ways /= np.linalg.norm(ways, axis=1)[:, np.newaxis]
    d = rng.uniform(0.01, 3.0, EIGHT)
    centers = rng.normal(size=(2 * EIGHT, 3))
    centers[EIGHT:] = centers[:EIGHT] + (d + radii[:EIGHT] + radii[EIGHT:])[:, np.newaxis] * ways
    halves = np.repeat(radii[:, np.newaxis], 3, axis=1)
    bounds = _bounds(halves, radii, rotations, centers)
    assert (bounds <= d + 1e-15).all()
    # From a ball's centre to the other's box, whose corners reach out of its ball.
    assert (bounds >= d - (np.sqrt(3.0) - 1.0) * radii.max()).all()
    halves = rng.uniform(0.1, 1.0, (2 * EIGHT, 3))
    rotations[EIGHT:] = rotations[:EIGHT]
    axes = np.arange(EIGHT) % 3
    along = halves[np.arange(EIGHT), axes] + halves[EIGHT + np.arange(EIGHT), axes] + d
    signs = np.where(rng.random(EIGHT) < 0.5, -1.0, 1.0)
    columns = rotations[np.arange(EIGHT), :, axes]
    centers[EIGHT:] = centers[:EIGHT] + (signs * along)[:, np.newaxis] * columns
    bounds = _bounds(halves, np.linalg.norm(halves, axis=1), rotations, centers)
    np.testing.assert_allclose(bounds, d, rtol=0.0, atol=1e-13)


def test_bounds_of_boxes_in_boxes_are_how_deep_they_are():
    """Boxes turned alike, one's centre in the other: as deep as along the axis of least depth."""
    rng = np.random.default_rng(4)
    halves = rng.uniform(0.1, 1.0, (2 * EIGHT, 3))
    rotations = Rotation.random(2 * EIGHT, random_state=rng).as_matrix()
    rotations[EIGHT:] = rotations[:EIGHT]
    offsets = rng.uniform(-1.0, 1.0, (EIGHT, 3)) * halves[EIGHT:]
    offsets[0], offsets[1, 1:] = 0.0, 0.0
    centers = np.zeros((2 * EIGHT, 3))
    centers[:EIGHT] = np.einsum("nij,nj->ni", rotations[:EIGHT], offsets)
    depths = (halves[:EIGHT] + halves[EIGHT:] - np.abs(offsets)).min(axis=1)
    for radii in (np.linalg.norm(halves, axis=1), np.full(2 * EIGHT, 10.0)):
        bounds = _bounds(halves, radii, rotations, centers)
        np.testing.assert_allclose(bounds, -depths, rtol=0.0, atol=1e-13)


def test_of_half_spaces_nothing_is_known_and_bodies_are_placed_by_configuration():
    """Covers of half spaces are zero; a body's axes and centre are those of its configuration."""
    lower, upper = np.array([[-1.0, -2.0, -3.0], [-np.inf] * 3]), np.array([[3.0, 4.0, 5.0]] * 2)
    upper[1] = (np.inf, np.inf, 0.0)
    covers = new_covers(lower, upper, np.array([7.0, np.inf]))
    np.testing.assert_array_equal(covers[9:16], [2.0, 3.0, 4.0, 0.0, 0.0, 0.0, 7.0])
    np.testing.assert_array_equal(covers[COVER:], np.zeros(COVER))
    rng = np.random.default_rng(3)
    X_WG, centers = rng.normal(size=(2, 12, EIGHT)), rng.normal(size=(2, 3, EIGHT))
    _place(_Places(X_WG, centers), 0, 5, covers)
    X = X_WG[0, :, 5].reshape(3, 4)
    np.testing.assert_array_equal(covers[:9].reshape(3, 3), X[:, :3].T)
    np.testing.assert_array_equal(covers[12:15], centers[0, :, 5])
    np.testing.assert_array_equal(covers[16:19], X[:, 3])
