"""Requests that wait for poses: answered in time, and nothing is done while they wait."""

from __future__ import annotations

import threading

from builtin_interfaces.msg import Duration, Time
from node_harness import Client, wait_until
import pytest
import rclpy
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.parameter import Parameter
from scene_requests import register_balls, transform
from sensor_msgs.msg import MultiDOFJointState
from spinning import SpinningThread

from scene_graph_msgs.msg import QueryOptions, Status, WhatIf
from scene_graph_ros.node.node import SceneGraphNode


class Spinning:
    """A node in an executor of this process, which counts what the executor does."""

    def __init__(self, domain, kind):
        self.context = rclpy.Context()
        rclpy.init(context=self.context, domain_id=domain)
        self.node = SceneGraphNode(
            "waits",
            context=self.context,
            parameter_overrides=[
                Parameter("min_update_rate", value=1.0),
                Parameter("max_wait", value=60.0),
            ],
        )
        executor = kind(context=self.context)
        executor.add_node(self.node)
        self._thread = SpinningThread(executor)

    @property
    def rounds(self):
        """How often the executor turned."""
        return self._thread.rounds

    def close(self):
        """End the node."""
        self._thread.close()
        self.node.destroy_node()
        rclpy.shutdown(context=self.context)


@pytest.fixture(scope="module", params=[SingleThreadedExecutor, MultiThreadedExecutor])
def spinning(request, domain):
    """A node whose executor is watched."""
    spinning = Spinning(domain, request.param)
    yield spinning
    spinning.close()


@pytest.fixture(scope="module")
def client(domain, spinning):
    """A client of that node, with two balls in the scene."""
    client = Client(domain, "/waits")
    register_balls(client)
    yield client
    client.close()


def until(stamp, seconds, sources=()):
    """Return options that wait for poses."""
    timeout = Duration(sec=int(seconds), nanosec=int(seconds % 1 * 1e9))
    return QueryOptions(minimal_stamp=stamp, timeout=timeout, minimal_stamp_sources=list(sources))


@pytest.fixture
def move(client):
    """Publish a pose of ball b with a stamp."""
    publisher = client.publisher(MultiDOFJointState, "/balls/poses")

    def move(stamp, x=0.5):
        message = MultiDOFJointState(joint_names=["b"], transforms=[transform(x)])
        message.header.stamp = stamp
        publisher.publish(message)

    yield move
    client.destroy(publisher)


def test_an_executor_has_nothing_to_do_while_requests_wait(spinning, client, move):
    """Eight waiting requests don't make the executor turn: polling would, thousands of times."""
    stamp = client.now()
    futures = [
        client.start("HasCollisions", options=until(stamp, 50.0, ["balls"])) for _ in range(8)
    ]
    assert client.call("GetPoseInWorld", frames=["balls/b"]).status.code == Status.OK
    before = spinning.rounds
    threading.Event().wait(1.0)
    # Requests that came late, a few idle updates, diagnostics, and the notice of discovery.
    assert spinning.rounds - before < 200
    assert not any(future.done() for future in futures)
    move(stamp)
    wait_until(lambda: all(future.done() for future in futures), "all answers")
    assert [future.result().status.code for future in futures] == [Status.OK] * 8
    assert {future.result().stamp.nanosec for future in futures} == {stamp.nanosec}


def test_each_request_has_its_own_deadline(client, move):
    """Those that wait in vain end each in its time, though one that waits longer came first."""
    stamp = client.now()
    first = client.start("HasCollisions", options=until(stamp, 50.0, ["balls"]))
    short = {s: client.start("HasCollisions", options=until(stamp, s)) for s in (0.7, 0.2)}
    wait_until(lambda: all(future.done() for future in short.values()), "the ends of waiting")
    for seconds, future in short.items():
        assert future.result().status.code == Status.STALE
        assert f"after {seconds:.3f} s of waiting" in future.result().status.message
    assert not first.done()
    move(stamp)
    wait_until(first.done, "the answer")
    assert first.result().status.code == Status.OK


def test_an_unknown_source_is_not_waited_for(client):
    """Poses of a source that is not there never come, which is told at once."""
    answer = client.call("HasCollisions", options=until(client.now(), 50.0, ["ghost"]))
    assert answer.status.code == Status.UNKNOWN_NAME


def test_poses_of_an_unknown_frame_are_not_waited_with(client):
    """Nor are options that are wrong in another way: no pose that comes makes them right."""
    options = until(client.now(), 50.0)
    options.what_if = WhatIf(frames=["nobody"], poses=[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
    answer = client.call("HasCollisions", options=options)
    assert answer.status.code == Status.UNKNOWN_NAME


def test_a_bad_request_is_refused_after_waiting(client, move):
    """What is wrong with a request is told also where it had to wait first."""
    stamp = client.now()
    future = client.start("GetPoseInWorld", options=until(stamp, 50.0), frames=["nobody"])
    assert client.call("HasCollisions").status.code == Status.OK
    assert not future.done()
    move(stamp)
    wait_until(future.done, "the refusal")
    assert future.result().status.code == Status.UNKNOWN_NAME


def test_who_waits_is_answered_though_no_thread_is_left_to_do_it(spinning, client, monkeypatch):
    """A node that is destroyed ends them at once: what they were left to do would be lost."""
    future = client.start("HasCollisions", options=until(Time(sec=2**31 - 1), 50.0))
    assert client.call("HasCollisions").status.code == Status.OK
    waiting = spinning.node.server._services._waiting
    wait_until(lambda: waiting._waiting, "the request that waits")
    monkeypatch.setattr(waiting, "_post", lambda task: None)
    spinning.node.trigger_deactivate()
    try:
        wait_until(future.done, "the end of waiting")
        assert future.result().status.code == Status.STALE
    finally:
        spinning.node.trigger_activate()


def test_a_node_that_stops_taking_poses_lets_nobody_wait(spinning, client):
    """Deactivation ends all waiting with STALE; inactive, nobody begins to wait."""
    options = until(Time(sec=2**31 - 1), 50.0)
    future = client.start("HasCollisions", options=options)
    assert client.call("HasCollisions").status.code == Status.OK
    assert not future.done()
    spinning.node.trigger_deactivate()
    try:
        wait_until(future.done, "the end of waiting")
        assert future.result().status.code == Status.STALE
        assert client.call("HasCollisions", options=options).status.code == Status.STALE
    finally:
        spinning.node.trigger_activate()
