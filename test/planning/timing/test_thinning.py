"""Trajectories of fewer points: near the one they were thinned of, within limits, proven free."""

import numpy as np
import pytest
from robot_scenes import CART, diagram, POST

from scene_graph_ros.planning import (
    SceneGraphCollisionChecker,
    thin_trajectory,
    time_path,
    TimingFailure,
)
from scene_graph_ros.planning.trajectories import find_excess, MotionLimits, TrajectoryError

PATH = np.array([[-0.5, -0.5], [0.5, 0.4], [1.3, -0.6], [2.0, 0.6], [2.5, -0.3]])


@pytest.fixture(scope="module")
def checker(tmp_path_factory):
    """A ball on two rails, x from -1 to 3 and y from -1 to 1, with a post aside."""
    robots = diagram(tmp_path_factory.mktemp("cart"), CART, POST.format(x=1.3, y=0.4))
    return SceneGraphCollisionChecker(robots)


def limits(jerk):
    """Return those of the rails."""
    return MotionLimits([1.0, 1.0], [2.0, 2.0], ("x", "y"), None if jerk is None else [jerk] * 2)


def apart(first, second):
    """Return how far two trajectories are apart, at 20 001 shares of their durations."""
    share = np.linspace(0.0, 1.0, 20_001)
    q = [each.trajectory.value(share * each.duration) for each in (first, second)]
    return float(np.abs(q[0] - q[1]).max())


@pytest.mark.parametrize("jerk", [None, 20.0])
@pytest.mark.parametrize("share", [0.8, 0.6])
def test_fewer_points_are_as_near_as_they_say(checker, jerk, share):
    """Also between points, within all limits, free, from rest to rest, hardly slower."""
    timed = time_path(checker, PATH, limits(jerk))
    count = int(share * len(timed.points.positions))
    thinned = thin_trajectory(checker, timed, limits(jerk), count, deviation=0.01)
    assert thinned.is_success, thinned.reason
    assert len(thinned.points.positions) <= count
    assert 0.0 < thinned.thinned_by <= 0.01
    assert 0.01 * thinned.thinned_by < apart(timed, thinned) <= thinned.thinned_by * (1.0 + 1e-9)
    assert find_excess(thinned.trajectory, limits(jerk)) is None
    assert timed.duration <= thinned.duration <= 1.011 * timed.duration
    q = thinned.trajectory.value(np.linspace(0.0, thinned.duration, 4001))
    assert checker.check_configs_collision_free(q).all()
    ends = [0, -1]
    np.testing.assert_array_equal(thinned.points.positions[ends], PATH[ends])
    np.testing.assert_array_equal(thinned.points.velocities[ends], np.zeros((2, 2)))
    assert (thinned.points.accelerations is None) == (jerk is None)
    assert thinned.least_clearance > 0.0
    assert (thinned.stops, thinned.rounded) == (timed.stops, timed.rounded)


def test_what_is_short_enough_is_left_as_it_is(checker):
    """And so is a failure."""
    timed = time_path(checker, PATH, limits(20.0))
    count = len(timed.points.positions)
    assert thin_trajectory(checker, timed, limits(20.0), count) is timed
    failed = time_path(checker, [[0.0, 0.0], [0.0, 5.0]], limits(20.0))
    assert thin_trajectory(checker, failed, limits(20.0), 2) is failed


def test_so_few_points_that_it_would_be_another_motion_are_a_failure(checker):
    """It says how many are left within the deviation; rests are kept, whatever it is."""
    timed = time_path(checker, PATH, limits(20.0))
    found = thin_trajectory(checker, timed, limits(20.0), 3, deviation=1e-4)
    assert found.failure is TimingFailure.TOO_MANY_POINTS
    count = len(timed.points.positions)
    assert f"{count} points can't be thinned to 3 within 0.0001" in found.reason
    rests = time_path(checker, PATH, limits(20.0), at_rest=[1, 2])
    fewer = int(0.7 * len(rests.points.positions))
    thinned = thin_trajectory(checker, rests, limits(20.0), fewer, deviation=0.05)
    assert thinned.is_success, thinned.reason
    still = thinned.points.positions[~thinned.points.velocities.any(axis=1)]
    np.testing.assert_allclose(still, PATH[[0, 1, 2, 4]], atol=1e-12)


def test_motions_that_begin_moving_still_do(checker):
    """Nothing is slowed down then."""
    timed = time_path(checker, PATH, limits(20.0), start_velocity=[0.5, 0.45])
    count = len(timed.points.positions) - 4
    thinned = thin_trajectory(checker, timed, limits(20.0), count, deviation=0.05)
    assert thinned.is_success, thinned.reason
    np.testing.assert_array_equal(thinned.points.velocities[0], [0.5, 0.45])
    assert thinned.duration == timed.duration
    assert find_excess(thinned.trajectory, limits(20.0)) is None


def test_numbers_that_make_no_sense_are_named(checker):
    """Of points and of the deviation; no time is a failure."""
    timed = time_path(checker, PATH, limits(20.0))
    for arguments, words in (
        ({"max_points": 1}, "max_points must be a whole number from 2 on, not 1"),
        ({"max_points": 30, "deviation": 0.0}, "deviation must be positive and finite, not 0"),
    ):
        with pytest.raises(TrajectoryError, match=words):
            thin_trajectory(checker, timed, limits(20.0), **arguments)
    found = thin_trajectory(checker, timed, limits(20.0), 60, deviation=0.1, timeout=0.0)
    assert found.is_success or found.failure is TimingFailure.TIMEOUT
