"""Many requests at once: none is lost, and what is too much is refused by name."""

from __future__ import annotations

from collections import Counter

from builtin_interfaces.msg import Duration
from node_harness import CLIENT_DEPTH, DEADLINE, wait_until
import pytest
from rclpy.qos import QoSProfile
from scene_requests import register_balls, transform
from sensor_msgs.msg import MultiDOFJointState

from scene_graph_msgs.msg import QueryOptions, Status
from scene_graph_msgs.srv import HasCollisions

LIMIT = 1000
"""The default of ``max_waiting_requests``."""

AT_ONCE = 300
"""Requests that are sent before others are waited for: that many may wait for threads."""

WAIT = 60.0
"""Seconds that requests may wait for poses: the most that a node allows."""


@pytest.fixture(scope="module")
def node(start_node):
    """A node with the limits that it has by default, but a long ``max_wait``."""
    return start_node({"max_wait": WAIT})


@pytest.fixture(scope="module")
def scene(client, node):
    """Two balls, which the first question has found to overlap: what it takes is loaded."""
    source = register_balls(client)
    assert list(client.call("HasCollisions").has_collisions) == [True]
    return source


def codes(futures):
    """Wait until all are answered, and return the codes."""
    wait_until(
        lambda: all(future.done() for future in futures),
        f"{len(futures)} answers",
        2.0 * DEADLINE,
    )
    return [future.result().status.code for future in futures]


@pytest.mark.parametrize("count", [20, 200, 1000, 4000])
def test_all_requests_of_one_client_are_answered(client, scene, count):
    """Sent at once, faster than any thread answers; beyond the limit some may be refused."""
    futures = [client.start("HasCollisions") for _ in range(count)]
    answers = Counter(codes(futures))
    assert set(answers) <= {Status.OK, Status.TOO_LARGE}
    assert answers[Status.OK] >= min(count, LIMIT)


def test_all_requests_of_twenty_clients_are_answered(client, scene):
    """Fifty of each, in turn, all at once."""
    qos = QoSProfile(depth=CLIENT_DEPTH)
    clients = [
        client.node.create_client(HasCollisions, "/scene_graph/has_collisions", qos_profile=qos)
        for _ in range(20)
    ]
    wait_until(lambda: all(each.service_is_ready() for each in clients), "the service")
    futures = [each.call_async(HasCollisions.Request()) for _ in range(50) for each in clients]
    assert codes(futures) == [Status.OK] * 1000
    for each in clients:
        client.destroy(each)


def test_who_waits_for_poses_is_answered_or_refused(client, scene):
    """As many as may wait until the pose comes; those beyond are told why at once."""
    stamp, more = client.now(), 300
    options = QueryOptions(minimal_stamp=stamp, timeout=Duration(sec=int(WAIT)))
    futures = []
    while len(futures) < LIMIT + more:
        count = min(AT_ONCE, LIMIT + more - len(futures))
        futures += [client.start("HasCollisions", options=options) for _ in range(count)]
        # In its turn: those before it wait for threads no more.
        assert client.call("DescribeScene").status.code == Status.OK
    wait_until(lambda: sum(future.done() for future in futures) == more, "the refusals")
    refused = [future.result().status for future in futures if future.done()]
    assert {status.code for status in refused} == {Status.TOO_LARGE}
    assert {status.message for status in refused} == {
        f"{LIMIT} requests wait for poses already, and max_waiting_requests is {LIMIT}"
    }
    publisher = client.publisher(MultiDOFJointState, "/balls/poses")
    message = MultiDOFJointState(joint_names=["b"], transforms=[transform(0.5)])
    message.header.stamp = stamp
    publisher.publish(message)
    answers = codes(futures)
    assert (answers.count(Status.OK), answers.count(Status.TOO_LARGE)) == (LIMIT, more)
