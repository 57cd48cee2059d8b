"""Points against ellipsoids, also needles and plates, with mpmath as the reference."""

from hypothesis import given, settings
from hypothesis import strategies as st
from measuring import measure_point
import mpmath as mp
import numpy as np
import pytest

from scene_graph_ros.geometry import Ellipsoid


def reference(semi_axes, p):
    """Return the signed distance with 60 digits, by bisection on the multiplier.

    The nearest point is x_i = e_i^2 p_i / (t + e_i^2), and phi = t |(x_i / e_i^2)|; with t + e_m^2
    as the unknown, m the shortest axis with p_m != 0. Where the shortest axis has p = 0 and no
    root is above its pole, the point is on the medial disc: t = -e_min^2.
    """
    mp.mp.dps = 60
    e = [mp.mpf(float(v)) for v in semi_axes]
    y = [abs(mp.mpf(float(v))) for v in p]
    shortest = min(e)
    if all(b == 0 for a, b in zip(e, y, strict=True) if a == shortest):
        others = [(a, b) for a, b in zip(e, y, strict=True) if b > 0]
        rest = 1 - sum((a * b / (a * a - shortest**2)) ** 2 for a, b in others)
        if rest >= 0:
            square = sum((b / (a * a - shortest**2)) ** 2 for a, b in others) + rest / shortest**2
            return -(shortest**2) * mp.sqrt(square)
    pole = min(a * a for a, b in zip(e, y, strict=True) if b > 0)
    terms = [(a, b) for a, b in zip(e, y, strict=True) if b > 0]

    def excess(s):
        return sum((a * b / (s + (a * a - pole))) ** 2 for a, b in terms) - 1

    low = mp.log(max(a * b for a, b in terms if a * a == pole))
    high = mp.log(2 * mp.sqrt(sum((a * b) ** 2 for a, b in terms)))
    for _ in range(220):
        middle = (low + high) / 2
        low, high = (middle, high) if excess(mp.exp(middle)) > 0 else (low, middle)
    s = mp.exp((low + high) / 2)
    return (s - pole) * mp.sqrt(sum((b / (s + (a * a - pole))) ** 2 for a, b in terms))


def check(semi_axes, p):
    """Check one point: distance, nearest point on the surface, gradient along the normal."""
    semi_axes, p = np.array(semi_axes, dtype=float), np.array(p, dtype=float)
    answer = measure_point(Ellipsoid(*semi_axes), p)
    size = 2 * semi_axes.max() + np.linalg.norm(p)
    assert abs(float(mp.mpf(answer.distance) - reference(semi_axes, p))) <= 4e-15 * size
    on_sphere = answer.p_GN / semi_axes
    assert on_sphere @ on_sphere == pytest.approx(1.0, rel=0, abs=4e-15)
    normal = on_sphere / semi_axes
    np.testing.assert_allclose(answer.grad_W, normal / np.linalg.norm(normal), atol=4e-15)
    return answer


@settings(max_examples=60, deadline=None)
@given(
    st.tuples(*[st.floats(-4.0, 0.0)] * 3),
    st.tuples(*[st.floats(-3.0, 3.0)] * 3),
    st.sampled_from([1e-4, 1 / 3, 1e4]),
)
def test_random_ellipsoids(exponents, place, scale):
    """Any aspect up to 1:1e4, any point within three semi-axes of the centre."""
    semi_axes = scale * 10.0 ** np.array(exponents)
    check(semi_axes, semi_axes * np.array(place))


@settings(max_examples=40, deadline=None)
@given(
    st.tuples(*[st.floats(-4.0, 0.0)] * 3),
    st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1),
    st.sampled_from([-0.5, -1e-9, 0.0, 1e-15, 1e-6, 10.0]),
)
def test_points_at_a_known_height(exponents, direction, height):
    """A point placed on the normal of a surface point, outside, is that high above it."""
    semi_axes = 10.0 ** np.array(exponents)
    unit = np.array(direction) / np.linalg.norm(direction)
    normal = unit / semi_axes
    normal /= np.linalg.norm(normal)
    answer = check(semi_axes, semi_axes * unit + max(height, 0.0) * normal)
    assert answer.distance == pytest.approx(max(height, 0.0), rel=1e-14, abs=1e-15)
    check(semi_axes, semi_axes * unit * (1.0 + 0.5 * min(height, 0.0)))


@pytest.mark.parametrize("semi_axes", [(3.0, 2.0, 1.0), (1.0, 3.0, 2.0), (2.0, 1.0, 3.0)])
def test_centre_leaves_by_the_shortest_axis(semi_axes):
    """At the centre the positive end of the shortest axis is chosen, and said to be a choice."""
    answer = check(semi_axes, (0.0, 0.0, 0.0))
    shortest = np.eye(3)[np.argmin(semi_axes)]
    assert answer.distance == -1.0
    np.testing.assert_array_equal(answer.p_GN, shortest)
    np.testing.assert_array_equal(answer.grad_W, shortest)
    assert not answer.unique


def test_inside_and_outside_the_focal_curve():
    """On the plane of symmetry, two mirror images are nearest only inside the focal curve.

    For semi-axes (2, 1) the evolute's cusp is at (4 - 1) / 2 = 1.5 on the long axis.
    """
    inside = check((2.0, 1.5, 1.0), (1.4, 0.0, 0.0))
    assert not inside.unique
    assert inside.p_GN[2] > 0.1
    outside = check((2.0, 1.5, 1.0), (1.6, 0.0, 0.0))
    assert outside.unique
    np.testing.assert_allclose(outside.p_GN, (2.0, 0.0, 0.0), atol=1e-15)
    assert outside.distance == pytest.approx(-0.4, abs=1e-15)


@pytest.mark.parametrize("tiny", [0.0, 1e-300, 1e-160, 1e-30, 1e-17, 1e-12])
@pytest.mark.parametrize("place", [1.4, 1.5, 1.5 * (1 + 1e-15), 1.5000001, 1.6])
def test_around_the_focal_point(place, tiny):
    """Next to the focal point and the plane of symmetry the distance stays exact."""
    check((2.0, 1.0, 1.0), (place, 0.0, tiny))
    check((2.0, 1.5, 1.0), (place, tiny, tiny))


def test_a_sphere_is_an_ellipsoid():
    """Equal axes give the sphere's answer, and the choice of +x at the centre."""
    answer = check((0.5, 0.5, 0.5), (0.2, -0.3, 0.6))
    assert answer.distance == pytest.approx(0.2, abs=1e-15)
    centre = check((0.5, 0.5, 0.5), (0.0, 0.0, 0.0))
    np.testing.assert_array_equal(centre.grad_W, (1.0, 0.0, 0.0))


@pytest.mark.parametrize("semi_axes", [(1.0, 0.5, 1e-9), (1e-9, 1.0, 1e-9), (1e7, 1e-9, 1e-3)])
@pytest.mark.parametrize(
    "place", [(0.3, -0.4, 0.2), (-0.6, 0.9, 2.0), (1e9, 3.0, -1e3), (0, 1, 1)]
)
def test_needles_and_plates_whose_products_overflow(semi_axes, place):
    """Squares of the ratios of the semi-axes exceed what Halley's steps are taken for."""
    check(semi_axes, np.array(semi_axes) * place)
    check(semi_axes, place)


@pytest.mark.parametrize("distance", [1e3, 1e8, 1e15, 1e17, 1e30])
def test_points_far_away(distance):
    """The distance is exact also where that of the surface is rounding beside it."""
    check((0.3, 0.2, 0.1), distance * np.array([0.6, -0.48, 0.64]))
