"""Trajectories that are replaced while a ball on a rail executes them."""

from __future__ import annotations

import copy
import re

from builtin_interfaces.msg import Duration
import numpy as np
from plan_goals import at, Planner, post_publisher, rail_publisher, Sent
import pytest
from sliding_robots import rail_scene
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from msg_adapters.stamps import duration_from_msg, duration_to_msg, stamp_from_msg, stamp_to_msg
from msg_adapters.trajectories import joint_trajectory_from_msg
from scene_graph_msgs.action import PlanPath
from scene_graph_msgs.msg import MotionLimits, Status

LIMITS = MotionLimits(names=["rail"], max_velocities=[1.0], max_accelerations=[2.0])
TIMED = {"with_trajectory": True, "limits": LIMITS}
AFTER = Duration(sec=1)


@pytest.fixture(scope="module")
def node(start_node, tmp_path_factory):
    """A node with the ball, at -1, and the post."""
    scene = rail_scene(tmp_path_factory.mktemp("rails"))
    return start_node({"scene": scene, "plan_from_unreported": True})


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


@pytest.fixture(scope="module")
def first(action):
    """Return a trajectory from -1 to 0.5, which takes 2 s: 0.5 s to 1 m/s, 0.5 s to rest."""
    results = [
        Sent(action, goals=at(0.5), planner=planner, **TIMED).end()[0]
        for planner in ("fastest", "rrt_connect")  # whose kernels no replacement then waits for
    ]
    assert [result.failure for result in results] == [0, 0], results
    return results[-1].trajectory


def begun(client, trajectory, seconds):
    """Return it as one that began so long ago, and when it did (ns)."""
    result = copy.deepcopy(trajectory)
    begin = stamp_from_msg(client.now()) - int(seconds * 1e9)
    result.header.stamp = stamp_to_msg(begin)
    return result, begin


@pytest.mark.parametrize("planner", ["rrt_connect", "fastest"])
@pytest.mark.parametrize("goal", [0.55, -0.9])
def test_it_goes_on_from_where_it_is(action, client, first, planner, goal):
    """On along the rail, or back: the old one to the switch, then its velocity, within limits."""
    old, begin = begun(client, first, 0.2)
    result, _ = Sent(
        action, goals=at(goal), planner=planner, executing=old, replace_after=AFTER, **TIMED
    ).end()
    assert (result.status.code, result.failure) == (Status.OK, 0), (result.status, result.reason)
    new = result.trajectory
    names, points = joint_trajectory_from_msg(new)
    assert names == ("rail",) and new.points[0].time_from_start == Duration()
    shift = (stamp_from_msg(new.header.stamp) - begin) * 1e-9
    one, two = joint_trajectory_from_msg(old)[1].trajectory(), points.trajectory()
    switch = points.nanoseconds[result.replaces_from] * 1e-9
    assert 0.2 < shift + switch <= 2.0 and result.replaces_from >= 1
    for t in np.linspace(0.0, switch, 50):
        np.testing.assert_allclose(two.value(t), one.value(t + shift), atol=1e-9)
    np.testing.assert_allclose(
        two.derivative(1).value(switch), one.derivative(1).value(switch + shift), atol=1e-9
    )
    assert points.positions[-1, 0] == pytest.approx(goal, abs=1e-9)
    assert points.velocities[-1, 0] == pytest.approx(0.0, abs=1e-9)
    times = np.linspace(0.0, two.end_time, 1000)
    assert np.abs(two.derivative(1).value(times)).max() <= 1.0 + 1e-9
    assert np.abs(two.derivative(2).value(times)).max() <= 2.0 + 1e-6


def test_a_switch_after_its_end_is_at_its_end(action, client, first):
    """There it rests, and a plan from rest goes on."""
    old, begin = begun(client, first, 0.2)
    result, _ = Sent(
        action, goals=at(0.1), executing=old, replace_after=Duration(sec=20), **TIMED
    ).end()
    assert result.failure == 0, result.reason
    _, points = joint_trajectory_from_msg(result.trajectory)
    switch = stamp_from_msg(result.trajectory.header.stamp) + int(
        points.nanoseconds[result.replaces_from]
    )
    assert switch == begin + duration_from_msg(old.points[-1].time_from_start)
    assert points.positions[result.replaces_from, 0] == pytest.approx(0.5, abs=1e-9)


@pytest.mark.parametrize("planner", ["rrt_connect", "fastest"])
def test_what_came_in_the_way_of_what_is_executed_is_told(action, client, first, planner):
    """The post stands at -0.3 now, which the ball passes before the switch; then it is away."""
    put = post_publisher(client)

    def replaced():
        old, _ = begun(client, first, 0.2)
        how = {"planner": planner, "executing": old, "replace_after": AFTER, **TIMED}
        return Sent(action, goals=at(-0.9), **how).end()[0]

    def put_until(x, failure):
        for _ in range(100):
            put(x)
            result = replaced()
            if result.failure == failure:
                return result
        raise AssertionError(f"{result.failure}: {result.reason}")

    result = put_until(-0.3, PlanPath.Result.NOT_FREE)
    assert result.status.code == Status.OK and not result.trajectory.points
    assert "executing, up to where it is replaced, is not free now" in result.reason
    assert "post" in result.reason and "not proven apart" in result.reason
    assert put_until(1.0, PlanPath.Result.NONE).trajectory.points


def wrong(client, first, what):
    """Return fields of a goal that is wrong in one way."""
    old, _ = begun(client, first, 0.2)
    fields = {"goals": at(0.1), "executing": old, "replace_after": AFTER, **TIMED}
    changes = {
        "no trajectory": lambda: fields.update(with_trajectory=False),
        "regions": lambda: fields.update(planner="regions"),
        "rise time": lambda: fields.update(rise_time=Duration(nanosec=10**8)),
        "overlap": lambda: fields.update(start_overlap=0.01),
        "no time": lambda: fields.update(replace_after=Duration()),
        "negative": lambda: fields.update(replace_after=Duration(sec=-1)),
        "start": lambda: fields.update(start=at(-0.5)),
        "no stamp": lambda: setattr(old.header, "stamp", stamp_to_msg(0)),
        "ended": lambda: setattr(old.header, "stamp", begun(client, first, 9.0)[0].header.stamp),
        "not begun": lambda: setattr(
            old.header, "stamp", begun(client, first, -9.0)[0].header.stamp
        ),
        "unknown": lambda: setattr(old, "joint_names", ["rope"]),
        "two joints": lambda: setattr(old, "joint_names", ["rail", "rail"]),
        "no points": lambda: setattr(old, "points", []),
        "one point": lambda: setattr(old, "points", old.points[:1]),
        "not finite": lambda: setattr(old.points[1], "positions", [float("nan")]),
        "no velocity": lambda: [setattr(point, "velocities", []) for point in old.points],
        "in motion": lambda: setattr(old.points[-1], "velocities", [0.5]),
        "times": lambda: setattr(old.points[-1], "time_from_start", Duration()),
        "jerks": lambda: fields.update(
            limits=MotionLimits(max_acceleration=2.0, max_jerk=10.0, max_velocities=[])
        ),
        "too fast": lambda: fields.update(
            limits=MotionLimits(names=["rail"], max_velocities=[0.1], max_accelerations=[2.0])
        ),
    }
    changes[what]()
    return fields


@pytest.mark.parametrize(
    ("what", "words"),
    [
        ("no trajectory", "with_trajectory must be true where executing is replaced"),
        ("regions", "planner must be 'fastest' or 'rrt_connect'"),
        ("rise time", "rise_time must be 0"),
        ("overlap", "start_overlap must be 0"),
        ("no time", "replace_after must be greater than 0 s, not 0"),
        ("negative", "replace_after must be greater than 0 s, not -1"),
        ("start", "start has 'rail', and so has executing"),
        ("no stamp", "executing.header.stamp is zero"),
        ("ended", "executing ended .* s ago"),
        ("not begun", "executing begins in .* s only"),
        ("unknown", "executing.joint_names: no robot has a position 'rope'"),
        ("two joints", "points.0..positions has 1 numbers for 2 joints"),
        ("no points", "executing has joints, but no points"),
        ("one point", "executing.points must be two or more, with velocities"),
        ("not finite", "must be finite"),
        ("no velocity", "executing.points must be two or more, with velocities"),
        ("in motion", "executing.points end in motion"),
        ("times", "times must grow"),
        ("jerks", "executing.points have no accelerations, and limits have jerks"),
        ("too fast", "start_velocity of 'rail|start_velocity of 'slide/rail"),
    ],
)
def test_what_can_t_be_replaced_is_refused(action, client, first, what, words):
    """Naming the field and its value; the node goes on."""
    result, _ = Sent(action, **wrong(client, first, what)).end()
    assert result.status.code != Status.OK, (result.failure, result.reason)
    assert re.search(words, result.status.message), result.status.message


def test_a_robot_that_is_elsewhere_executes_something_else(action, client, first, joints):
    """It was reported 1.2 m from where the trajectory has it."""
    joints(0.2)
    result, _ = Sent(action, goals=at(-0.2), **TIMED).end()
    while abs(result.path.positions[0] - 0.2) > 1e-9:
        joints(0.2)
        result, _ = Sent(action, goals=at(-0.2), **TIMED).end()
    old, _ = begun(client, first, 0.2)
    result, _ = Sent(action, goals=at(0.1), executing=old, replace_after=AFTER, **TIMED).end()
    assert result.status.code == Status.STALE
    assert "'slide/rail'" in result.status.message and "0.1 is the most" in result.status.message


def test_what_is_found_too_late_is_told(action, client, first):
    """A microsecond is too short for any plan, also at the end of a trajectory that ends then."""
    stamp = stamp_from_msg(client.now())
    old = JointTrajectory(joint_names=["rail"])
    for seconds in (0.0, 0.3):
        old.points.append(
            JointTrajectoryPoint(
                positions=[0.2],
                velocities=[0.0],
                time_from_start=duration_to_msg(int(seconds * 1e9)),
            )
        )
    old.header.stamp = stamp_to_msg(stamp)
    after = Duration(nanosec=1000)
    result, _ = Sent(action, goals=at(0.1), executing=old, replace_after=after, **TIMED).end()
    told = result.status.message or result.reason
    assert result.failure == PlanPath.Result.TIMEOUT or "ended" in told, told
    assert not result.trajectory.points
