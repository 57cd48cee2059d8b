"""Limits of jerk, beside Ruckig; and trajectories of TOPP-RA and Ruckig, checked and proven."""

import logging

import numpy as np
import pytest
from robot_scenes import BALL, CART, CORNER, diagram, POST, SLIDE
import ruckig
import toppra
from toppra.algorithm import TOPPRA
from toppra.constraint import JointAccelerationConstraint, JointVelocityConstraint

from scene_graph_ros.planning import (
    load_robot_diagram,
    plan_path,
    prove_trajectory,
    SceneGraphCollisionChecker,
    time_path,
    TimingFailure,
)
from scene_graph_ros.planning.trajectories import (
    find_excess,
    MotionLimits,
    PiecewisePolynomial,
    TrajectoryError,
    TrajectoryPoints,
)

SHELF = (
    (1.07, 1.31, 0.81, -1.17, 2.78, 2.67, -1.38, 0.02),
    (1.37, 0.75, 0.17, -0.51, 2.53, 3.09, -0.12, 0.02),
)
"""Positions (rad, m) of a Panda with its hand below and above a board."""


def cart(folder, x, y, **limits):
    """Return the checker of the ball on rails, and its limits."""
    robots = diagram(folder, CART, POST.format(x=x, y=y))
    own = MotionLimits.of_tree(robots.tree, accelerations=2.0, **limits)
    return SceneGraphCollisionChecker(robots), own


def by_ruckig(ways, velocity, acceleration, jerk):
    """Return Ruckig's trajectory from 0 to ``ways``, all joints in phase, rest to rest."""
    count = len(ways)
    asked = ruckig.InputParameter(count)
    asked.current_position, asked.target_position = [0.0] * count, list(ways)
    asked.max_velocity, asked.max_acceleration = [velocity] * count, [acceleration] * count
    asked.max_jerk = [jerk] * count
    asked.synchronization = ruckig.Synchronization.Phase
    found = ruckig.Trajectory(count)
    ruckig.Ruckig(count).calculate(asked, found)
    return found


def by_toppra(path, limits, grid):
    """Return TOPP-RA's trajectory along the cubic spline through a path."""
    logging.disable(logging.CRITICAL)
    try:
        instance = TOPPRA(
            [
                JointVelocityConstraint(np.stack([-limits.velocities, limits.velocities], 1)),
                JointAccelerationConstraint(
                    np.stack([-limits.accelerations, limits.accelerations], 1)
                ),
            ],
            toppra.SplineInterpolator(np.linspace(0.0, 1.0, len(path)), path),
            gridpoints=np.linspace(0.0, 1.0, grid + 1),
            parametrizer="ParametrizeConstAccel",
        )
        return instance.compute_trajectory(0.0, 0.0)
    finally:
        logging.disable(logging.NOTSET)


def points_of(found, count, slower=1.0):
    """Return points of TOPP-RA's trajectory, ``slower`` times as slow, at rest at both ends."""
    nanoseconds = np.rint(np.linspace(0.0, found.duration, count) * 1e9 * slower).astype(np.int64)
    times = np.minimum(nanoseconds * 1e-9 / slower, found.duration)
    velocities = found(times, 1) / slower
    velocities[[0, -1]] = 0.0
    return TrajectoryPoints(nanoseconds, found(times), velocities)


# Limits of jerk.


@pytest.mark.parametrize("way", [6.0, 1.0, 0.3, 1e-2, 1e-4])
@pytest.mark.parametrize("jerk", [20.0, 500.0])
def test_a_straight_way_is_about_as_fast_as_the_fastest(tmp_path, way, jerk):
    """Ruckig's is the shortest; ours is as long where it has time for a constant speed.

    That is where way / v - v / a is at least the time a / j in which accelerations rise.
    """
    robots = diagram(tmp_path, SLIDE)
    checker, v, a = SceneGraphCollisionChecker(robots), 1.5, 4.0
    limits = MotionLimits([v], [a], robots.tree.position_names, [jerk])
    timed = time_path(checker, [[-1.0], [way - 1.0]], limits)
    assert timed.is_success, timed.reason
    least = by_ruckig([way], v, a, jerk).duration
    assert least * (1.0 - 1e-9) <= timed.duration <= 1.25 * least
    if way / v - v / a >= a / jerk:
        assert timed.duration == pytest.approx(least, rel=1e-5)


def test_a_panda_keeps_limits_of_jerk_at_all_times():
    """Differences of accelerations at 40 000 times are within them; corners are still rounded."""
    robots = load_robot_diagram("config/scenes/panda_cell.yaml")
    checker = SceneGraphCollisionChecker(robots, env_collision_padding=0.005)
    path = plan_path(checker, *SHELF, group="arm").configurations
    moving = robots.tree.group_positions("arm")
    jerks = {name: 40.0 + 10.0 * k for k, name in enumerate(robots.tree.position_names)}
    kept = {"accelerations": 5.0, "positions": moving}
    limits = MotionLimits.of_tree(robots.tree, jerks=jerks, **kept)
    timed = time_path(checker, path, limits)
    assert timed.is_success, timed.reason
    assert timed.rounded > 0
    t = np.linspace(0.0, timed.duration, 40_001)
    a = timed.trajectory.derivative(2).value(t)[:, moving]
    np.testing.assert_array_equal(a[[0, -1]], np.zeros((2, len(moving))))
    found = np.abs(np.diff(a, axis=0)) / np.diff(t)[:, np.newaxis] / limits.jerks
    # Rounding has accelerations jump by some 1e-8, here in 1e-4 s.
    assert 0.5 < found.max() < 1.0 + 1e-5
    # Others that controllers would run: cubics, whose accelerations jump, and less jerk.
    free = MotionLimits.of_tree(robots.tree, **kept)
    faster = time_path(checker, path, free)
    assert faster.duration < timed.duration
    again = prove_trajectory(checker, faster.points, limits)
    assert again.failure is TimingFailure.LIMIT
    assert again.reason.startswith("jerk of 'panda_joint")
    assert "is inf at" in again.reason
    assert prove_trajectory(checker, timed.points, limits).is_success
    half = MotionLimits(free.velocities, free.accelerations, free.names, 0.5 * limits.jerks)
    assert prove_trajectory(checker, timed.points, half).failure is TimingFailure.LIMIT


def test_a_path_of_one_configuration_stays_there(tmp_path):
    """For as short as can be said, with accelerations that are 0."""
    robots = diagram(tmp_path, SLIDE)
    limits = MotionLimits([1.0], [1.0], robots.tree.position_names, [1.0])
    timed = time_path(SceneGraphCollisionChecker(robots), [[0.25]], limits)
    assert timed.is_success
    assert (timed.points.positions == 0.25).all()
    assert (timed.points.accelerations == 0.0).all()


def test_limits_of_jerk_that_make_no_sense_are_refused(tmp_path):
    """By the name of the position, and by their number."""
    tree = diagram(tmp_path, SLIDE).tree
    (name,) = tree.position_names
    with pytest.raises(TrajectoryError, match=f"the limit of jerks of '{name}' must be from"):
        MotionLimits.of_tree(tree, accelerations=1.0, velocities={name: 1.0}, jerks=0.0)
    with pytest.raises(TrajectoryError, match="jerks: there is no position 'rial'"):
        MotionLimits.of_tree(tree, accelerations=1.0, jerks={"rial": 1.0})
    with pytest.raises(TrajectoryError, match="1 velocities and 2 jerks"):
        MotionLimits([1.0], [1.0], (), [1.0, 1.0])


def test_a_jump_of_an_acceleration_is_an_infinite_jerk():
    """Cubics through rests: the acceleration jumps where they meet, by twice 6 / 1 s^2."""
    curve = PiecewisePolynomial.cubic_hermite(
        [0.0, 1.0, 2.0], [[0.0], [1.0], [0.0]], [[0.0], [0.0], [0.0]]
    )
    # Each cubic's jerk is 12; the first ends with -6, the second begins with -6: no jump.
    assert find_excess(curve, MotionLimits([9.0], [9.0], (), [12.0 + 1e-9])) is None
    excess = find_excess(curve, MotionLimits([9.0], [9.0], (), [11.0]))
    assert (excess.kind, excess.value) == ("jerk", pytest.approx(12.0))
    stairs = PiecewisePolynomial.cubic_hermite(
        [0.0, 1.0, 2.0], [[0.0], [1.0], [2.0]], [[0.0], [0.0], [0.0]]
    )
    excess = find_excess(stairs, MotionLimits([9.0], [9.0], (), [1e9]))
    assert (excess.kind, excess.value, excess.time) == ("jerk", np.inf, 1.0)


# Trajectories that others made.


def test_what_toppra_makes_of_a_free_path_may_collide(tmp_path):
    """The spline through three corners swings out of the path by 5 cm or more, into a ball."""
    inside, limits = cart(tmp_path, 0.7, 0.3)
    spline = by_toppra(CORNER, limits, 200)
    points = points_of(spline, 400, slower=1.1)
    assert prove_trajectory(inside, points, limits).is_success
    # Between the first two corners it is beside the straight way by this much, at this place.
    way = spline(np.linspace(0.0, spline.duration, 2001))
    lowest = way[np.argmin(way[:, 1])]
    assert lowest[1] < -0.05
    hit, _ = cart(tmp_path, lowest[0], lowest[1] - 0.19)
    path = time_path(hit, CORNER, limits)
    assert path.is_success, path.reason
    found = prove_trajectory(hit, points, limits)
    assert found.failure is TimingFailure.NOT_FREE
    assert "post" in found.reason
    assert not hit.check_configs_collision_free(
        points.trajectory().value(np.linspace(0.0, points.duration, 4001))
    ).all()


def test_what_toppra_exceeds_is_told(tmp_path):
    """Between its few grid points it is beyond limits, which a slower one is not."""
    checker, limits = cart(tmp_path, -0.7, 0.7)
    spline = by_toppra(CORNER, limits, 10)
    found = prove_trajectory(checker, points_of(spline, 300), limits)
    assert found.failure is TimingFailure.LIMIT
    assert "beyond its limit" in found.reason
    assert prove_trajectory(checker, points_of(spline, 300, slower=1.5), limits).is_success


def test_what_ruckig_makes_is_proven(tmp_path):
    """From point to point it is straight, and free; quintics through its points add a little."""
    checker, limits = cart(tmp_path, 0.5, 0.5, jerks=10.0)
    found = by_ruckig([1.0, 0.2], 1.0, 2.0, 10.0)
    slower = 1.001
    nanoseconds = np.rint(np.linspace(0.0, found.duration, 2000) * 1e9 * slower).astype(np.int64)
    rows = [found.at_time(min(t * 1e-9 / slower, found.duration)) for t in nanoseconds]
    q, v, a = (np.array([row[k] for row in rows]) for k in range(3))
    loose = MotionLimits(limits.velocities, limits.accelerations, limits.names, 1.1 * limits.jerks)
    points = TrajectoryPoints(nanoseconds, q, v / slower, a / slower**2)
    proven = prove_trajectory(checker, points, loose)
    assert proven.is_success, proven.reason
    # The straight way to (1, 0.2) keeps |0.5 * 0.2 - 0.5| / |(1, 0.2)| from (0.5, 0.5).
    assert proven.least_clearance == pytest.approx(0.4 / np.hypot(1.0, 0.2) - 0.2, abs=0.05)
    assert proven.least_clearance <= 0.4 / np.hypot(1.0, 0.2) - 0.2
    there, _ = cart(tmp_path, 0.5, 0.2)
    assert prove_trajectory(there, points, loose).failure is TimingFailure.NOT_FREE


def test_what_is_proven_again_is_as_before(tmp_path):
    """The answer about a path's own points is that of the path; without time there is none."""
    checker, limits = cart(tmp_path, 0.7, 0.3)
    timed = time_path(checker, CORNER, limits)
    again = prove_trajectory(checker, timed.points, limits)
    assert again.is_success
    assert again.least_clearance == timed.least_clearance
    np.testing.assert_array_equal(again.trajectory.control_points, timed.trajectory.control_points)
    late = prove_trajectory(checker, timed.points, limits, timeout=0.0)
    assert late.failure is TimingFailure.TIMEOUT


def test_points_that_make_no_sense_are_refused(tmp_path):
    """Lines' velocities jump; what has no limits must stay; positions beyond limits are told."""
    checker = SceneGraphCollisionChecker(diagram(tmp_path, CART, BALL))
    tree = checker.model.tree
    limits = MotionLimits.of_tree(tree, accelerations=2.0, positions=[0])
    times, q = [0, 2 * 10**9], np.array([[-1.0, 0.0], [0.0, 0.0]])
    rest = np.zeros((2, 2))
    for points in (TrajectoryPoints(times, q), TrajectoryPoints(times[:1], q[:1], rest[:1])):
        with pytest.raises(TrajectoryError, match="two or more, with velocities"):
            prove_trajectory(checker, points, limits)
    with pytest.raises(TrajectoryError, match="velocities of position 'y' must be 0"):
        prove_trajectory(checker, TrajectoryPoints(times, q, np.array([[0.0, 0.1]] * 2)), limits)
    moved = np.array([[-1.0, 0.0], [0.0, 0.1]])
    with pytest.raises(TrajectoryError, match="moves position 'y', which has no limits"):
        prove_trajectory(checker, TrajectoryPoints(times, moved, rest), limits)
    with pytest.raises(TrajectoryError, match="timeout must be seconds"):
        prove_trajectory(checker, TrajectoryPoints(times, q, rest), limits, timeout=-1.0)
    assert prove_trajectory(checker, TrajectoryPoints(times, q, rest), limits).is_success
    beyond = TrajectoryPoints(times, q - [0.5, 0.0], rest)
    found = prove_trajectory(checker, beyond, limits)
    assert found.failure is TimingFailure.LIMIT
    assert found.reason.startswith("position of 'x' is -1.5 at 0 s")
