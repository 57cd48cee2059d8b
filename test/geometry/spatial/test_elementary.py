"""Sines, arcs and logarithms in our own arithmetic, against 50 digits and more."""

import math

import mpmath
import numpy as np
import pytest

from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.geometry.compiled.lanes import LANES
from scene_graph_ros.geometry.spatial.elementary import (
    arc_sine,
    arc_sines,
    arc_tangent,
    arc_tangents,
    binary_logarithm,
    sine_cosine,
    sines_and_cosines,
    sines_cosines,
)


@kernel
def _of_eight(angles, sines, cosines):
    sines_cosines(angles, sines, cosines)


_NEAR = [
    *np.random.default_rng(1).uniform(-7.0, 7.0, 400),
    *np.random.default_rng(2).uniform(-1e5, 1e5, 400),
    *(k * math.pi / 4 for k in range(-16, 17)),
    *(np.nextafter(k * math.pi / 2, 9.0) for k in (1, 2, 3, 50_001)),
    *(0.0, -0.0, 5e-324, 1e-9),
]
_FAR = [*np.random.default_rng(3).uniform(-1.0, 1.0, 50) * 1e9, 1.1e5, -3e7, 1e12, -9e15]
_SPECIAL = (0.0, -0.0, 1.0, -1.0, math.inf, -math.inf, 5e-324, -1.7e308, 1e-310)


def _units_off(found, truth):
    """Return an error in units in the last place."""
    return abs(mpmath.mpf(found) - truth) / np.spacing(max(abs(found), 1e-290))


def test_sines_and_cosines_are_right_to_two_units_in_the_last_place():
    """Also next to quarter turns and tiny; far away, to 1e-15."""
    sines, cosines = (values.tolist() for values in sines_and_cosines(np.array(_NEAR + _FAR)))
    with mpmath.workdps(60):
        for k, angle in enumerate(map(float, _NEAR + _FAR)):
            for found, truth in ((sines[k], mpmath.sin(angle)), (cosines[k], mpmath.cos(angle))):
                if k < len(_NEAR):
                    assert _units_off(found, truth) <= 2.1, angle
                else:
                    assert abs(found - truth) <= 1e-15, angle


def test_one_angle_has_the_bits_of_eight():
    """Whatever stands beside it in its lanes, also one that is far away or no number."""
    angles = np.array([*_NEAR, *_FAR, 1e300, math.nan, math.inf])
    padded = np.resize(angles, (-(-len(angles) // LANES), LANES))
    sines, cosines = np.empty_like(padded), np.empty_like(padded)
    for row in range(len(padded)):
        _of_eight(padded[row], sines[row], cosines[row])
    one_by_one = np.array([sine_cosine(angle) for angle in padded.ravel()])
    np.testing.assert_array_equal(np.column_stack([sines.ravel(), cosines.ravel()]), one_by_one)
    assert np.isnan(one_by_one).any(axis=1).sum() == np.count_nonzero(~np.isfinite(padded))


def test_arcs_are_right_to_two_units_in_the_last_place():
    """In all quadrants, of all sizes."""
    generator = np.random.default_rng(4)
    y, x = generator.uniform(-1.0, 1.0, (2, 1000))
    sizes = 10.0 ** generator.uniform(-300.0, 300.0, (2, 500))
    y, x = np.append(y, y[:500] * sizes[0]), np.append(x, x[:500] * sizes[1])
    with mpmath.workdps(50):
        for found, a, b in zip(arc_tangents(y, x).tolist(), y.tolist(), x.tolist(), strict=True):
            assert _units_off(found, mpmath.atan2(a, b)) <= 2.0, (a, b)
        sines = np.append(y[:1000], 1.0 - 10.0 ** -generator.uniform(0.0, 16.0, 200))
        for found, sine in zip(arc_sines(sines).tolist(), sines.tolist(), strict=True):
            assert _units_off(found, mpmath.asin(sine)) <= 2.0, sine


@pytest.mark.parametrize("y", _SPECIAL)
@pytest.mark.parametrize("x", _SPECIAL)
def test_arcs_of_zeros_and_infinities_are_those_of_the_standard(y, x):
    """Signs of zeros count (IEEE 754-2019, 9.2.1)."""
    found, truth = arc_tangent(y, x), math.atan2(y, x)
    assert abs(found - truth) <= np.spacing(abs(truth))
    assert math.copysign(1.0, found) == math.copysign(1.0, truth)


def test_arcs_of_what_is_no_number_are_none():
    """By either of both."""
    for y, x in ((math.nan, 1.0), (1.0, math.nan), (math.nan, 0.0), (math.inf, math.nan)):
        assert math.isnan(arc_tangent(y, x))


@pytest.mark.compiled
def test_a_sine_beyond_1_has_no_arc():
    """In Python its root would be an error."""
    assert math.isnan(arc_sine(1.0 + 1e-9))


def test_logarithms_of_powers_of_two_are_exact_and_others_right():
    """To 3e-16 of the larger of the logarithm and 1."""
    assert all(binary_logarithm(2.0**k) == k for k in range(-1022, 1024))
    generator = np.random.default_rng(5)
    for x in (*generator.uniform(0.1, 8.0, 500), *10.0 ** generator.uniform(-300, 300, 500)):
        with mpmath.workdps(40):
            truth = mpmath.log(mpmath.mpf(float(x)), 2)
            assert abs(binary_logarithm(x) - truth) <= 3e-16 * max(1, abs(truth)), x
