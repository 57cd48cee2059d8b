"""A client's object in a robot's hand, as the node knows it: a ball of 0.1 m on a rail carries it.

The robot's ball is at -1 on the rail, the post, a ball of 0.2 m, at 1. The client's own ball of
0.1 m is put 0.5 m before the robot's, so it touches the post where the rail is at 0.2.
"""

from __future__ import annotations

from geometry_msgs.msg import Point, Pose
import pytest
from scene_requests import sphere
from sensor_msgs.msg import JointState
from sliding_robots import rail_scene
from spinning import wait_until

from scene_graph_msgs.msg import (
    FrameDescription,
    RobotConfigurations,
    Status,
)
from scene_graph_msgs.srv import CheckConfigurations

FREE, COLLIDES = CheckConfigurations.Response.FREE, CheckConfigurations.Response.COLLIDES


@pytest.fixture(scope="module")
def node(start_node, tmp_path_factory):
    """A node with the robot and the post."""
    return start_node({"scene": rail_scene(tmp_path_factory.mktemp("rails"))})


def at(*rails):
    """Return configurations."""
    return RobotConfigurations(names=["rail"], positions=list(map(float, rails)))


def called(client, service, /, **fields):
    """Return an answer that is OK."""
    answer = client.call(service, **fields)
    assert answer.status.code == Status.OK, answer.status.message
    return answer


def test_an_object_is_grasped_carried_and_let_go(client, node):
    """It moves with joint states, hits what the robot does not, and stays where it is let go."""
    source = called(client, "RegisterSource", name="things").source
    called(client, "RegisterFrame", source=source, frames=[FrameDescription(name="apple")])
    apple = sphere("apple", 0.1)
    called(client, "RegisterGeometry", source=source, frame="apple", geometries=[apple])
    pose = Pose(position=Point(x=0.5))
    wrong = client.call("AttachFrame", source=source, frame="apple", link="claw")
    assert wrong.status.code == Status.UNKNOWN_NAME
    assert "link: no robot has a link 'claw'" in wrong.status.message
    grasp = {"source": source, "frame": "apple", "link": "ball", "with_pose": True, "pose": pose}
    called(client, "AttachFrame", **grasp)
    found = called(client, "CheckConfigurations", configurations=at(0.15, 0.25, 0.65))
    assert list(found.outcomes) == [FREE, COLLIDES, COLLIDES]
    found = called(
        client,
        "CheckClearance",
        configurations=at(0.1),
        influence_distance=0.2,
        with_jacobians=True,
    ).clearances
    assert list(found.distance) == pytest.approx([0.1], abs=1e-12)
    assert list(found.jacobian) == pytest.approx([-1.0], abs=1e-12)
    assert set(found.geometries.name) == {"post", "apple"}
    publisher = client.publisher(JointState, "/joint_states")

    def is_at(x):
        answer = called(client, "GetPoseInWorld", frames=["apple"])
        return answer.poses[0].position.x == pytest.approx(x, abs=1e-9)

    def go(rail):
        message = JointState(name=["rail"], position=[rail])
        message.header.stamp = client.now()
        publisher.publish(message)
        return is_at(rail + 0.5)

    wait_until(lambda: go(0.25), "the apple where the hand brings it")
    assert list(called(client, "HasCollisions").has_collisions) == [True]
    assert called(client, "DetachFrame", source=source, frame="apple").pose.position.x == 0.75
    message = JointState(name=["rail"], position=[-2.0])
    message.header.stamp = client.now()
    publisher.publish(message)
    wait_until(
        lambda: (
            called(client, "CheckClearance", influence_distance=5.0).clearances.distance[0] > 2.5
        ),
        "the robot without the apple",
    )
    assert is_at(0.75)
    again = client.call("DetachFrame", source=source, frame="apple")
    assert again.status.code == Status.UNKNOWN_NAME
