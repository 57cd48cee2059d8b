"""Motions with limits of jerk, beside those that others find."""

import numpy as np
import pytest

from benchmarks.jerk_limited_optimum import curve_of
from scene_graph_ros.planning.trajectories import (
    find_excess,
    MotionLimits,
    PiecewisePolynomial,
)
from scene_graph_ros.trajectories.jerk_limited import sample_jerk_limited


@pytest.mark.parametrize(
    ("seed", "best", "longer"), [(0, 2.0597, 1.02), (1, 1.4879, 1.06), (2, 1.9250, 1.05)]
)
def test_a_curve_takes_hardly_longer_than_the_best_motion(seed, best, longer):
    """IPOPT may be too fast between 150 or 60 jerks: `benchmarks.jerk_limited_optimum`.

    Ours is within all limits at all times.
    """
    curve, limits = curve_of(seed)
    found = sample_jerk_limited(curve, limits)
    assert found.excess is None
    assert find_excess(found.points.trajectory(), limits) is None
    assert 0.99 * best <= found.points.duration <= longer * best


@pytest.mark.parametrize("way", [10.0, 1.0, 0.1, 1e-3, 1e-6])
@pytest.mark.parametrize("jerk", [10.0, 500.0])
def test_a_straight_way_takes_whole_nanoseconds_more_than_it_must(way, jerk):
    """Seven phases: none is more than a nanosecond longer, or 3 us where it is shorter than that.

    Its distance with peak speed v is v (v / a + a / j), or v 2 sqrt(v / j) where it never comes
    to a; what is left is gone at the limit of speed.
    """
    v, a = 2.0, 5.0
    rise = min(a / jerk, np.sqrt(v / jerk))
    hold = max(v / a - a / jerk, 0.0)
    if v * (2.0 * rise + hold) <= way:
        least = way / v + 2.0 * rise + hold
    elif a / jerk * (a * a / jerk) * 2.0 <= way:
        # v^2 / a + v a / j is the way, in 2 (v / a + a / j).
        rises = a / jerk
        peak = 0.5 * a * (np.sqrt(rises**2 + 4.0 * way / a) - rises)
        least = 2.0 * (peak / a + rises)
    else:
        least = 4.0 * (0.5 * way / jerk) ** (1.0 / 3.0)
    limits = MotionLimits([v, v], [a, a], (), [jerk, jerk])
    ends = [[0.0, 0.0], [way, 0.5 * way]]
    found = sample_jerk_limited(PiecewisePolynomial.first_order_hold([0.0, 1.0], ends), limits)
    assert found.excess is None
    # Positions are rounded to 2e-16 of their size: in a phase of h that is 60 / h^3 of jerk.
    h = min(rise, least / 4.0)
    rounding = least * 60.0 * 2.2e-16 * way / (h**3 * jerk)
    assert least - 1e-9 <= found.points.duration <= least * (1.0 + 2e-9) + 2e-8 + rounding
