"""A plan begins where somebody has said that the robot is, or says so itself."""

from __future__ import annotations

from plan_goals import at, Planner, Sent
import pytest
from sensor_msgs.msg import JointState
from sliding_robots import rail_scene
from spinning import wait_until

from scene_graph_msgs.msg import Status


@pytest.fixture(scope="module")
def action(client, start_node, tmp_path_factory):
    """A client of a node that has heard nothing of its robot."""
    start_node({"scene": rail_scene(tmp_path_factory.mktemp("rails"))})
    planner = Planner(client)
    yield planner
    planner.destroy()


def test_nobody_has_said_where_the_robot_is_then_long_ago_then_now(client, action):
    """Contacts go on meanwhile."""
    result, _ = Sent(action, goals=at(0.5)).end()
    assert result.status.code == Status.STALE
    assert "nobody has reported slide/rail" in result.status.message
    result, _ = Sent(action, start=at(0.0), goals=at(0.5)).end()
    assert (result.status.code, result.failure) == (Status.OK, 0), result.status.message
    publisher = client.publisher(JointState, "/joint_states")

    def is_there():
        message = JointState(name=["rail"], position=[0.25])
        message.header.stamp = client.now()
        message.header.stamp.sec -= 3
        publisher.publish(message)
        place = client.call("GetPoseInWorld", frames=["slide/ball"]).poses[0].position.x
        return place == pytest.approx(0.25)

    wait_until(is_there, "the ball where it was three seconds ago")
    result, _ = Sent(action, goals=at(0.5), max_state_age=1.0).end()
    assert result.status.code == Status.STALE
    assert "the last report of slide/rail " in result.status.message
    assert "max_state_age is 1 s" in result.status.message
    # On a busy machine the report may be too old by now for the node's own limit, too.
    wait_until(is_there, "a newer report")
    result, _ = Sent(action, goals=at(0.5)).end()
    assert (result.status.code, list(result.path.positions)) == (Status.OK, [0.25, 0.5])
