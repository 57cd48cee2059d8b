"""Viewers and clients come and go: nothing of them is left with the node."""

from __future__ import annotations

import gc
from types import BuiltinFunctionType, FunctionType, ModuleType

from node_harness import Client, wait_until
import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from scene_requests import register_balls
from spinning import SpinningThread
from visualization_msgs.msg import MarkerArray

from scene_graph_ros.node.node import SceneGraphNode

VISITS = 8
PLAIN = (
    *(bool, int, float, str, bytes, type(None)),
    *(type, ModuleType, FunctionType, BuiltinFunctionType),
)
TOPIC = "/visited/markers/proximity"


@pytest.fixture(scope="module")
def node(domain):
    """A node in this process, so that one can see what it keeps."""
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=domain)
    node = SceneGraphNode("visited", context=context)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    spinning = SpinningThread(executor)
    yield node
    spinning.close()
    node.destroy_node()
    rclpy.shutdown(context=context)


@pytest.fixture(scope="module")
def resident(domain, node):
    """A client that stays, with two balls in the scene."""
    client = Client(domain, "/visited")
    register_balls(client)
    yield client
    client.close()


def reachable(root, *borders):
    """Return how many references hang on ``root``, up to what others own, too.

    Plain values count each time: whether two that are equal are one object is the interpreter's.
    """
    seen = {id(each) for each in borders}
    count, waiting = 0, [root]
    while waiting:
        each = waiting.pop()
        count += 1
        if isinstance(each, PLAIN) or id(each) in seen:
            continue
        seen.add(id(each))
        waiting += gc.get_referents(each)
    return count


def visit(domain, node):
    """Come with a participant of one's own, look, ask, and go."""
    effects = node.server.effects
    markers = wait_until(lambda: effects.running("proximity"), "the effect to be on")
    outlet = markers._outlet
    visitor = Client(domain, "/visited")
    try:
        before = outlet.messages
        visitor.listen(MarkerArray, TOPIC, 5)
        wait_until(lambda: outlet.is_heard() and outlet.messages > before, "markers for a visitor")
        assert visitor.call("HasCollisions").status.code == 0
    finally:
        visitor.close()
    wait_until(lambda: not outlet.is_heard(), "the visitor to be gone")


def test_viewers_leave_nothing_with_what_publishes(domain, node, resident):
    """The outlet of a topic holds as many objects after many visits as after one."""
    effects = node.server.effects
    markers = wait_until(lambda: effects.running("proximity"), "the effect to be on")
    outlet = markers._outlet
    borders = (node, node.server, outlet._publisher)

    visit(domain, node)
    first = reachable(outlet, *borders)
    for _ in range(VISITS):
        visit(domain, node)
    assert reachable(outlet, *borders) == first


def test_clients_leave_nothing_with_what_answers(domain, node, resident):
    """No request is kept once it is answered, and none that waits when its client has gone."""
    loop = node.server._services._loop

    def kept():
        return reachable(loop._backlog, node, node.server)

    visit(domain, node)
    wait_until(lambda: not loop._backlog._running, "the answers")
    first = kept()
    for _ in range(VISITS):
        visit(domain, node)
    wait_until(lambda: not loop._backlog._running, "the answers")
    assert kept() == first
