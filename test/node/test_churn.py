"""Sources and subscribers come and go as fast as they can: nothing fails, in any executor."""

from __future__ import annotations

from contextlib import contextmanager
import sys

from node_harness import Client, wait_until
import pytest
import rclpy
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from scene_requests import register_balls
from spinning import SpinningThread
from visualization_msgs.msg import MarkerArray

from scene_graph_msgs.msg import ContactArray, Status
from scene_graph_ros.node.node import SceneGraphNode
from scene_graph_ros.node.runtime.loop import OwnThreadGroup

ROUNDS = 60
"""Where other threads than the one that waits destroy what it waits for, a few of these fail."""

DESCRIPTIONS = 3
"""Asked for in each round while a source comes, and as many while it goes."""


@contextmanager
def switching():
    """Let threads take turns as often as they can, so that what may come between does."""
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        yield
    finally:
        sys.setswitchinterval(interval)


@pytest.fixture(params=[SingleThreadedExecutor, MultiThreadedExecutor])
def client(request, domain):
    """A client of a node in an executor of this process, which fails where that raises."""
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=domain)
    node = SceneGraphNode("churned", context=context)
    executor = request.param(context=context)
    executor.add_node(node)
    spinning = SpinningThread(executor)
    client = Client(domain, "/churned")
    yield client
    client.close()
    spinning.close()
    node.destroy_node()
    rclpy.shutdown(context=context)


def come_and_go(client, contacts):
    """Let sources and viewers come and go; return the futures of descriptions of the scene."""
    described = []
    for i in range(ROUNDS):
        changes = [client.start("RegisterSource", name=f"guest_{i}", token=1)]
        described += [client.start("DescribeScene") for _ in range(DESCRIPTIONS)]
        viewer = client.node.create_subscription(
            MarkerArray, "/churned/markers/proximity", lambda message: None, 10
        )
        wait_until(changes[0].done, "the source")
        changes.append(client.start("RemoveSource", source=changes[0].result().source))
        described += [client.start("DescribeScene") for _ in range(DESCRIPTIONS)]
        client.destroy(viewer)
        futures = [*described, *changes]
        wait_until(lambda futures=futures: all(f.done() for f in futures), "the answers")
        assert [change.result().status.code for change in changes] == [Status.OK] * 2
        count = contacts.count
        wait_until(lambda count=count: contacts.count > count, "contacts")
    return described


def test_nothing_fails_while_all_come_and_go(client, capfd):
    """No error is logged, the scene can always be described, and the contacts go on."""
    register_balls(client)
    contacts = client.listen(ContactArray, "contacts")
    contacts.wait_for(lambda message: len(message.points) == 1, "the contact of the balls")
    with switching():
        described = come_and_go(client, contacts)
    refusals = {future.result().status.message for future in described}
    assert refusals == {""}
    assert "failed" not in "".join(capfd.readouterr())


def test_what_went_leaves_nothing_behind(domain):
    """The group of what the world's thread waits for does not grow with all that ever came."""
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=domain)
    node = rclpy.create_node("grows", context=context)
    group = OwnThreadGroup()
    for _ in range(3):
        node.destroy_subscription(
            node.create_subscription(MarkerArray, "/gone", print, 1, callback_group=group)
        )
    assert not group.entities
    node.destroy_node()
    rclpy.shutdown(context=context)
