"""Sizes from 1e-4 to 1e4, far away, a million to one, and aspects of ten thousand to one."""

import functools

from hard_corpus.batches import complaints, solve
from hard_corpus.constructed import BODIES, constructed, grown, SIZE
from hard_corpus.extremes import THIN
import numpy as np
import pytest

SCALES = [(gap, scale) for gap in (0.01, 0.0, -0.01) for scale in (1e-4, 1e-2, 1e2, 1e4)]


def _scaled(gap, scale):
    bodies = grown(BODIES, scale)
    return complaints(constructed(gap * SIZE * scale, bodies=bodies, rolls=(0.7,), reach=scale))


@pytest.mark.parametrize(("gap", "scale"), SCALES)
def test_scaled_pairs_are_as_exact_as_the_original(gap, scale):
    """At every size the distance is the constructed one to 1e-12 L, apart, touching and deep."""
    assert _scaled(gap, scale) == []


@pytest.mark.parametrize("distance", [2e-3, -2e-3])
def test_scene_a_thousand_kilometres_away(distance):
    """Far poses answer exactly like the near ones with the same exact difference of positions."""
    rng = np.random.default_rng(9)
    far, near = [], []
    for case in constructed(distance, rolls=(0.7,)):
        X_WA, X_WB, X_0B = case.X_WA.copy(), case.X_WB.copy(), case.X_WB.copy()
        offset = rng.uniform(-1e6, 1e6, 3)
        X_WA[:3, 3] += offset
        X_WB[:3, 3] += offset
        X_0B[:3, 3] = X_WB[:3, 3] - X_WA[:3, 3]  # exact: they are close to each other
        X_0A = case.X_WA.copy()
        X_0A[:3, 3] = 0.0
        far.append(case._replace(X_WA=X_WA, X_WB=X_WB))
        near.append(case._replace(X_WA=X_0A, X_WB=X_0B))
    one, two = solve(far), solve(near)
    assert np.array_equal(one.distance, two.distance)
    assert np.array_equal(one.p_ACa, two.p_ACa)
    assert np.array_equal(one.p_BCb, two.p_BCb)
    # Coordinates of 1e6 m are rounded by at most 2**-34 = 0.6e-10 m per axis and body.
    assert np.abs(one.distance - distance).max() <= 2.1e-10
    # World coordinates can't be better than their rounding.
    rest = one.p_WCa - one.p_WCb - one.distance[:, None] * one.nhat_BA_W
    assert np.abs(rest).max() <= 2.4e-10


@functools.cache
def _tiny(distance):
    bodies = {name: body for name, body in BODIES.items() if name != "half_space"}
    cases = constructed(distance, bodies=bodies, others=grown(bodies, 1e-6), rolls=(0.7,))
    assert len(cases) > 250
    return complaints(cases, bound=1e-9)


@pytest.mark.parametrize("distance", [1e-3, 1e-8, 1e-12, 1e-15, 0.0, -1e-15, -1e-9, -1e-3])
def test_a_body_a_million_times_smaller(distance):
    """Beside, touching and inside the larger one, also where it is deep by 5000 of its sizes."""
    assert _tiny(distance) == []


@functools.cache
def _slender(distance):
    cases = constructed(distance, bodies=THIN, margin=10.0)
    assert len(cases) > 1000
    return complaints(cases, bound=1e-9)


@pytest.mark.parametrize("distance", [1e-2, 1e-6, 0.0, -1e-5])
def test_needles_plates_and_blades(distance):
    """Aspects of 1 : 10000, ellipsoids of 1 : 1000, at every combination of features."""
    assert _slender(distance) == []
