"""Kinematic trajectories: bounds at all times, known optima, clearance that is proven."""

import casadi as ca
import numpy as np
import pytest
from robot_scenes import BALL, diagram

from scene_graph_ros.planning import (
    Dynamics,
    KinematicTrajectoryOptimization,
    SceneGraphCollisionChecker,
    SolverOptions,
    SolveStatus,
    TrajectoryOptimizationError,
)
from scene_graph_ros.planning.trajectories import BsplineTrajectory
from scene_graph_ros.scene_files import load_urdf

POINT = """<robot name="p"><link name="base"/><link name="x"/><link name="ball">
  <collision><geometry><sphere radius="0.1"/></geometry></collision></link>
  <joint name="jx" type="prismatic"><parent link="base"/><child link="x"/>
  <axis xyz="1 0 0"/><limit lower="-9" upper="9"/></joint>
  <joint name="jy" type="prismatic"><parent link="x"/><child link="ball"/>
  <axis xyz="0 1 0"/><limit lower="-9" upper="9"/></joint></robot>"""


def seven(count=12):
    """Return a problem of seven joints from rest to rest, with all bounds."""
    made = KinematicTrajectoryOptimization(7, count, 4, 2.0)
    ones = np.ones(7)
    start, goal = np.random.default_rng(0).uniform(-1.5, 1.5, (2, 7))
    made.add_duration_cost()
    made.add_path_length_cost(0.1)
    made.add_duration_constraint(0.1, 20.0)
    made.add_position_bounds(-2.8 * ones, 2.8 * ones)
    made.add_velocity_bounds(-2.0 * ones, 2.0 * ones)
    made.add_acceleration_bounds(-5.0 * ones, 5.0 * ones)
    made.add_jerk_bounds(-50.0 * ones, 50.0 * ones)
    for q, s in ((start, 0.0), (goal, 1.0)):
        made.add_path_position_constraint(q, q, s)
        made.add_path_velocity_constraint(0.0 * ones, 0.0 * ones, s)
    line = np.linspace(start, goal, count)
    made.set_initial_guess(BsplineTrajectory.clamped_uniform(line, 3, 0.0, 2.0))
    return made, start, goal


def test_bounds_hold_at_all_times():
    """At 2000 times nothing is beyond, and what is fastest somewhere is at its bound."""
    made, start, goal = seven()
    result = made.solve()
    assert result.is_success, result.reason
    assert result.status is SolveStatus.SOLVED
    assert result.bounds_excess <= 1e-9
    curve = result.trajectory
    times = np.linspace(0.0, result.duration, 2000)
    for order, most in ((0, 2.8), (1, 2.0), (2, 5.0), (3, 50.0)):
        assert abs(curve.derivative(order).value(times)).max() <= most * (1.0 + 1e-9)
    # Control points, not the curve, are at the bound.
    assert abs(curve.derivative(2).control_points).max() == pytest.approx(5.0, rel=1e-6)
    np.testing.assert_allclose(curve.value(0.0), start, atol=1e-8)
    np.testing.assert_allclose(curve.value(result.duration), goal, atol=1e-8)
    assert result.value(made.duration())[0, 0] == pytest.approx(result.duration, rel=1e-5)
    warm = made.solve(warm_start=result)
    assert warm.is_success
    assert warm.program_result.iterations < result.program_result.iterations


def test_a_straight_line_at_full_speed():
    """Without further bounds, 3 m at 1.5 m/s take two seconds; the polygon is the line."""
    made = KinematicTrajectoryOptimization(2, 6, 3)
    made.add_duration_cost(1.0)
    made.add_path_length_cost(1.0, use_conic_constraint=True)
    made.add_velocity_bounds([-1.5, -1.0], [1.5, 1.0])
    made.add_path_position_constraint([0.0, 1.0], [0.0, 1.0], 0.0)
    made.add_path_position_constraint([3.0, 1.0], [3.0, 1.0], 1.0)
    result = made.solve()
    assert result.is_success, result.reason
    assert result.duration == pytest.approx(2.0, rel=1e-5)
    assert result.cost == pytest.approx(5.0, rel=1e-5)


def test_energy_spaces_control_points_evenly():
    """Of N points from 0 to 1 the least sum of squares is 1 / (N - 1)."""
    made = KinematicTrajectoryOptimization(1, 6)
    made.add_path_energy_cost(2.0)
    made.add_duration_constraint(3.0, None)
    made.add_path_position_constraint([0.0], [0.0], 0.0)
    made.add_path_position_constraint(lambda q: q == 1.0, 1.0)
    result = made.solve()
    assert result.cost == pytest.approx(0.4, rel=1e-7)
    np.testing.assert_allclose(result.trajectory.control_points[:, 0], np.arange(6) / 5, atol=1e-6)


def test_constraints_at_places():
    """Path derivatives are of s, velocities at normalized time of t; formulas may be curved."""
    made = KinematicTrajectoryOptimization(2, 8, 4, 2.0)
    made.add_path_energy_cost()
    made.add_duration_constraint(2.0, 2.0)
    made.add_path_position_constraint([1.0, 0.0], [1.0, 0.0], 0.0)
    made.add_path_position_constraint(lambda q: ca.sumsqr(q) == 4.0, 1.0)
    made.add_path_position_constraint(lambda q: q[1] >= 1.0, s=1.0, ub=0.0)
    made.add_path_velocity_constraint([0.3, 0.1], [0.3, 0.1], 0.0)
    made.add_path_acceleration_constraint([0.0, 0.2], [0.0, 0.2], 0.5)
    made.add_velocity_constraint_at_normalized_time(lambda q, v: v == ca.DM([0.25, -0.5]), 0.75)
    made.set_initial_guess(
        BsplineTrajectory.clamped_uniform([[1.0, 0.0], [1.5, 0.5], [1.0, 1.5]], 2, 0.0, 2.0)
    )
    result = made.solve()
    assert result.is_success, result.reason
    q = result.trajectory
    assert np.linalg.norm(q.value(2.0)) == pytest.approx(2.0, abs=1e-7)
    assert q.value(2.0)[1] >= 1.0 - 1e-7
    np.testing.assert_allclose(2.0 * q.derivative().value(0.0), [0.3, 0.1], atol=1e-7)
    np.testing.assert_allclose(4.0 * q.derivative(2).value(1.0), [0.0, 0.2], atol=1e-6)
    np.testing.assert_allclose(q.derivative().value(1.5), [0.25, -0.5], atol=1e-7)


def around(checker, least, samples, bend=0.05):
    """Return the shortest way for a ball along a line in which another one is."""
    made = KinematicTrajectoryOptimization(2, 10, 4, 2.0)
    made.add_path_length_cost()
    made.add_duration_cost(0.1)
    made.add_velocity_bounds([-1.0, -1.0], [1.0, 1.0])
    made.add_path_position_constraint([0.0, 0.0], [0.0, 0.0], 0.0)
    made.add_path_position_constraint([2.0, 0.0], [2.0, 0.0], 1.0)
    made.add_clearance_constraint(checker, least, num_samples=samples)
    points = np.linspace([0.0, 0.0], [2.0, 0.0], 10)
    points[:, 1] += bend * np.sin(np.linspace(0.0, np.pi, 10))
    made.set_initial_guess(BsplineTrajectory.clamped_uniform(points, 3, 0.0, 2.0))
    return made


def test_a_ball_goes_around_another_and_is_proven_free(tmp_path):
    """Radii are 0.1 and 0.2 m, and 2 cm are kept at the places that were asked."""
    checker = SceneGraphCollisionChecker(diagram(tmp_path, POINT, BALL))
    result = around(checker, 0.02, 11).solve()
    assert result.is_success, result.reason
    times = np.linspace(0.0, result.duration, 11)
    away = np.linalg.norm(result.trajectory.value(times) - [1.0, 0.0], axis=1) - 0.3
    assert away.min() == pytest.approx(0.02, abs=1e-3)
    assert result.least_clearance > 0.005
    # The shortest curve around a circle of 0.32 m that is 1 m away from both ends.
    shortest = 2.0 * (np.sqrt(1.0 - 0.32**2) + 0.32 * np.arcsin(0.32))
    points = result.trajectory.value(np.linspace(0.0, result.duration, 500))
    length = np.linalg.norm(np.diff(points, axis=0), axis=1)
    assert shortest - 1e-3 < length.sum() < 1.03 * shortest


def test_where_the_proof_fails_clearance_is_held_too(tmp_path):
    """With both ends as its only places the way leads through the ball, until that is seen."""
    checker = SceneGraphCollisionChecker(diagram(tmp_path, POINT, BALL))
    made = around(checker, 0.02, 2)
    once = made.solve(max_rounds=1)
    assert not once.is_success
    assert once.program_result.is_success
    assert "the curve collides at t = " in once.reason
    assert "around/world/ball" in once.reason
    assert once.least_clearance == 0.0
    made = around(checker, 0.02, 2, bend=0.3)
    result = made.solve()
    assert result.is_success, result.reason
    assert 1 < result.rounds <= 8


@pytest.mark.parametrize(
    ("act", "words"),
    [
        (lambda m: KinematicTrajectoryOptimization(2, 3), "num_control_points must be a whole"),
        (lambda m: KinematicTrajectoryOptimization(0, 6), "num_positions must be a whole number"),
        (lambda m: KinematicTrajectoryOptimization(2, 6, duration=0.0), "duration must be posi"),
        (lambda m: m.add_velocity_bounds([1.0, 1.0], [0.0, 2.0]), r"lb\[0\] = 1.0 must not be"),
        (lambda m: m.add_jerk_bounds([1.0], [2.0]), r"lb must have the shape \(2,\), not \(1,\)"),
        (lambda m: m.add_path_velocity_constraint([0, 0], [0, 0], 1.5), "s must be from 0 to 1"),
        (lambda m: m.add_duration_cost(-1.0), "weight must be finite and not negative"),
        (lambda m: m.add_duration_constraint(3.0, 2.0), r"lb\[0\] = 3.0 must not be above"),
        (lambda m: m.add_clearance_constraint(3), "checker must be a SceneGraphCollisionChecker"),
        (lambda m: m.set_initial_guess(3), "must be a BsplineTrajectory of 2 rows"),
        (lambda m: m.add_velocity_constraint_at_normalized_time(3, 0.5), "must be a function"),
    ],
)
def test_what_makes_no_sense_is_refused(act, words):
    """The message names the argument and its value."""
    with pytest.raises(TrajectoryOptimizationError, match=words):
        act(KinematicTrajectoryOptimization(2, 6))


def test_what_can_not_be_is_no_success():
    """One second is too short for 3 m at 1.5 m/s: the velocity or the duration is named."""
    made = KinematicTrajectoryOptimization(1, 6)
    made.add_duration_constraint(None, 1.0)
    made.add_velocity_bounds([-1.5], [1.5])
    made.add_path_position_constraint([0.0], [0.0], 0.0)
    made.add_path_position_constraint([3.0], [3.0], 1.0)
    result = made.solve(SolverOptions(restarts=0))
    assert not result.is_success
    assert result.status is not SolveStatus.SOLVED
    assert result.violations
    assert result.violations[0].label in result.reason


def test_bounds_that_can_not_hold_are_told_with_their_time():
    """At 0.75 of the time it has to be three times as fast as it may."""
    made = KinematicTrajectoryOptimization(1, 9, duration=2.0)
    made.add_duration_constraint(2.0, 2.0)
    made.add_velocity_bounds([-1.0], [1.0])
    made.add_path_velocity_constraint([6.0], [6.0], 0.75)  # of the path: 3 m/s in two seconds
    result = made.solve(SolverOptions(restarts=0))
    assert not result.is_success
    slow = [each for each in result.violations if each.label == "velocity"]
    assert slow
    velocity = result.trajectory.derivative()
    for each in slow:
        k = each.knots[0]
        assert each.time == pytest.approx(velocity.centers[k])
        # A corner of the bounds over two seconds, where control points of the path are.
        assert each.value / 2.0 + 1.0 * np.sign(each.value) == pytest.approx(
            velocity.control_points[k, 0], rel=1e-6
        )
    assert abs(slow[0].time - 1.5) < 0.5
    if result.violations[0].label == "velocity":
        assert f"at t = {slow[0].time:.6g} s" in result.reason


def test_a_guess_gives_its_basis():
    """Order, knots and control points of a trajectory are taken as they are."""
    curve = BsplineTrajectory.clamped_uniform(np.arange(14.0).reshape(7, 2), 4, 1.0, 3.0)
    made = KinematicTrajectoryOptimization(curve)
    assert (made.num_positions(), made.num_control_points()) == (2, 7)
    assert made.basis().order == 5
    assert made.basis().num_basis_functions == 7
    guess = made.prog().initial_guess
    assert guess.tolist() == [*np.arange(14.0), 2.0]
    assert made.get_mutable_prog() is made.prog()


@pytest.mark.parametrize("is_conic", [False, True])
def test_a_length_costs_what_the_curve_has(is_conic):
    """2 |(1, 1, 1)| from corner to corner, and 0 where nothing moves, without rounding."""
    for end in (1.0, 0.0):
        made = KinematicTrajectoryOptimization(3, 10, 5)
        for place, value in ((0.0, 0.0), (1.0, end)):
            made.add_path_position_constraint([value] * 3, [value] * 3, place)
        made.add_path_length_cost(2.0, is_conic)
        found = made.solve()
        pieces = np.diff(found.trajectory.control_points, axis=0)
        length = 2.0 * float(np.linalg.norm(pieces, axis=1).sum())
        assert found.cost == pytest.approx(length, abs=1e-14)
        assert found.cost == pytest.approx(2.0 * np.sqrt(3.0) * end, abs=1e-7)


PENDULUM = """<robot name="pendulum"><link name="base"/><link name="rod"><inertial>
  <origin xyz="0.5 0 0"/><mass value="2"/>
  <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
  <joint name="hinge" type="revolute"><parent link="base"/><child link="rod"/>
  <axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="1" velocity="9"/></joint></robot>"""


def test_efforts_are_bounded_where_that_is_asked():
    """A rod of 0.1 + 2 * 0.5^2 = 0.6 kg m^2 on an upright axis: torques bound accelerations."""
    dynamics = Dynamics.of_robot(load_urdf(PENDULUM))
    places = np.linspace(0.0, 1.0, 21)
    found = []
    for bounds in ({}, {"ub": [1.2]}, {"lb": [-0.6], "ub": [1.2]}):
        problem = KinematicTrajectoryOptimization(1, 8, 6)
        problem.add_path_position_constraint([0.0], [0.0], 0)
        problem.add_path_position_constraint([1.0], [1.0], 1)
        for s in (0, 1):
            problem.add_path_velocity_constraint([0.0], [0.0], s)
        problem.add_duration_constraint(0.5, 20.0)
        problem.add_duration_cost()
        assert len(problem.add_effort_bounds_at_normalized_times(dynamics, places, **bounds)) == 21
        result = problem.solve()
        assert result.is_success
        curve = result.trajectory
        at = curve.start_time + places * curve.duration
        found.append(0.6 * curve.derivative(2).value(at)[:, 0])
    assert abs(found[0]).max() > 1.3
    assert found[1].max() <= 1.2 + 1e-6 and found[1].min() < -0.7
    assert found[2].max() <= 1.2 + 1e-6 and found[2].min() >= -0.6 - 1e-6
    problem = KinematicTrajectoryOptimization(2, 8)
    for wrong in (dynamics, None, Dynamics(lambda x, u, t, p: [x[1], u[0]], 2, 1)):
        with pytest.raises(TrajectoryOptimizationError, match="must be Dynamics"):
            problem.add_effort_bounds_at_normalized_times(wrong, [0.5])
    problem = KinematicTrajectoryOptimization(1, 8)
    with pytest.raises(TrajectoryOptimizationError, match="s must be from 0 to 1"):
        problem.add_effort_bounds_at_normalized_times(dynamics, [0.5, 1.5])
    assert not [c for c in problem.prog().constraints if c.label.startswith("effort")]
