"""Into how many stretches with one speedup each a path is cut."""

from itertools import pairwise

import numpy as np
import pytest

from scene_graph_ros.planning.trajectories import MotionLimits, PiecewisePolynomial, retime
from scene_graph_ros.trajectories.corners import CornerPath
from scene_graph_ros.trajectories.retimer import TimeOptimalRetimer
from scene_graph_ros.trajectories.retimers.toppra_retimer import ToppraRetimer
from scene_graph_ros.trajectories.sample_along import sample_along


def bezier(*points):
    """Return control points ``(n, 1)`` of a curve from 0 to 3 along a line."""
    return np.array(points, dtype=float)[:, np.newaxis]


NEARLY_EVEN = bezier(0.0, 0.75, 1.5 + 1e-9, 2.25, 3.0)


@pytest.mark.parametrize(
    "segments",
    [
        # Straight, but for the rounding of whatever found it.
        [NEARLY_EVEN],
        [0.5 * NEARLY_EVEN, 1.5 + 0.5 * NEARLY_EVEN],
        [0.5 * NEARLY_EVEN, 1.5 + 0.5 * bezier(0.0, 0.75, 1.5, 2.25, 3.0)],
        # One of a hundred that are short, and a long one.
        [0.01 * NEARLY_EVEN, 0.03 + 0.99 * NEARLY_EVEN],
        # Its first derivatives vanish at an end, at both, inside.
        [bezier(0.0, 0.0, 1.0, 3.0)],
        [bezier(0.0, 0.0, 3.0, 3.0)],
        [bezier(0.0, 0.0, 0.0, 3.0, 3.0, 3.0)],
        [bezier(0.0, 2.0, 2.0, 3.0)],
        [bezier(0.0, 0.0, 1.5, 1.5), bezier(1.5, 1.5, 3.0, 3.0)],
        [bezier(0.0, 0.0, 0.0, 1.5, 1.5, 1.5), bezier(1.5, 1.5, 1.5, 3.0, 3.0, 3.0)],
    ],
)
def test_a_line_is_gone_along_from_rest_to_rest_however_it_is_parameterized(segments):
    """It takes 3 / v + v / a = 1.7 s at least, and stopping halfway twice 1.5 / v + v / a."""
    path = PiecewisePolynomial(np.arange(len(segments) + 1.0), np.array(segments))
    most = MotionLimits(np.array([2.0]), np.array([10.0]))
    for grid_points in (1, 2, 16, 64):
        motion = retime(path, most, grid_points=grid_points)
        assert 1.7 - 1e-6 <= motion.duration < 30.0
    assert motion.duration < 2.0
    if np.ptp(np.diff(path.control_points, axis=1)) < 1e-6:
        assert motion.duration < 1.7 + 1e-2


def test_a_nearly_straight_way_takes_no_longer_than_a_straight_one():
    """Of three edges that it stops between; each takes 3 / v + v / a."""
    most = MotionLimits(np.full(2, 2.0), np.full(2, 10.0))
    q = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 3.0], [0.0, 3.0]])
    parts = np.linspace(0.0, 1.0, 4)[:, np.newaxis]
    points = np.array([(1.0 - parts) * a + parts * b for a, b in pairwise(q)])
    points[:, 1] += 1e-9
    motion = retime(PiecewisePolynomial(np.arange(4.0), points), most)
    assert 3.0 * 1.7 - 1e-6 <= motion.duration < 3.0 * 1.75


@pytest.mark.parametrize("seed", [35, 66, 142])
def test_no_bend_slows_the_whole_motion_down(seed):
    """Along edges of very different lengths: at most 1 % longer than TOPP-RA's motion.

    There a cubic between two points exceeds the limits of accelerations by a tenth.
    """
    rng = np.random.default_rng(seed)
    edges = rng.normal(size=(10, 4)) * 10.0 ** rng.uniform(-2.0, 0.0, (10, 1))
    most = MotionLimits(10.0 ** rng.uniform(-0.5, 0.7, 4), 10.0 ** rng.uniform(0.0, 1.5, 4))
    corners = CornerPath(edges.cumsum(axis=0), most.velocities)
    curve = corners.rounded(corners.largest_sizes())
    found = sample_along(curve, most, retimer=TimeOptimalRetimer())
    assert found.excess is None
    assert found.points.duration <= 1.01 * ToppraRetimer(100).motion(curve, most).duration
