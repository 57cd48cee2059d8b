"""Trajectories that goals of the planning action ask for: their times, limits and proofs."""

from __future__ import annotations

import itertools
import re

from action_msgs.msg import GoalStatus
from builtin_interfaces.msg import Duration
from plan_goals import at, Planner, post_publisher, rail_publisher, Sent
import pytest
from rcl_interfaces.msg import Parameter as RosParameter
from rcl_interfaces.msg import ParameterType, ParameterValue
from rcl_interfaces.srv import SetParametersAtomically
from sliding_robots import rail_scene

from scene_graph_msgs.action import PlanPath
from scene_graph_msgs.msg import MotionLimits, PlanHolds, Status


@pytest.fixture(scope="module")
def node(start_node, tmp_path_factory):
    """A node with the ball and the post; the rail is at -1."""
    scene = rail_scene(tmp_path_factory.mktemp("rails"))
    return start_node({"scene": scene, "max_waiting_plans": 1, "plan_from_unreported": True})


@pytest.fixture(scope="module")
def joints(client, node):
    """Publish where the ball is."""
    return rail_publisher(client)


@pytest.fixture(scope="module")
def action(client, node):
    """A client of the action."""
    planner = Planner(client)
    yield planner
    planner.destroy()


TIMED = {
    "with_trajectory": True,
    "limits": MotionLimits(names=["rail"], max_velocities=[1.0], max_accelerations=[2.0]),
}


def seconds_of(point):
    """Return when a trajectory passes a point."""
    return point.time_from_start.sec + 1e-9 * point.time_from_start.nanosec


def test_a_trajectory_takes_as_long_as_it_must(action, joints):
    """From -1 to 0.5 with 1 m/s and 2 m/s^2: 1.5 / 1 + 1 / 2 s, from rest to rest."""
    sent = Sent(action, goals=at(0.5), **TIMED)
    result, status = sent.end()
    assert (result.status.code, result.failure) == (Status.OK, 0), (result.status, result.reason)
    assert status == GoalStatus.STATUS_SUCCEEDED
    trajectory = result.trajectory
    assert trajectory.joint_names == ["rail"]
    first, *_, last = trajectory.points
    assert (list(first.positions), list(last.positions)) == ([-1.0], [0.5])
    assert (list(first.velocities), list(last.velocities)) == ([0.0], [0.0])
    assert seconds_of(first) == 0.0
    assert seconds_of(last) == pytest.approx(2.0, rel=1e-6)
    assert max(p.velocities[0] for p in trajectory.points) == pytest.approx(1.0, rel=1e-6)
    assert not any(len(p.accelerations) for p in trajectory.points)
    assert 0.0 < result.trajectory_clearance <= 0.2
    assert result.stops == 0
    assert PlanPath.Feedback.TIMING in {f.state for f in sent.feedback}


def test_a_trajectory_without_jumps_of_acceleration(action, joints):
    """It takes the rise time longer, and its points have accelerations."""
    rise = Duration(nanosec=100_000_000)
    result, _ = Sent(action, goals=at(0.5), rise_time=rise, **TIMED).end()
    points = result.trajectory.points
    assert seconds_of(points[-1]) == pytest.approx(2.1, rel=1e-6)
    accelerations = [p.accelerations[0] for p in points]
    assert accelerations[0] == accelerations[-1] == 0.0
    assert max(map(abs, accelerations)) == pytest.approx(2.0, rel=1e-6)


def test_a_trajectory_within_a_limit_of_jerk(action, joints):
    """It takes 2 m/s^2 over 20 m/s^3 longer, and the answer's points show the jerk."""
    limits = MotionLimits(
        names=["rail"], max_velocities=[1.0], max_accelerations=[2.0], max_jerks=[20.0]
    )
    result, _ = Sent(action, goals=at(0.5), **{**TIMED, "limits": limits}).end()
    points = result.trajectory.points
    assert seconds_of(points[-1]) == pytest.approx(2.1, rel=1e-6)
    rates = [
        abs(after.accelerations[0] - before.accelerations[0])
        / (seconds_of(after) - seconds_of(before))
        for before, after in itertools.pairwise(points)
    ]
    assert max(rates) == pytest.approx(20.0, rel=1e-3)


def test_the_fastest_motion_to_a_goal(action, joints):
    """On a rail it takes what it must: 1.5 / 1 + 1 / 2 + 2 / 20 s, and the path is there, too."""
    limits = MotionLimits(
        names=["rail"], max_velocities=[1.0], max_accelerations=[2.0], max_jerks=[20.0]
    )
    timed = {**TIMED, "limits": limits, "planner": "fastest"}
    sent = Sent(action, goals=at(0.5), **timed)
    result, status = sent.end()
    assert (status, result.failure) == (GoalStatus.STATUS_SUCCEEDED, 0), result.reason
    points = result.trajectory.points
    assert seconds_of(points[-1]) == pytest.approx(2.1, rel=1e-6)
    assert list(result.path.positions) == [-1.0, 0.5]
    assert result.trajectory_clearance > 0.0


def test_goals_of_the_fastest_motion_that_make_no_sense(action, joints):
    """Without a trajectory, with a rise time; a goal that collides says so as a path's does."""
    rise = Duration(nanosec=100_000_000)
    for asked, words in (
        ({}, "with_trajectory must be true for the planner 'fastest'"),
        ({**TIMED, "rise_time": rise}, "rise_time must be 0 with the planner 'fastest'"),
    ):
        result, status = Sent(action, goals=at(0.5), planner="fastest", **asked).end()
        assert status == GoalStatus.STATUS_ABORTED
        assert result.status.code == Status.INVALID_ARGUMENT
        assert words in result.status.message
    beyond, _ = Sent(action, goals=at(50.0), planner="fastest", **TIMED).end()
    assert beyond.failure == PlanPath.Result.GOAL_BEYOND_LIMITS


def test_a_trajectory_by_another_retimer(action, client, joints):
    """Ruckig's way of 1.5 m with 1 m/s, 2 m/s^2 and 20 m/s^3 takes as long; few points say it."""
    limits = MotionLimits(
        names=["rail"], max_velocities=[1.0], max_accelerations=[2.0], max_jerks=[20.0]
    )

    def choose(name):
        value = ParameterValue(type=ParameterType.PARAMETER_STRING, string_value=name)
        parameter = RosParameter(name="retimer", value=value)
        request = SetParametersAtomically.Request(parameters=[parameter])
        service = "/scene_graph/set_parameters_atomically"
        return client.call_any(SetParametersAtomically, service, request).result

    try:
        assert not choose("topra").successful
        for name in ("ruckig", "toppra"):
            assert choose(name).successful
            result, _ = Sent(action, goals=at(0.5), **{**TIMED, "limits": limits}).end()
            assert result.failure == 0, result.reason
            points = result.trajectory.points
            # 1.5 / 1 + 1 / 2 + 2 / 20 s; TOPP-RA has one speedup on each of its stretches.
            slack = 1e-6 if name == "ruckig" else 0.01
            assert seconds_of(points[-1]) == pytest.approx(2.1, rel=slack)
            # Seven phases, of which one is as long as it has to be.
            assert (len(points) == 8) is (name == "ruckig")
            assert result.trajectory_clearance > 0.0
    finally:
        assert choose("time_optimal").successful


def test_a_trajectory_has_no_more_points_than_there_may_be(action, client, joints):
    """TOPP-RA's fifty are thinned to ten: few say where a motion with two speedups is."""

    def choose(**values):
        kinds = {int: "integer", float: "double", str: "string"}
        parameters = []
        for name, value in values.items():
            kind = kinds[type(value)]
            number = getattr(ParameterType, f"PARAMETER_{kind.upper()}")
            own = ParameterValue(type=number, **{f"{kind}_value": value})
            parameters.append(RosParameter(name=name, value=own))
        request = SetParametersAtomically.Request(parameters=parameters)
        service = "/scene_graph/set_parameters_atomically"
        assert client.call_any(SetParametersAtomically, service, request).result.successful

    try:
        choose(retimer="toppra")
        whole, _ = Sent(action, goals=at(0.5), **TIMED).end()
        choose(max_trajectory_points=10)
        result, _ = Sent(action, goals=at(0.5), **TIMED).end()
        assert result.failure == 0, result.reason
        points = result.trajectory.points
        assert len(whole.trajectory.points) > 10 >= len(points)
        slowest = seconds_of(whole.trajectory.points[-1]) * 1.011
        assert 2.0 - 1e-6 <= seconds_of(points[-1]) <= slowest
        assert result.trajectory_clearance > 0.0
        choose(max_trajectory_points=2, thinning_deviation=1e-4)
        result, status = Sent(action, goals=at(0.5), **TIMED).end()
        assert (result.failure, status) == (PlanPath.Result.NOT_TIMED, GoalStatus.STATUS_ABORTED)
        assert "can't be thinned to 2 within 0.0001" in result.reason
    finally:
        choose(retimer="time_optimal", max_trajectory_points=1000, thinning_deviation=1e-3)


def test_a_path_alone_has_no_trajectory(action, joints):
    """Nobody who asks for none pays for one."""
    result, _ = Sent(action, goals=at(0.5)).end()
    assert not len(result.trajectory.points)
    assert result.trajectory_clearance == 0.0


@pytest.fixture(scope="module")
def post(client, node):
    """Put the post somewhere on the rail."""
    return post_publisher(client)


def test_a_trajectory_is_proven_again_as_it_is_executed(action, client, joints, post):
    """The post comes to x = 0: the ball, from -1 on with 1 m/s, meets it at -0.3, after 0.95 s."""
    result, _ = Sent(action, goals=at(0.5), **TIMED).end()
    assert result.failure == 0, result.reason
    holds = client.listen(PlanHolds, "plan_holds")
    holds.wait_for_newest(lambda m: m.holds, "a trajectory that holds")
    post(0.0)
    stopped = holds.wait_for_newest(lambda m: not m.holds, "one that does not")
    # It has gone 0.7 m, of which 0.25 m in the first half second; the proof may say it later.
    assert 0.95 <= stopped.seconds < 1.5
    assert re.search(r"post.* at [\d.]+ s$", stopped.reason)
    assert -0.3 <= stopped.configuration.positions[0] < 0.3
    post(1.0)
    holds.wait_for_newest(lambda m: m.holds, "the trajectory as it was")
    client.forget(holds)
