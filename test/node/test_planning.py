"""Planning as clients of the node ask for it: a ball of 0.1 m on a rail, a post in its way.

The post is a ball of 0.2 m at 1 m, so the two overlap where the rail is beyond 0.7.
"""

from __future__ import annotations

import re

from action_msgs.msg import GoalStatus
from builtin_interfaces.msg import Duration
from plan_goals import at, Planner, post_publisher, rail_publisher, Sent
import pytest
from sliding_robots import rail_scene
from spinning import wait_until
from visualization_msgs.msg import Marker, MarkerArray

from scene_graph_msgs.action import PlanPath
from scene_graph_msgs.msg import MotionLimits, PlanHolds, PoseGoal, RobotConfigurations, Status
from scene_graph_msgs.srv import CheckConfigurations, CheckEdges
from scene_graph_ros.planning import PlanFailure, PlanStage

PLAN_TOPICS = ("/scene_graph/plan_holds", "/scene_graph/markers/plan")
FREE, COLLIDES = CheckConfigurations.Response.FREE, CheckConfigurations.Response.COLLIDES


@pytest.fixture(scope="module")
def node(start_node, tmp_path_factory):
    """A node with the ball and the post; the rail is at -1."""
    scene = rail_scene(tmp_path_factory.mktemp("rails"))
    folders = str(tmp_path_factory.getbasetemp())
    return start_node(
        {
            "scene": scene,
            "max_waiting_plans": 1,
            "resource_folders": folders,
            "plan_from_unreported": True,
        }
    )


def tool_at(x, tool=0.0, **tolerances):
    """Return a goal: what is ``tool`` in front of the ball's middle is to be at x on the rail."""
    message = PoseGoal(link="ball", **tolerances)
    message.tool.position.x, message.pose.position.x = float(tool), float(x)
    return message


def effect(client, name):
    """Return what is said of an effect."""
    return next(e for e in client.call("ListEffects").effects if e.name == name)


@pytest.fixture(scope="module")
def joints(client, node):
    """Publish where the ball is."""
    return rail_publisher(client)


def test_planning_is_off_until_somebody_asks(client, node):
    """And on from the first request on."""
    assert not effect(client, "planning").is_on
    assert not effect(client, "plan").is_on
    assert not [t for t, _ in client.node.get_topic_names_and_types() if t in PLAN_TOPICS]
    answer = client.call("CheckConfigurations", configurations=at(0.0, 1.0), with_collisions=True)
    assert answer.status.code == Status.OK, answer.status.message
    assert list(answer.outcomes) == [FREE, COLLIDES]
    assert answer.collisions.depth[0] == pytest.approx(0.3, abs=1e-12)
    assert effect(client, "planning").is_on


def test_edges_are_proven(client, node):
    """One is free, one is not."""
    answer = client.call("CheckEdges", ends=at(0.0, 0.5, 0.0, 1.5), with_measures=True)
    assert answer.status.code == Status.OK, answer.status.message
    assert list(answer.outcomes) == [CheckEdges.Response.FREE, CheckEdges.Response.COLLIDES]


def test_the_present_configuration_is_that_of_the_joint_states(client, node, joints):
    """Asked without names, it follows the robot into the post and out again."""
    for rail, outcome in ((1.0, COLLIDES), (-1.0, FREE)):
        joints(rail)
        wait_until(
            lambda outcome=outcome: list(client.call("CheckConfigurations").outcomes) == [outcome],
            f"the ball where the rail is at {rail}",
        )


def test_what_means_nothing_is_refused_with_a_status(client, node):
    """Names, lengths and numbers; the node goes on."""
    for code, fields in (
        (Status.UNKNOWN_NAME, {"configurations": RobotConfigurations(names=["rial"])}),
        (Status.INVALID_ARGUMENT, {"configurations": at(float("nan"))}),
        (Status.INVALID_ARGUMENT, {"configurations": RobotConfigurations(positions=[1.0])}),
        (Status.INVALID_ARGUMENT, {"environment_padding": float("inf")}),
        (Status.TOO_LARGE, {"configurations": at(*range(100_001))}),
    ):
        answer = client.call("CheckConfigurations", **fields)
        assert answer.status.code == code, answer.status
        assert answer.status.message
    assert list(client.call("CheckConfigurations").outcomes) == [FREE]


# The action.


@pytest.fixture(scope="module")
def action(client, node):
    """A client of the action."""
    planner = Planner(client)
    yield planner
    planner.destroy()


WITHOUT_END = {"goals": at(3.0)}
"""The post is in between, and there is no way around it."""


def test_a_path_is_found_and_proven(action, joints):
    """From where the robot is to before the post, which it keeps away from."""
    sent = Sent(action, goals=at(0.5), seed=3)
    result, status = sent.end()
    assert (result.status.code, result.failure) == (Status.OK, 0), (result.status, result.reason)
    assert status == GoalStatus.STATUS_SUCCEEDED
    assert result.path.names == ["slide/rail"]
    assert list(result.path.positions) == [-1.0, 0.5]
    assert result.length == pytest.approx(1.5, abs=1e-12)
    assert 0.0 < result.least_clearance <= 0.2
    assert result.seconds > 0.0
    assert sent.feedback


def test_a_goal_of_several_and_a_start_elsewhere(action, joints):
    """Of three goals the last alone can be reached from behind the post."""
    sent = Sent(action, start=at(2.0), goals=at(1.0, 99.0, 2.5), environment_padding=0.05)
    result, status = sent.end()
    assert status == GoalStatus.STATUS_SUCCEEDED, result
    assert result.goal == 2
    assert list(result.path.positions) == [2.0, 2.5]


def test_a_tool_is_put_where_the_goal_says(action, joints):
    """What is 0.3 m in front of the ball comes to 0.5; of three goals the last can be reached."""
    sent = Sent(action, pose_goals=[tool_at(0.5, tool=0.3)], environment_padding=0.01)
    result, status = sent.end()
    assert status == GoalStatus.STATUS_SUCCEEDED, result
    assert list(result.path.positions) == pytest.approx([-1.0, 0.2], abs=1e-9)
    goals = [tool_at(1.0), tool_at(20.0), tool_at(-3.0)]
    result, status = Sent(action, pose_goals=goals).end()
    assert status == GoalStatus.STATUS_SUCCEEDED, result
    assert result.goal == 2
    assert list(result.path.positions) == pytest.approx([-1.0, -3.0], abs=1e-9)


F = PlanPath.Result


@pytest.mark.parametrize(
    ("fields", "failure", "words"),
    [
        ({"start": at(1.0), "goals": at(0.0)}, F.START_COLLIDES, "start collides: .* by 300 mm"),
        ({"start": at(9.5), "goals": at(0.0)}, F.START_BEYOND_LIMITS, "slide/rail.*9.5"),
        ({"goals": at(0.8)}, F.GOAL_COLLIDES, "goal collides: .*post.* overlap by 100 mm"),
        ({"goals": at(-9.5)}, F.GOAL_BEYOND_LIMITS, "'slide/rail': -9.5"),
        ({"pose_goals": [tool_at(0.8)]}, F.GOAL_COLLIDES, "target collides: .* overlap by 100 mm"),
        # The rail ends at 9.
        ({"pose_goals": [tool_at(9.5)]}, F.GOAL_UNREACHED, "the nearest is 500 mm and 0 rad off"),
        (
            {"pose_goals": [tool_at(9.5), tool_at(0.8)]},
            F.GOAL_COLLIDES,
            "none of 2 goals can be reached: goal 0: none of 256 tries .*; goal 1: the only",
        ),
        (
            {**WITHOUT_END, "timeout": Duration(nanosec=200_000_000)},
            F.TIMEOUT,
            "no path was found within 0.2 s: the trees",
        ),
    ],
)
def test_a_failure_says_why(action, joints, fields, failure, words):
    """Which pair and how deep, which limit, how far the search came."""
    result, status = Sent(action, **fields).end()
    assert (result.status.code, result.failure) == (Status.OK, failure), result
    assert re.search(words, result.reason), result.reason
    assert not len(result.path.positions)
    assert status == GoalStatus.STATUS_ABORTED


@pytest.mark.parametrize(
    ("fields", "code", "words"),
    [
        ({}, Status.INVALID_ARGUMENT, "goals.names is empty"),
        ({"goals": at()}, Status.INVALID_ARGUMENT, "goals.positions is empty"),
        ({"goals": at(float("nan"))}, Status.INVALID_ARGUMENT, "in row 0 must be a number"),
        ({"goals": at(0.0), "start": at(0.0, 1.0)}, Status.INVALID_ARGUMENT, "start has 2 rows"),
        ({"goals": at(0.0), "group": "leg"}, Status.UNKNOWN_NAME, "no robot has a group 'leg'"),
        (
            {"goals": RobotConfigurations(names=["rial"], positions=[1.0])},
            Status.UNKNOWN_NAME,
            "'rial'; did you mean 'rail'",
        ),
        (
            {"goals": at(0.0), "environment_padding": float("inf")},
            Status.INVALID_ARGUMENT,
            "environment_padding must be",
        ),
        (
            {"goals": at(0.0), "timeout": Duration(sec=-1)},
            Status.INVALID_ARGUMENT,
            "timeout is negative: -1 s",
        ),
        (
            {"pose_goals": [PoseGoal(link="bal")]},
            Status.UNKNOWN_NAME,
            "pose_goals[0].link: no robot has a link 'bal'; did you mean 'ball'",
        ),
        (
            {"pose_goals": [tool_at(0.0), tool_at(0.5, position_tolerance=-1.0)]},
            Status.INVALID_ARGUMENT,
            "pose_goals[1].position_tolerance must be a number from 0 on, not -1.0",
        ),
        (
            {"pose_goals": [tool_at(float("nan"))]},
            Status.INVALID_ARGUMENT,
            "pose_goals[0].pose",
        ),
        (
            {"pose_goals": [tool_at(0.0)], "goals": at(0.0)},
            Status.INVALID_ARGUMENT,
            "goals has positions, and pose_goals is there, too: give either",
        ),
        ({"goals": at(*range(100_001))}, Status.TOO_LARGE, "configurations: 100002 are more than"),
        (
            {"goals": at(0.0), "with_trajectory": True},
            Status.INVALID_ARGUMENT,
            "position 'slide/rail' has no limit of velocity",
        ),
        (
            {
                "goals": at(0.0),
                "with_trajectory": True,
                "limits": MotionLimits(names=["rail"], max_velocities=[0.0], max_acceleration=1.0),
            },
            Status.INVALID_ARGUMENT,
            "velocities of 'slide/rail' must be from 1e-12 to 1e+18, not 0",
        ),
        (
            {"goals": at(0.0), "rise_time": Duration(sec=-1)},
            Status.INVALID_ARGUMENT,
            "rise_time is negative: -1 s",
        ),
    ],
)
def test_a_goal_that_means_nothing_is_aborted_with_a_status(action, joints, fields, code, words):
    """By field and value; the node goes on."""
    result, status = Sent(action, **fields).end()
    assert result.status.code == code, result.status
    assert words in result.status.message
    assert status == GoalStatus.STATUS_ABORTED


def test_a_search_is_cancelled_while_the_world_goes_on(action, client, joints):
    """Services answer and joint states count meanwhile; a goal waits, and then has its turn.

    A goal more than may wait is aborted, with the limit.
    """
    sent = Sent(action, **WITHOUT_END)
    sent.wait_for(PlanPath.Feedback.SEARCHING)
    waiting = Sent(action, start=at(0.0), goals=at(0.5))
    waiting.wait_for(PlanPath.Feedback.WAITING, ahead=1)
    result, _ = Sent(action, goals=at(0.5)).end()
    assert result.status.code == Status.TOO_LARGE
    assert "1 goals wait for their turn already, and max_waiting_plans is 1" in (
        result.status.message
    )
    joints(1.0)
    wait_until(
        lambda: list(client.call("CheckConfigurations").outcomes) == [COLLIDES],
        "the robot in the post",
    )
    assert sent.feedback[-1].state == PlanPath.Feedback.SEARCHING
    assert len(sent.cancel().goals_canceling) == 1
    result, status = sent.end()
    assert status == GoalStatus.STATUS_CANCELED
    assert result.failure == PlanPath.Result.CANCELED
    assert re.match(r"cancelled after .* s: the trees from start and goal had", result.reason)
    result, status = waiting.end()
    assert status == GoalStatus.STATUS_SUCCEEDED, result
    joints(-1.0)
    wait_until(
        lambda: list(client.call("CheckConfigurations").outcomes) == [FREE],
        "the robot out of the post",
    )


@pytest.fixture(scope="module")
def post(client, node):
    """Put the post somewhere on the rail."""
    return post_publisher(client)


def test_a_path_is_proven_again_when_things_move(action, client, joints, post):
    """It holds, and does not when the post is put on it, and does again; another is its own."""
    result, _ = Sent(action, goals=at(0.5)).end()
    assert result.failure == 0, result.reason
    holds = client.listen(PlanHolds, "plan_holds")
    first = holds.wait_for_newest(lambda m: m.holds, "a path that holds")
    assert 0.0 < first.least_clearance <= 0.2
    post(0.4)
    stopped = holds.wait_for_newest(lambda m: not m.holds, "a path that does not hold")
    assert {stopped.geometry_a.name, stopped.geometry_b.name} == {"post", "ball_collision_0"}
    assert stopped.goal_id == first.goal_id
    assert (stopped.edge, stopped.least_clearance) == (0, 0.0)
    # Where the two are in each other: 0.3 m minus their distance, as deep as it says.
    (rail,) = stopped.configuration.positions
    assert rail == pytest.approx(-1.0 + 1.5 * stopped.at, abs=1e-12)
    assert stopped.depth == pytest.approx(0.3 - abs(rail - 0.4), abs=1e-9)
    assert re.search("ball_collision_0 and around/post/post overlap by", stopped.reason)
    post(1.0)
    holds.wait_for_newest(lambda m: m.holds, "a path that holds again")
    # The robot itself may be anywhere: it is the path that is proven.
    result, _ = Sent(action, start=at(2.0), goals=at(2.5)).end()
    assert result.failure == 0, result.reason
    holds.wait_for_newest(lambda m: m.holds and m.goal_id != first.goal_id, "the other path")
    client.forget(holds)


def test_a_path_is_shown(action, client, joints, post):
    """Four ghosts of the ball, evenly on its way, and the way; a fifth in red where it stops."""
    result, _ = Sent(action, goals=at(0.5)).end()
    assert result.failure == 0, result.reason
    listener = client.listen(MarkerArray, "markers/plan")

    def shows(count):
        return lambda m: sum("ball" in each.ns and each.action == 0 for each in m.markers) == count

    shown = listener.wait_for_newest(shows(4), "ghosts of a path")
    ghosts = [marker for marker in shown.markers if "ball" in marker.ns]
    xs = [marker.pose.position.x for marker in ghosts]
    assert xs == pytest.approx([-1.0, -0.5, 0.0, 0.5], abs=1e-9)
    (way,) = [marker for marker in shown.markers if marker.ns == "plan/way"]
    assert (way.points[0].x, way.points[-1].x) == pytest.approx((-1.0, 0.5), abs=1e-9)
    # Far from all at its beginning it is green.
    assert way.colors[0].g > way.colors[0].r
    post(0.0)
    stopped = listener.wait_for_newest(shows(5), "the ghost where it stops")
    (first,) = [each for each in stopped.markers if each.ns.startswith("plan/stop/")]
    # The post at 0 of 0.2 m and the ball of 0.1 m: it stops at -0.3, and is red.
    assert first.pose.position.x == pytest.approx(-0.3, abs=0.01)
    assert first.color.r > 0.8 > 0.2 > max(first.color.g, first.color.b)
    others = [each for each in stopped.markers if "ball" in each.ns and each is not first]
    assert all(each.color.r < each.color.b for each in others if each.action == Marker.ADD)
    post(1.0)
    whole = listener.wait_for_newest(shows(4), "the path as it was")
    assert [m.ns for m in whole.markers if m.action == Marker.DELETE]
    client.forget(listener)


def test_a_path_of_robots_that_are_gone_does_not_hold(action, client, node, joints, tmp_path):
    """Another robot comes to the scene: it is not the one that was planned for."""
    result, _ = Sent(action, goals=at(0.5)).end()
    assert result.failure == 0, result.reason
    holds = client.listen(PlanHolds, "plan_holds")
    holds.wait_for_newest(lambda m: m.holds, "a path that holds")
    text = rail_scene(tmp_path, two=True).read_text().replace("name: slide", "name: more")
    answer = client.call("LoadScene", text=text.replace("around", "elsewhere"))
    assert answer.status.code == Status.OK, answer.status
    stopped = holds.wait_for_newest(lambda m: not m.holds, "a path that does not hold")
    assert "the scene has other robots than those" in stopped.reason
    assert not len(stopped.configuration.positions)
    for source in answer.sources:
        assert client.call("RemoveSource", source=source).status.code == Status.OK
    holds.wait_for_newest(lambda m: m.holds, "a path that holds again")
    client.forget(holds)


def test_failures_have_the_numbers_of_planning():
    """And so have the states of feedback."""
    for failure in PlanFailure:
        assert getattr(PlanPath.Result, failure.name) == failure.value
    for stage in PlanStage:
        assert getattr(PlanPath.Feedback, stage.name) == stage.value


def test_the_node_ends_while_it_plans(action, node, joints):
    """In order, as it is asked to; the last test of this node."""
    Sent(action, **WITHOUT_END).wait_for(PlanPath.Feedback.SEARCHING)
    assert node.stop() == 0
