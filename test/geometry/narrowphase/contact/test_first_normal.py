"""A corner outside of a rim or an ellipsoid tells the normal; what else there is leaves it."""

import numba
import numpy as np
import pytest
from scipy.optimize import minimize

from scene_graph_ros.geometry.narrowphase.contact.first_normal import first_normal
from scene_graph_ros.geometry.narrowphase.cores.kinds import CYLINDER, ELLIPSOID, IDENTITY, POINT
from scene_graph_ros.geometry.narrowphase.features import RIM, SMOOTH, VERTEX
from scene_graph_ros.geometry.narrowphase.pair import Features

RADIUS, AXES = 0.2, np.array([0.3, 0.2, 0.1])
CENTRE = np.array([0.05, -0.02, 0.03])
ZEROS = 6 * (0.0,)
POINTS = (POINT, -1, 0.0, (0.0, 0.0, 0.0, *ZEROS))
SIZE = 1.0
FEATURES = {
    "rim": ((RIM, tuple(CENTRE), (0.0, 0.0, 1.0), RADIUS, 0.0, 0.0), (CYLINDER, -1, 0.0)),
    "ellipsoid": ((SMOOTH, tuple(CENTRE), (0.0, 0.0, 0.0), 0.0, 0.0, 0.0), (ELLIPSOID, -1, 0.0)),
}


@numba.njit
def found(features, n):
    """Call the intrinsic, which only kernels can."""
    return first_normal(features, n, SIZE)


def asked(name, corner, n, *, swapped):
    """Return the direction from a feature to a corner that begins with n."""
    feature, core = FEATURES[name]
    core = (*core, (*map(float, AXES), *ZEROS))
    vertex = (VERTEX, tuple(map(float, corner)), (0.0, 0.0, 0.0), 0.0, 0.0, 0.0)
    n = tuple(map(float, n))
    if swapped:
        features = Features(feature, vertex, core, POINTS, IDENTITY)
        return -np.array(found(features, tuple(-x for x in n)))
    return np.array(found(Features(vertex, feature, POINTS, core, IDENTITY), n))


def nearest(name, corner):
    """Return the point of a feature nearest to a corner, by minimization over angles."""

    def at(angles):
        c, s = np.cos(angles), np.sin(angles)
        if name == "rim":
            return CENTRE + RADIUS * np.array([c[0], s[0], 0.0])
        return CENTRE + AXES * np.array([c[0] * c[1], s[0] * c[1], s[1]])

    starts = [(x, y) for x in np.linspace(-3.0, 3.0, 7) for y in (-1.0, 0.0, 1.0)]
    results = [
        minimize(lambda a: np.sum((at(a) - corner) ** 2), start, options={"gtol": 1e-12})
        for start in starts
    ]
    return at(min(results, key=lambda result: result.fun).x)


@pytest.mark.parametrize("swapped", [False, True])
@pytest.mark.parametrize("name", FEATURES)
def test_it_leads_from_what_is_nearest_to_the_corner(name, swapped):
    """From a normal that is known roughly, whichever of the two is the first."""
    rng = np.random.default_rng(1)
    for _ in range(10):
        d = rng.normal(size=3)
        corner = CENTRE + 0.5 * d / np.linalg.norm(d)
        expected = corner - nearest(name, corner)
        expected /= np.linalg.norm(expected)
        n = expected + 0.2 * rng.normal(size=3)
        n /= np.linalg.norm(n)
        np.testing.assert_allclose(
            asked(name, corner, n, swapped=swapped), expected, rtol=0.0, atol=1e-6
        )


@pytest.mark.parametrize("swapped", [False, True])
@pytest.mark.parametrize("name", FEATURES)
def test_another_direction_is_left_as_it_is(name, swapped):
    """One that leads elsewhere, or out of what the corner is in."""
    corner = CENTRE + np.array([0.5, 0.1, 0.2])
    inside = CENTRE + np.array([0.15, 0.0, 0.0])
    for place, n in (
        (corner, (-0.6, 0.8, 0.0)),
        (inside, (1.0, 0.0, 0.0)),
        (corner, (-1.0, 0.0, 0.0)),
    ):
        np.testing.assert_array_equal(asked(name, place, n, swapped=swapped), n)


def test_a_corner_on_a_rim_leaves_the_normal():
    """The direction between them would be rounding."""
    corner, n = CENTRE + np.array([RADIUS, 0.0, 1e-9]), (0.0, 0.6, 0.8)
    np.testing.assert_array_equal(asked("rim", corner, n, swapped=False), n)


def test_huge_coordinates_are_no_error():
    """What overflows leaves the normal."""
    for name in FEATURES:
        for corner in ((1e200, 0.0, 0.0), (1e308, 1e308, 1e308)):
            n = asked(name, corner, (0.0, 0.0, 1.0), swapped=False)
            assert np.isfinite(n).all()
