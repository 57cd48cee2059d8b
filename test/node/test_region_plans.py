"""Trajectories through regions, as clients of the node ask for them.

A ball of 0.1 m on a rail, a post of 0.2 m at 1 m in its way: they touch where the rail is at 0.7.
"""

from __future__ import annotations

import re

from action_msgs.msg import GoalStatus
from builtin_interfaces.msg import Duration
import numpy as np
from plan_goals import at, Planner, Sent
import pytest
from sliding_robots import rail_scene
from visualization_msgs.msg import Marker, MarkerArray

from scene_graph_msgs.action import PlanPath
from scene_graph_msgs.msg import (
    MotionLimits,
    PoseGoal,
    RegionTrajectoryOptions,
    RobotConfigurations,
    Status,
)

F = PlanPath.Result


@pytest.fixture(scope="module")
def action(client, start_node, tmp_path_factory):
    """A client of a node with the ball and the post; the rail is at -1."""
    folders = str(tmp_path_factory.getbasetemp())
    scene = rail_scene(tmp_path_factory.mktemp("rails"))
    start_node({"scene": scene, "resource_folders": folders, "plan_from_unreported": True})
    planner = Planner(client)
    yield planner
    planner.destroy()


def intervals(**ends):
    """Return regions of the rail as YAML, by name and ends."""
    rows = (f"{name}: {{A: [[1], [-1]], b: [{b}, {-a}]}}" for name, (a, b) in ends.items())
    return "\n".join(rows)


TWO = intervals(far=(-2.0, 0.0), near=(-0.5, 0.65))
BEYOND = intervals(far=(-2.0, 0.0), near=(-0.5, 3.0))
GAP = intervals(far=(-2.0, 0.0), behind=(1.5, 3.0))
LIMITS = MotionLimits(names=["rail"], max_velocities=[1.0], max_accelerations=[2.0])


def asked(goal, regions=None, **fields):
    """Return the fields of a goal through regions, by default those two."""
    options = {"text": TWO} if regions is None else regions
    return {
        "goals": at(goal),
        "planner": "regions",
        "with_trajectory": True,
        "limits": LIMITS,
        "regions": RegionTrajectoryOptions(**options),
        **fields,
    }


def ended(action, **fields):
    """Return the result of a goal that must succeed."""
    result, status = Sent(action, **fields).end()
    assert (result.status.code, result.failure) == (Status.OK, 0), (result.status, result.reason)
    assert status == GoalStatus.STATUS_SUCCEEDED
    return result


def seconds_of(point):
    """Return when a trajectory passes a point."""
    return point.time_from_start.sec + 1e-9 * point.time_from_start.nanosec


def test_the_fastest_way_through_regions_and_what_none_is_faster_than(action):
    """From -1 to 0.5 with 1 m/s and 2 m/s^2: 1.5 s by speed, 2 s from rest to rest."""
    result = ended(action, **asked(0.5))
    way = result.through_regions
    assert list(way.regions) == ["far", "near"]
    assert way.cost == pytest.approx(1.5, abs=1e-6)
    assert way.lower_bound <= 1.5 + 1e-9
    assert way.gap == max(0.0, way.cost - way.lower_bound) < 1e-5
    assert sum(way.durations) == pytest.approx(1.5, abs=1e-6)
    assert (way.order, way.grown) == (3, "")
    points = np.reshape(way.control_points.positions, (2, 4))
    assert (points[0, 0], points[1, -1]) == pytest.approx((-1.0, 0.5), abs=1e-9)
    assert (points[0] <= 0.0).all() and (points[1] >= -0.5).all()
    first, *_, last = result.trajectory.points
    assert (list(first.velocities), list(last.velocities)) == ([0.0], [0.0])
    assert (first.positions[0], last.positions[0]) == pytest.approx((-1.0, 0.5), abs=1e-9)
    # Curves are timed by stretches with one speedup each, so no faster than that.
    assert 2.0 - 1e-6 <= seconds_of(last) <= 2.05
    assert not len(result.path.positions)
    # 0.5 m are left to the post at the end, less both radii.
    assert 0.0 < result.least_clearance <= 0.2
    assert 0.0 < result.trajectory_clearance <= 0.2
    assert result.stops == 0


def test_regions_are_read_from_a_file_below_a_key(action, tmp_path):
    """As other programs write them."""
    path = tmp_path / "regions.yaml"
    path.write_text("rail:\n" + "\n".join(f"  {line}" for line in TWO.splitlines()))
    options = {"resource": str(path), "child_name": "rail"}
    assert list(ended(action, **asked(0.5, options)).through_regions.regions) == ["far", "near"]


def test_regions_grow_along_a_path_and_serve_again(action):
    """They are told as YAML, which a goal may give; their ends are free, as is what is between."""
    result = ended(action, **asked(0.5, {"growth_padding": 0.02}))
    way = result.through_regions
    assert list(way.regions) == ["0"]
    assert way.cost == pytest.approx(1.5, abs=1e-6)
    again = ended(action, **asked(-0.25, {"text": way.grown}))
    assert again.through_regions.cost == pytest.approx(0.75, abs=1e-6)
    # Growing knew nothing of a rail that may come nearer than 0.7.
    far = ended(action, **asked(0.6, {"text": way.grown}))
    assert far.trajectory_clearance > 0.0


def test_regions_grow_around_seeds(action):
    """One around each: both are the free side of the post, so they meet."""
    result = ended(action, **asked(0.5, {"seeds": at(-0.8, 0.4)}))
    assert result.through_regions.cost == pytest.approx(1.5, abs=1e-6)
    assert re.match(r"'0':", result.through_regions.grown)


def test_more_weight_of_order_and_a_search_find_the_same(action):
    """Order 1 and no continuity; all ways searched: on a rail there is one way."""
    options = {"text": TWO, "order": 1, "continuity_order": 0, "search": True}
    result = ended(action, **asked(0.5, options))
    assert result.through_regions.cost == pytest.approx(1.5, abs=1e-6)
    assert result.through_regions.order == 1
    options = {"text": TWO, "time_weight": 2.0, "length_weight": 3.0}
    result = ended(action, **asked(0.5, options))
    assert result.through_regions.cost == pytest.approx(2.0 * 1.5 + 3.0 * 1.5, abs=1e-5)


@pytest.mark.parametrize(
    ("fields", "failure", "words"),
    [
        (asked(2.0, {"text": BEYOND}), F.NOT_FREE, r"segment \d collides .*ball.*post"),
        (asked(2.0, {"text": GAP}), F.NO_WAY, "no edges lead|no path"),
        (asked(0.68, {"text": TWO}), F.NO_WAY, "the goal is in none of 2 regions; regions.1. is"),
        (asked(0.8), F.GOAL_COLLIDES, "the goal collides: .* overlap by 100 mm"),
        (asked(0.5, start=at(1.0)), F.START_COLLIDES, "the start collides: .* by 300 mm"),
        (asked(-9.5, {"text": BEYOND}), F.GOAL_BEYOND_LIMITS, "'slide/rail': -9.5"),
        (
            asked(0.5, {"seeds": at(1.0)}),
            F.NO_REGIONS,
            r"regions.seeds, row 0: seed\[0\] \[1.0\] is not free: .* overlap by",
        ),
        (
            asked(3.0, {}, timeout=Duration(nanosec=200_000_000)),
            F.TIMEOUT,
            "no path was found within",
        ),
    ],
)
def test_a_failure_says_why(action, fields, failure, words):
    """Which pair, which end, which region."""
    result, status = Sent(action, **fields).end()
    assert (result.status.code, result.failure) == (Status.OK, failure), result
    assert re.search(words, result.reason), result.reason
    assert not len(result.trajectory.points)
    assert status == GoalStatus.STATUS_ABORTED


@pytest.mark.parametrize(
    ("fields", "code", "words"),
    [
        ({"planner": "region"}, Status.INVALID_ARGUMENT, "planner must be 'rrt_connect' or"),
        ({"with_trajectory": False}, Status.INVALID_ARGUMENT, "with_trajectory must be true"),
        ({"limits": MotionLimits()}, Status.INVALID_ARGUMENT, "has no limit of velocity"),
        ({"goals": at(0.5, 0.6)}, Status.INVALID_ARGUMENT, "goals has 2 rows"),
        (
            {"goals": RobotConfigurations(), "pose_goals": [PoseGoal(link="ball")]},
            Status.INVALID_ARGUMENT,
            "pose_goals",
        ),
        ({"order": 0}, Status.INVALID_ARGUMENT, "regions.order must be a whole number from 1"),
        ({"continuity_order": 4}, Status.INVALID_ARGUMENT, "regions.continuity_order must be"),
        ({"epsilon": 0.0}, Status.INVALID_ARGUMENT, "regions.epsilon must be a number above 0"),
        ({"delta": 1.0}, Status.INVALID_ARGUMENT, "regions.delta must be"),
        ({"num_particles": 0}, Status.INVALID_ARGUMENT, "regions.num_particles must be at least"),
        ({"num_particles": 100_001}, Status.TOO_LARGE, "regions.num_particles: 100001"),
        ({"growth_padding": -0.1}, Status.INVALID_ARGUMENT, "regions.growth_padding must be"),
        (
            {"configuration_space_margin": float("nan")},
            Status.INVALID_ARGUMENT,
            "regions.configuration_space_margin must be a number from 0 on, not nan",
        ),
        ({"time_weight": -1.0}, Status.INVALID_ARGUMENT, "regions.time_weight must be"),
        ({"time_weight": 0.0}, Status.INVALID_ARGUMENT, "regions.length_weight are both 0"),
        ({"max_rounded_paths": 0}, Status.INVALID_ARGUMENT, "regions.max_rounded_paths must be"),
        ({"resource": "/nowhere.yaml"}, Status.INVALID_ARGUMENT, "both given"),
        ({"resource": "/nowhere.yaml", "text": ""}, Status.INVALID_ARGUMENT, "/nowhere.yaml"),
        ({"seeds": at(0.0)}, Status.INVALID_ARGUMENT, "regions.seeds has positions, and regions"),
        (
            {"text": "", "seeds": RobotConfigurations(names=["rial"], positions=[0.0])},
            Status.UNKNOWN_NAME,
            "regions.seeds.names",
        ),
        ({"text": "far: {A: [[1, 0]]}"}, Status.INVALID_ARGUMENT, "regions.text"),
        ({"text": "{}"}, Status.INVALID_ARGUMENT, "regions.text has no regions"),
        (
            {"text": "a: {A: [[1, 0], [-1, 0]], b: [1, 1]}"},
            Status.INVALID_ARGUMENT,
            "'a' has 2 dimensions, and 1 positions move",
        ),
        ({"text": "a: {A: [[1]], b: [1]}"}, Status.INVALID_ARGUMENT, "'a' is unbounded"),
        (
            {"text": "a: {A: [[1], [-1]], b: [1, -2]}"},
            Status.INVALID_ARGUMENT,
            "'a' is empty",
        ),
        ({"child_name": "rail"}, Status.INVALID_ARGUMENT, "regions.text has no 'rail'"),
    ],
)
def test_a_goal_that_means_nothing_is_aborted_with_a_status(action, fields, code, words):
    """By field and value; the node goes on."""
    options = {"text": TWO}
    options |= {k: v for k, v in fields.items() if hasattr(RegionTrajectoryOptions, k)}
    others = {k: v for k, v in fields.items() if not hasattr(RegionTrajectoryOptions, k)}
    result, status = Sent(action, **asked(0.5, options, **others)).end()
    assert result.status.code == code, result.status
    assert words in result.status.message
    assert status == GoalStatus.STATUS_ABORTED


def test_the_way_is_shown_by_what_is_proven_and_by_speed(action, client):
    """Green where 10 cm are proven, red near the post; blue at rest, orange at full speed."""
    ended(action, **asked(0.65))
    listener = client.listen(MarkerArray, "markers/plan")
    shown = listener.wait_for_newest(
        lambda m: any(each.ns == "plan/speed" and each.points for each in m.markers),
        "the speed of the ball",
    )
    lines = {each.ns: each for each in shown.markers if each.type == Marker.LINE_STRIP}
    way, speed = lines["plan/way"], lines["plan/speed"]
    assert len(way.points) == len(way.colors) > 30
    assert (way.points[0].x, way.points[-1].x) == pytest.approx((-1.0, 0.65), abs=1e-9)
    # At 0.65 the two are 50 mm apart: five of ten steps are proven, at most.
    assert way.colors[0].g == pytest.approx(0.75) and way.colors[0].r == pytest.approx(0.0)
    assert 0.35 <= way.colors[-1].r / 0.9 <= 0.75
    by_speed = [color.r for color in speed.colors]
    middle = np.argmin([abs(point.x) for point in speed.points])
    assert by_speed[0] < 0.4 and by_speed[-1] < 0.4
    assert by_speed[middle] > 0.9
    client.forget(listener)


def test_growing_is_cancelled(action):
    """While it is told that regions grow: with so many points it would take minutes."""
    options = {"num_particles": 100_000, "epsilon": 1e-5, "delta": 1e-6}
    sent = Sent(action, **asked(0.5, options))
    sent.wait_for(PlanPath.Feedback.GROWING)
    assert len(sent.cancel().goals_canceling) == 1
    result, status = sent.end()
    assert status == GoalStatus.STATUS_CANCELED
    assert result.failure == F.CANCELED
    assert re.match(r"cancelled after .* s, while regions grew", result.reason)
