"""Planning as clients of the node ask for it: a ball of 0.1 m on a rail, a post in its way.

The post is a ball of 0.2 m at 1 m, so the two overlap where the rail is beyond 0.7.
"""

from __future__ import annotations

import pytest
from sensor_msgs.msg import JointState
from sliding_robots import rail_scene
from spinning import wait_until

from scene_graph_msgs.msg import RobotConfigurations, Status
from scene_graph_msgs.srv import CheckConfigurations, CheckEdges

FREE, COLLIDES = CheckConfigurations.Response.FREE, CheckConfigurations.Response.COLLIDES


@pytest.fixture(scope="module")
def node(start_node, tmp_path_factory):
    """A node with the ball and the post; the rail is at -1."""
    return start_node({"scene": rail_scene(tmp_path_factory.mktemp("rails"))})


def at(*rails):
    """Return configurations."""
    return RobotConfigurations(names=["rail"], positions=list(map(float, rails)))


def effect(client, name):
    """Return what is said of an effect."""
    return next(e for e in client.call("ListEffects").effects if e.name == name)


@pytest.fixture(scope="module")
def joints(client, node):
    """Publish where the ball is."""
    publisher = client.publisher(JointState, "/joint_states")

    def publish(rail):
        message = JointState(name=["rail"], position=[float(rail)])
        message.header.stamp = client.now()
        publisher.publish(message)

    return publish


def test_planning_is_off_until_somebody_asks(client, node):
    """And on from the first request on."""
    assert not effect(client, "planning").is_on
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
